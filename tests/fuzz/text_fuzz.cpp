// SPDX-License-Identifier: GPL-3.0-or-later
// Text of the command line: CSV tables and parameters; the first byte picks one.
#include <sstream>

#include "core/csv.h"
#include "fuzz.h"
#include "model/model.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace brdfc;
  if (size < 1) return 0;
  const std::string text(reinterpret_cast<const char*>(data + 1), size - 1);
  if (data[0] % 2) {
    fuzz::expect_value_or_input_error([&] {
      std::istringstream in(text);
      CsvReader reader(in, "stdin", {"wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"});
      std::vector<double> row;
      while (!reader.empty() && reader.next(row)) reader.unit_vector(row, 0);
    });
    return 0;
  }
  std::vector<std::string> assignments;
  std::istringstream in(text);
  for (std::string a; std::getline(in, a);) assignments.push_back(a);
  for (const auto& [name, model] : models())
    fuzz::expect_value_or_input_error(
        [&, m = model.get()] { format_values(m->info(), parse_values(m->info(), assignments)); });
  return 0;
}
