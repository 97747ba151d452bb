// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the shader or node tree of a form for a pack.
#pragma once

#include <string>
#include <vector>

#include "forms/recording.h"
#include "forms/setting.h"
#include "forms/shader.h"
#include "measure/albedo_table.h"
#include "model/model.h"

namespace brdfc::forms {

class Emission {
 public:
  virtual ~Emission() = default;

  /// `table` is for the Albedo output, which gets a shader of its own if its text is longer than kMaxAlbedoText. Throws
  /// InputError if the closures exceed Cycles' limit, if the table exceeds that of an array, or if fixed values
  /// contradict Availability::values().
  virtual Shader write(const Model&, const measure::AlbedoTable& table, const Setting& = {}) const = 0;
  /// The programs recorded from a model for one combination of choices, given in `values`; empty for forms made of
  /// nodes.
  virtual std::vector<Recording> recordings(const Model&, const ParamValues& /*values*/, const Setting& = {}) const {
    return {};
  }
  /// Codes of what a user must know about the form. The add-on turns those that apply into sentences.
  virtual std::vector<std::string> warnings(const Model&, const Shader&) const = 0;
  /// True if clamping of light becomes visible depending on the brightness of the form's highlight.
  virtual bool highlights(const Model&, const Shader&) const { return false; }
};

}  // namespace brdfc::forms
