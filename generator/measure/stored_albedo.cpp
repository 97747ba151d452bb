// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/stored_albedo.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/text.h"
#include "measure/albedo_file.h"
#include "measure/albedo_settings.h"
#include "measure/formula.h"
#include "measure/tabulate_albedo.h"
#include "model/choices.h"

namespace brdfc::measure {

bool has_albedo_table(const Model& model) {
  if (!model.info().properties.albedo_table) return false;
  const std::vector<ParamInfo>& params = model.info().params;
  return model.has_scatter() ||
         std::count_if(params.begin(), params.end(), [](const auto& p) { return p.kind == ParamKind::Number; }) < 3;
}

StoreKey stored_albedo(const Model& model) {
  StoreKey key("albedos", model.info().name);
  // The defaults of numbers are part of the key, unlike those of choices: a coefficient that does not depend on a
  // number is tabulated at its default.
  key.add("defaults", format_values(model.info(), complete(model.info(), {})));
  for (const ParamInfo& p : model.info().params)
    key.add(p.name, fmt::format("{} {} {} {}", int(p.kind), p.min, p.max, join(p.choices, " ")));
  for (const Choices& choices : choice_combinations(model.info()))
    key.add("formula", formula_of(model, with_choices(model.info(), choices)));
  return key.add_settings(kTableSettings);
}

AlbedoTable albedo_table_of(const Model& model) {
  const auto read = [&](const std::filesystem::path& path) {
    AlbedoTable table = read_albedo_exr(path);
    if (table.model != model.info().name)
      input_error("{}: model: expected {}, got {}", path.string(), model.info().name, table.model);
    return table;
  };
  return kept_or_made(
      stored_albedo(model), "stored albedo of " + model.info().name, "up to a minute", read,
      [&] { return tabulate_albedo(model); }, write_albedo_exr);
}

}  // namespace brdfc::measure
