// SPDX-License-Identifier: GPL-3.0-or-later
// Tables as float EXR images, for storage and inspection.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tables/table.h"

namespace brdfc::inline tables {

/// Rows of numbers, padded with zeros, with a description.
struct TableImage {
  int width = 1, height = 1, channels = 1;
  std::vector<float> pixels;  ///< row-major, channels innermost
  std::string meta;           ///< JSON, in the attribute "brdfc:table"
};

/// Makes an image with one row for each table, in this order, and without meta. If some tables have three channels, the
/// value of a one-channel table is repeated in all three.
TableImage image_of(const std::vector<const Table*>&);
/// The values of the table in row `row`, which has this number of points and channels; nullopt if there is no such row
/// or it is too short.
std::optional<std::vector<double>> values_in(const TableImage&, std::size_t row, std::size_t points, int channels);

/// Writes the image to a temporary file and renames it. Equal images give equal bytes. Throws InputError that names the
/// path if it can't be written.
void write_table_image(const TableImage&, const std::filesystem::path&);
/// Reads an image. Throws InputError that names the path if it can't be read or has no such attribute.
TableImage read_table_image(const std::filesystem::path&);

}  // namespace brdfc::inline tables
