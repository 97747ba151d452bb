// SPDX-License-Identifier: GPL-3.0-or-later
// Scene files: JSON, then meaning.
#include "fuzz.h"
#include "reference/scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace brdfc;
  fuzz::expect_value_or_input_error([&] { load_scene(fuzz::write("scene.json", data, size)); });
  return 0;
}
