// SPDX-License-Identifier: GPL-3.0-or-later
// The explorer: a page for browsers that draws the models, from their own formulas.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"
#include "model/optical.h"

namespace brdfc::pack {

/// The files of the page by name: models.js, with the formulas of the models as GLSL and the hand-written GLSL, and the
/// hand-written pages, styles and scripts in `source`, a folder that contains index.html. models.js is a script, not
/// data: a page that is opened as a file may not load data. The page converts measured spectra by `to_rgb`, which has
/// to be linear. Throws InputError if index.html is missing.
std::map<std::string, std::string> explorer_page(const std::vector<const Model*>&, const std::filesystem::path& source,
                                                 const ToRgb& to_rgb);

/// Throws InputError if the folder contains anything other than this page as written before.
void require_explorer(const std::filesystem::path& folder);

}  // namespace brdfc::pack
