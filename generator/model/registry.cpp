// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/registry.h"

#include <algorithm>
#include <set>

#include "core/text.h"
#include "print/reserved.h"

namespace brdfc::inline model {
namespace {

void check_identifier(const std::string& what, const std::string& name) {
  // Identifiers occur in OSL, Python and file names, so they may have lower-case letters, digits and underscores only.
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::islower(c) || std::isdigit(c) || c == '_';
  });
  if (!plain || !std::islower(static_cast<unsigned char>(name[0])))
    input_error("{} '{}': expected lower-case letters, digits and underscores, and a letter first", what, name);
}

void check_free(const std::string& what, const std::string& name, const std::optional<std::string>& taken_by) {
  if (taken_by) input_error("{} '{}': expected another name: {} uses this one", what, name, *taken_by);
}

void check(const ModelInfo& info) {
  check_identifier("model name", info.name);
  check_free("model name", info.name, print::reserved_for_models(info.name));
  if (info.look == Look::Undeclared) input_error("{}: expected a look, such as .look = Look::Matte", info.name);
  // Nodes have sockets with these names in addition to those of the parameters.
  std::set<std::string> names, labels = {"Normal", "Tangent"};
  for (const ParamInfo& p : info.params) {
    check_identifier(info.name + ": parameter name", p.name);
    check_free(info.name + ": parameter name", p.name, print::reserved_for_parameters(p.name));
    if (!names.insert(p.name).second) input_error("{}: two parameters are named {}", info.name, p.name);
    if (!p.label.empty() && !labels.insert(p.label).second)
      input_error("{}: {}: expected another label than '{}', which another socket of the node has", info.name, p.name,
                  p.label);
    for (const std::string& c : p.choices) check_identifier(info.name + ": " + p.name + ": choice", c);
    if (!(p.min <= p.soft_min && p.soft_min <= p.soft_max && p.soft_max <= p.max))
      input_error("{}: {}: the slider's range must lie inside the accepted one", info.name, p.name);
    if (p.by_factors && !(p.min >= 0))
      input_error("{}: {}: a number that goes by factors must not be negative", info.name, p.name);
  }
}

}  // namespace

void Registry::add(std::unique_ptr<Model> model, const std::string& file) {
  const std::string name = model->info().name;
  try {
    check(model->info());
    require_bound(*model);
    const auto [first, is_new] = files_.emplace(name, file);
    if (!is_new) input_error("two models are named {}, the other in {}", name, first->second);
    models_.emplace(name, std::move(model));
  } catch (const InputError& e) {
    errors_.push_back(file + ": " + e.what());
  }
}

const std::map<std::string, std::unique_ptr<Model>>& Registry::models() const {
  if (!errors_.empty()) input_error("{}", join(errors_, "; "));
  return models_;
}

}  // namespace brdfc::inline model
