// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/binary_file.h"

#include <cmath>

namespace brdfc::measured {

std::ifstream open_file(const std::filesystem::path& path, std::ios::openmode mode) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) input_error("{}: expected a file, found none", path.string());
  std::ifstream in(path, mode);
  if (!in) input_error("{}: cannot be read", path.string());
  return in;
}

BinaryFile::BinaryFile(const std::filesystem::path& path)
    : name_(path.string()), in_(open_file(path, std::ios::binary)) {
  std::error_code error;
  size_ = std::filesystem::file_size(path, error);
  if (error) input_error("{}: cannot be read", name_);
}

void BinaryFile::seek(std::uint64_t place) {
  place_ = std::min(place, size_);
  in_.seekg(std::streamoff(place_));
}

std::string BinaryFile::text(std::size_t count, const std::string& what) {
  const std::vector<char> all = numbers<char>(count, what);
  return {all.begin(), all.end()};
}

std::string BinaryFile::doubt_of_size(std::uint64_t expected, std::uint64_t doubles) const {
  if (size_ == expected - doubles / 2) return ": are these numbers in single precision?";
  return size_ < expected ? ": truncated?" : "";
}

std::string expected_instead_of(double value) {
  if (!std::isfinite(value)) return "expected finite numbers";
  return "expected reflectances in little-endian byte order, which this is too large for: is the byte order reversed?";
}

void BinaryFile::read(void* to, std::size_t bytes, const std::string& what) {
  in_.read(static_cast<char*>(to), std::streamsize(bytes));
  if (std::size_t(in_.gcount()) != bytes)
    input_error("{}: {}: expected {} bytes from byte {} on, could not read them", name_, what, bytes, place_);
  place_ += bytes;
}

}  // namespace brdfc::measured
