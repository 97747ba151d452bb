// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/naming.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "report/html.h"

namespace brdfc::report {
namespace {

/// Names of Blender's own nodes, by form.
constexpr std::pair<const char*, const char*> kNodes[] = {
    {kNativeForm, "Blender's Glossy node"},
    {"principled", "Blender's Principled node"},
    {"metallic", "Blender's Metallic node"},
};

}  // namespace

bool is_native(const FormReport& f) {
  return std::any_of(std::begin(kNodes), std::end(kNodes), [&](const auto& n) { return f.form == n.first; });
}

std::string label(const FormReport& f) {
  const auto node =
      std::find_if(std::begin(kNodes), std::end(kNodes), [&](const auto& n) { return f.form == n.first; });
  return node == std::end(kNodes) ? f.form : node->second;
}

std::vector<std::string> all_forms(const std::vector<SceneReport>& scenes) {
  std::vector<std::string> out;
  for (const bool native : {true, false})
    for (const SceneReport& s : scenes)
      for (const FormReport& f : s.forms)
        if (is_native(f) == native && std::ranges::find(out, f.form) == out.end()) out.push_back(f.form);
  return out;
}

bool on_front(const SceneReport& s, const FormReport& f) {
  if (!f.cost) return false;
  return std::none_of(s.forms.begin(), s.forms.end(), [&](const FormReport& g) {
    return g.cost && *g.cost <= *f.cost && g.difference.rel_mse <= f.difference.rel_mse &&
           (*g.cost < *f.cost || g.difference.rel_mse < f.difference.rel_mse);
  });
}

std::set<std::string> models_of(const SceneReport& s) {
  std::set<std::string> out;
  for (const FormReport& f : s.forms)
    for (const MaterialForm& m : f.materials)
      if (m.model.find(' ') == std::string::npos) out.insert(m.model);  // not "Blender's Metallic"
  return out;
}

std::string marked(const SceneReport& s) {
  return fmt::format("data-models=\"{}\"", escaped(fmt::format("{}", fmt::join(models_of(s), " "))));
}

}  // namespace brdfc::report
