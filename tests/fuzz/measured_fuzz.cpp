// SPDX-License-Identifier: GPL-3.0-or-later
// Measured BRDFs; the first byte picks the format. A file that is read is evaluated, too.
#include <cmath>

#include "fuzz.h"
#include "measured/measurement.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace brdfc;
  if (size < 1) return 0;
  const char* names[] = {"a.bsdf", "a.csv", "a.binary", "a.bin", "a.alta", "a.xml"};
  const auto path = fuzz::write(names[data[0] % 6], data + 1, size - 1);
  fuzz::expect_value_or_input_error([&] {
    const auto m = measured::read_measurement(path, [](const Xyz& xyz) { return xyz; });
    for (int i = 0; i < 64; ++i) {
      const Rgb<double> f =
          m.table->eval(direction(1 - (i % 8) / 8.1, 0.7 * i), direction(1 - (i / 8) / 8.1, -1.3 * i));
      if (!(f.r >= 0 && std::isfinite(f.r))) std::abort();
    }
  });
  return 0;
}
