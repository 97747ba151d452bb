// SPDX-License-Identifier: GPL-3.0-or-later
// Tables as float EXR images, for inspection and to keep them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tables/table.h"

namespace brdfc::inline tables {

/// Rows of numbers, padded with zeros, and what they mean.
struct TableImage {
  int width = 1, height = 1, channels = 1;
  std::vector<float> pixels;  ///< row-major, channels innermost
  std::string meta;           ///< JSON, in the attribute "brdfc:table"
};

/// A row a table, in this order, without meta. A table of one channel beside others of three is the same in all.
TableImage image_of(const std::vector<const Table*>&);
/// The values of a table with so many points and channels, by its row; nothing if the image has no such row, or it is
/// shorter.
std::optional<std::vector<double>> values_in(const TableImage&, std::size_t row, std::size_t points, int channels);

/// The same image gives the same bytes. Written beside and renamed. Throws InputError naming the path if it can't be
/// written.
void write_table_image(const TableImage&, const std::filesystem::path&);
/// Throws InputError naming the path if it can't be read or has no such attribute.
TableImage read_table_image(const std::filesystem::path&);

}  // namespace brdfc::inline tables
