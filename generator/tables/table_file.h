// SPDX-License-Identifier: GPL-3.0-or-later
// Tables as float EXR images, for inspection and to keep them.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace brdfc::inline tables {

/// Rows of numbers, padded with zeros, and what they mean.
struct TableImage {
  int width = 1, height = 1, channels = 1;
  std::vector<float> pixels;  ///< row-major, channels innermost
  std::string meta;           ///< JSON, in the attribute "brdfc:table"
};

/// The same image gives the same bytes. Written beside and renamed. Throws InputError naming the path if it can't be
/// written.
void write_table_image(const TableImage&, const std::filesystem::path&);
/// Throws InputError naming the path if it can't be read or has no such attribute.
TableImage read_table_image(const std::filesystem::path&);

/// Writes the file FOLDER/MODEL_HASH.exr, of a hash of 16 digits, and removes what is there of the model by other
/// hashes. Throws InputError naming the folder if it can't be created.
void replace_stored(const std::filesystem::path&, const std::string& model,
                    const std::function<void(const std::filesystem::path&)>& write);

}  // namespace brdfc::inline tables
