// SPDX-License-Identifier: GPL-3.0-or-later
// Images and renderings; the first byte picks the format.
#include "fuzz.h"
#include "reference/color.h"
#include "reference/image.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace brdfc;
  if (size < 1) return 0;
  const char* names[] = {"a.exr", "a.hdr", "a.png"};
  const auto path = fuzz::write(names[data[0] % 3], data + 1, size - 1);
  fuzz::expect_value_or_input_error([&] { reference::read_rendering(path); });
  fuzz::expect_value_or_input_error([&] { reference::read_image(path, reference::ColorConfig::current()); });
  return 0;
}
