// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/model.h"

#include <algorithm>

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
  input_error("unknown model '{}': {}`brdfc list` prints all models", name, did_you_mean(name, names));
}

std::vector<const Model*> models_named(const std::string& name) {
  if (!name.empty()) return {&find_model(name)};
  std::vector<const Model*> all;
  for (const auto& [n, model] : models()) all.push_back(model.get());
  return all;
}

const PackedFormulas* fastest([[maybe_unused]] const PackedFormulas* x86_64_v3,
                              [[maybe_unused]] const PackedFormulas* x86_64_v4) {
#if defined(__x86_64__) && !defined(__clang__)
  __builtin_cpu_init();  // called before main()
  if (__builtin_cpu_supports("x86-64-v4")) return x86_64_v4;
  if (__builtin_cpu_supports("x86-64-v3")) return x86_64_v3;
#endif
  return nullptr;
}

void require_bound(const Model& model) {
  if (const auto wrong = model.misbound()) input_error("{}: {}", model.info().name, *wrong);
}

std::optional<std::string> detail::misbound(std::vector<BoundMember> members, std::size_t size) {
  std::ranges::sort(members, {}, &BoundMember::first);
  std::size_t bound = 0;
  for (std::size_t i = 0; i <= members.size(); ++i) {
    const bool last = i == members.size();
    const std::size_t next = last ? size : members[i].first;
    if (next < bound)
      return fmt::format("parameters() binds {} and {} to one member", members[i - 1].name, members[i].name);
    if (next > bound)
      return fmt::format("parameters() leaves out a member, {}: every member of a model has to be a parameter",
                         members.empty() ? "the first one"
                         : i == 0        ? fmt::format("which stands before {}", members[0].name)
                                         : fmt::format("which stands after {}", members[i - 1].name));
    if (!last) bound = members[i].end;
  }
  return std::nullopt;
}

bool register_model(std::unique_ptr<Model> model, const char* file) {
  registry().add(std::move(model), file);
  return true;
}

}  // namespace brdfc::inline model
