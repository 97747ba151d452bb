// SPDX-License-Identifier: GPL-3.0-or-later
// The list of runs that a report is made from.
#include "fuzz.h"
#include "reference/image.h"
#include "report/report.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace brdfc;
  static const bool ready = [] {
    std::filesystem::create_directories(fuzz::folder() / "report" / "s");
    reference::Rendering r;
    r.mean = reference::Image(2, 2);
    for (float& v : r.mean.rgb) v = 0.5f;
    r.variance = r.mean;
    reference::write_rendering(fuzz::folder() / "report" / "s" / "reference.exr", r);
    return true;
  }();
  (void)ready;
  fuzz::write("report/s/runs.json", data, size);
  fuzz::expect_value_or_input_error([&] { report::load_report(fuzz::folder() / "report"); });
  return 0;
}
