// SPDX-License-Identifier: GPL-3.0-or-later
// What a pack holds of a form.
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

  /// `table` gives the Albedo output, in a shader of its own where its text is longer than kMaxAlbedoText. Throws
  /// InputError if the closures would exceed what Cycles keeps or the table what an array holds, and for fixed values
  /// that differ from Availability::values().
  virtual Shader write(const Model&, const measure::AlbedoTable& table, const Setting& = {}) const = 0;
  /// What is recorded of a model for one combination of choices, which `values` have; nothing for nodes.
  virtual std::vector<Recording> recordings(const Model&, const ParamValues& /*values*/, const Setting& = {}) const {
    return {};
  }
  /// What a user must know of it; the add-on turns each into words where it applies.
  virtual std::vector<std::string> warnings(const Model&, const Shader&) const = 0;
  /// Whether a clamp on light shows in it by how bright its highlight is.
  virtual bool highlights(const Model&, const Shader&) const { return false; }
};

}  // namespace brdfc::forms
