// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes and arrays; the first byte picks the format.
#include "fuzz.h"
#include "reference/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace brdfc;
  if (size < 1) return 0;
  if (data[0] % 3 == 2) {
    const auto path = fuzz::write("a.npy", data + 1, size - 1);
    fuzz::expect_value_or_input_error([&] { reference::read_npy<float>(path, 3); });
    return 0;
  }
  static constexpr const char* kNames[] = {"a.obj", "a.ply", "a.stl", "a.gltf", "a.glb"};
  const auto path = fuzz::write(kNames[data[0] / 3 % 5], data + 1, size - 1);
  fuzz::expect_value_or_input_error([&] { reference::read_mesh(path, data[0] & 128); });
  return 0;
}
