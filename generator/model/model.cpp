// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/model.h"

#include <algorithm>

namespace brdfc::inline model {
namespace {

std::map<std::string, std::unique_ptr<Model>>& registry() {
  static std::map<std::string, std::unique_ptr<Model>> all;
  return all;
}

void check_identifier(const std::string& what, const std::string& name) {
  // Identifiers reach OSL, Python and file names: letters, digits and underscores only.
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::islower(c) || std::isdigit(c) || c == '_';
  });
  if (!plain || std::isdigit(static_cast<unsigned char>(name[0])))
    throw std::logic_error(what + " '" + name + "': expected lower-case letters, digits and underscores");
}

}  // namespace

const std::map<std::string, std::unique_ptr<Model>>& models() { return registry(); }

const Model& find_model(const std::string& name) {
  const auto it = registry().find(name);
  if (it != registry().end()) return *it->second;
  std::vector<std::string> names;
  for (const auto& [n, model] : registry()) names.push_back(n);
  input_error("unknown model '{}': expected one of {}", name, fmt::join(names, ", "));
}

std::vector<const Model*> models_named(const std::string& name) {
  if (!name.empty()) return {&find_model(name)};
  std::vector<const Model*> all;
  for (const auto& [n, model] : registry()) all.push_back(model.get());
  return all;
}

bool register_model(std::unique_ptr<Model> model) {
  const ModelInfo& info = model->info();
  check_identifier("model name", info.name);
  if (info.look == Look::Undeclared)
    throw std::logic_error(info.name + ": expected a look, such as .look = Look::Matte");
  for (const ParamInfo& p : info.params) {
    check_identifier(info.name + ": parameter name", p.name);
    for (const std::string& c : p.choices) check_identifier(info.name + ": " + p.name + ": choice", c);
    if (!(p.min <= p.soft_min && p.soft_min <= p.soft_max && p.soft_max <= p.max))
      throw std::logic_error(info.name + ": " + p.name + ": the slider's range must lie inside the accepted one");
    if (p.by_factors && !(p.min >= 0))
      throw std::logic_error(info.name + ": " + p.name + ": a number that goes by factors must not be negative");
  }
  const std::string name = info.name;
  if (!registry().emplace(name, std::move(model)).second) throw std::logic_error("two models are named " + name);
  return true;
}

}  // namespace brdfc::inline model
