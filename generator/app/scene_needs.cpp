// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/scene_needs.h"

#include "core/error.h"

namespace brdfc::app {
namespace {

/// A need for each model of a material.
std::vector<plan::MaterialNeed> needs_of(const reference::Material& m, const Cosines& seen) {
  std::vector<plan::MaterialNeed> needs;
  for (const measured::Lobe& lobe : m.sum) needs.push_back({m.id, lobe.model, lobe.values, {}, m.representation, seen});
  if (m.own) return needs;
  plan::MaterialNeed need{m.id, m.model, m.values, m.varying, m.representation, seen};
  for (const auto& [name, image] : m.textures) need.textured.insert(name);
  needs.push_back(std::move(need));
  return needs;
}

}  // namespace

reference::Scene load_scene(const std::filesystem::path& path) {
  reference::Scene scene = reference::load_scene(path);
  for (const reference::Material& m : scene.materials) {
    if (m.representation == "auto") continue;
    const std::string place = fmt::format("{}: materials.{}.representation", path.string(), m.id);
    const auto needs = needs_of(m, {});
    for (std::size_t k = 0; k < needs.size(); ++k)
      plan::require_form(needs[k], m.sum.empty() ? place : fmt::format("{}: lobe {}", place, k + 1));
  }
  return scene;
}

std::vector<plan::MaterialNeed> needs_of(const std::vector<reference::Material>& materials,
                                         const std::vector<Cosines>& views) {
  reference::require_models(materials);
  std::vector<plan::MaterialNeed> needs;
  for (std::size_t i = 0; i < materials.size(); ++i)
    for (plan::MaterialNeed& need : needs_of(materials[i], views.empty() ? Cosines{} : views[i]))
      needs.push_back(std::move(need));
  return needs;
}

}  // namespace brdfc::app
