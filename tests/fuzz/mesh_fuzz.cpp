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
  const auto path = fuzz::write(data[0] % 3 ? "a.obj" : "a.ply", data + 1, size - 1);
  fuzz::expect_value_or_input_error([&] { reference::read_mesh(path, data[0] & 8); });
  return 0;
}
