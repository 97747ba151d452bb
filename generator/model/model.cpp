// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/model.h"

#include "core/nearest.h"
#include "model/registry.h"

namespace brdfc::inline model {
namespace {

Registry& registry() {
  static Registry all;
  return all;
}

}  // namespace

const std::map<std::string, std::unique_ptr<Model>>& models() { return registry().models(); }

const Model& find_model(const std::string& name) {
  const auto it = models().find(name);
  if (it != models().end()) return *it->second;
  std::vector<std::string> names;
  for (const auto& [n, model] : models()) names.push_back(n);
  input_error("unknown model '{}': {}expected one of {}", name, did_you_mean(name, names), fmt::join(names, ", "));
}

std::vector<const Model*> models_named(const std::string& name) {
  if (!name.empty()) return {&find_model(name)};
  std::vector<const Model*> all;
  for (const auto& [n, model] : models()) all.push_back(model.get());
  return all;
}

const PackedFormulas* fastest([[maybe_unused]] const PackedFormulas* baseline,
                              [[maybe_unused]] const PackedFormulas* x86_64_v3,
                              [[maybe_unused]] const PackedFormulas* x86_64_v4) {
#if defined(__x86_64__) && !defined(__clang__)
  __builtin_cpu_init();  // called before main()
  if (__builtin_cpu_supports("x86-64-v4")) return x86_64_v4;
  if (__builtin_cpu_supports("x86-64-v3")) return x86_64_v3;
#endif
  return baseline;
}

bool register_model(std::unique_ptr<Model> model, const char* file) {
  registry().add(std::move(model), file);
  return true;
}

}  // namespace brdfc::inline model
