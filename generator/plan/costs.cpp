// SPDX-License-Identifier: GPL-3.0-or-later
#include "plan/costs.h"

#include <cmath>
#include <fstream>
#include <sstream>

#include "core/error.h"
#include "core/parse.h"

namespace brdfc::plan {
namespace {

/// The name of the row with the unit of cost, which is beside the forms of a model.
constexpr const char* kUnit = "glossy";

}  // namespace

Costs::Costs(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) return;
  std::ifstream in(path);
  std::string line;
  const std::string columns = "model,form,cost";
  if (!std::getline(in, line) || !line.starts_with(columns))
    input_error("{}: line 1: expected the columns {}, got '{}'", path.string(), columns, line);
  for (int number = 2; std::getline(in, line); ++number) {
    std::istringstream fields(line);
    std::string model, form, cost;
    std::getline(fields, model, ',');
    std::getline(fields, form, ',');
    std::getline(fields, cost, ',');
    const std::string where = fmt::format("{}: line {}", path.string(), number);
    if (model.empty()) input_error("{}: model: expected a name, got none", where);
    try {
      if (form != kUnit) forms::form(form);
    } catch (const InputError& e) {
      input_error("{}: form: {}", where, e.what());
    }
    const auto value = parse(cost);
    if (!value || !std::isfinite(*value) || *value <= 0)
      input_error("{}: cost: expected a positive number, got '{}'", where, cost);
    if (!costs_.emplace(std::pair(model, form), *value).second)
      input_error("{}: form: expected one row for {} of {}, got a second", where, form, model);
  }
  if (!in.eof()) input_error("{}: cannot be read", path.string());
}

std::optional<double> Costs::of(const Model& model, const forms::Form& form) const {
  const auto it = costs_.find({model.info().name, form.name()});
  return it == costs_.end() ? std::nullopt : std::optional(it->second);
}

}  // namespace brdfc::plan
