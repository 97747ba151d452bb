// SPDX-License-Identifier: GPL-3.0-or-later
// Scene files: JSON, then its meaning. Inputs that ask for many pixels or triangles are skipped: reading them is no
// different but takes long.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "fuzz.h"
#include "reference/scene.h"

namespace {

bool is_large(const nlohmann::json& j) {
  for (const auto& [key, value] : j.items()) {
    if (value.is_structured() && is_large(value)) return true;
    if ((key == "width" || key == "segments" || key == "rings") && value.is_number() && value > 64 && value < 20000)
      return true;
  }
  return false;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace brdfc;
  // The reader checks the nesting depth; this parser only gets inputs that are not deeply nested.
  if (std::count(data, data + size, '[') + std::count(data, data + size, '{') < 1000 &&
      is_large(nlohmann::json::parse(data, data + size, nullptr, false)))
    return 0;
  fuzz::expect_value_or_input_error([&] { reference::load_scene(fuzz::write("scene.json", data, size)); });
  return 0;
}
