// SPDX-License-Identifier: GPL-3.0-or-later
// Reads numbers from a binary file with a known size.
#pragma once

#include <bit>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/error.h"

namespace brdfc::measured {

static_assert(std::endian::native == std::endian::little, "the formats are little-endian, and bytes are not swapped");

/// Throws InputError if the path is not a file that can be read.
std::ifstream open_file(const std::filesystem::path&, std::ios::openmode = std::ios::in);

class BinaryFile {
 public:
  /// See open_file().
  explicit BinaryFile(const std::filesystem::path& path);

  const std::string& name() const { return name_; }
  std::uint64_t size() const { return size_; }
  void seek(std::uint64_t place);
  /// The next `count` numbers. `what` names them in the message if the file ends before.
  template <class N> std::vector<N> numbers(std::size_t count, const std::string& what) {
    if (count > (size_ - place_) / sizeof(N))
      input_error("{}: {}: expected {} numbers of {} bytes from byte {} on, the file has {} bytes: truncated?", name_,
                  what, count, sizeof(N), place_, size_);
    std::vector<N> out(count);
    read(out.data(), count * sizeof(N), what);
    return out;
  }
  template <class N> N number(const std::string& what) { return numbers<N>(1, what)[0]; }
  std::string text(std::size_t count, const std::string& what);

  /// What may be wrong if the file has not the `expected` size, of which `doubles` bytes are doubles; "" if no guess.
  std::string doubt_of_size(std::uint64_t expected, std::uint64_t doubles) const;

 private:
  void read(void* to, std::size_t bytes, const std::string& what);

  std::string name_;
  std::ifstream in_;
  std::uint64_t size_ = 0, place_ = 0;
};

/// Of a number that is too large for a float: what was expected.
std::string expected_instead_of(double);

}  // namespace brdfc::measured
