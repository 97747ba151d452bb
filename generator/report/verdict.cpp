// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/verdict.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace brdfc::report {
namespace {

/// Names of Blender's own nodes, by form.
constexpr std::pair<const char*, const char*> kNodes[] = {
    {kNativeForm, "Blender's Glossy node"},
    {"principled", "Blender's Principled node"},
    {"metallic", "Blender's Metallic node"},
};

}  // namespace

bool is_native(const std::string& form) {
  return std::any_of(std::begin(kNodes), std::end(kNodes), [&](const auto& n) { return form == n.first; });
}

std::string label(const std::string& form) {
  const auto node = std::find_if(std::begin(kNodes), std::end(kNodes), [&](const auto& n) { return form == n.first; });
  return node == std::end(kNodes) ? form : node->second;
}

std::vector<std::string> all_forms(const std::vector<SceneReport>& scenes) {
  std::vector<std::string> out;
  for (const bool native : {true, false})
    for (const SceneReport& s : scenes)
      for (const FormReport& f : s.forms)
        if (is_native(f.form) == native && std::ranges::find(out, f.form) == out.end()) out.push_back(f.form);
  return out;
}

std::set<std::string> models_of(const SceneReport& s) {
  std::set<std::string> out;
  for (const FormReport& f : s.forms)
    for (const MaterialForm& m : f.materials)
      if (m.model.find(' ') == std::string::npos) out.insert(m.model);  // not "Blender's Metallic"
  return out;
}

const FormReport* default_form(const SceneReport& s) {
  for (const char* name : {"auto", "exact", "aimed"})
    for (const FormReport& f : s.forms)
      if (f.form == name) return &f;
  return nullptr;
}

bool differs(const FormReport& f) { return f.test ? !f.test->passed() : f.difference.biased(); }

bool on_front(const SceneReport& s, const FormReport& f) {
  if (!f.cost) return false;
  return std::none_of(s.forms.begin(), s.forms.end(), [&](const FormReport& g) {
    return g.cost && *g.cost <= *f.cost && g.difference.rel_mse <= f.difference.rel_mse &&
           (*g.cost < *f.cost || g.difference.rel_mse < f.difference.rel_mse);
  });
}

Verdict verdict_of(const std::vector<SceneReport>& scenes) {
  Verdict out;
  for (const SceneReport& s : scenes) {
    if (const FormReport* f = default_form(s)) {
      ++out.judged;
      out.same += !differs(*f);
      if (f->cost) out.costs.push_back(*f->cost);
    }
    for (const FormReport& f : s.forms)
      if (!is_native(f.form) && f.difference.biased() &&
          (!out.worst || std::abs(f.difference.bias) > std::abs(out.worst->difference.bias)))
        out.worst_scene = &s, out.worst = &f;
  }
  std::sort(out.costs.begin(), out.costs.end());
  return out;
}

}  // namespace brdfc::report
