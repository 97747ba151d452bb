// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/table_file.h"

#include <algorithm>

#include "core/error.h"
#include "core/write_beside.h"
#include "pictures/pictures.h"

namespace brdfc::inline tables {
namespace {

constexpr const char* kMeta = "brdfc:table";

}  // namespace

TableImage image_of(const std::vector<const Table*>& tables) {
  TableImage image;
  for (const Table* t : tables) {
    image.width = std::max(image.width, int(t->points()));
    image.channels = std::max(image.channels, t->channels);
  }
  image.height = std::max(1, int(tables.size()));
  const auto width = std::size_t(image.width), channels = std::size_t(image.channels);
  image.pixels.resize(width * std::size_t(image.height) * channels, 0.f);
  for (std::size_t row = 0; row < tables.size(); ++row) {
    const Table& t = *tables[row];
    for (std::size_t i = 0; i < t.points(); ++i)
      for (std::size_t c = 0; c < channels; ++c)
        image.pixels[(row * width + i) * channels + c] =
            float(t.values[i * std::size_t(t.channels) + (t.channels == 1 ? 0 : c)]);
  }
  return image;
}

std::optional<std::vector<double>> values_in(const TableImage& image, std::size_t row, std::size_t points,
                                             int channels) {
  if (row >= std::size_t(image.height) || points > std::size_t(image.width) || channels < 1 ||
      channels > image.channels)
    return std::nullopt;
  std::vector<double> out;
  for (std::size_t i = 0; i < points; ++i)
    for (std::size_t c = 0; c < std::size_t(channels); ++c)
      out.push_back(image.pixels[(row * std::size_t(image.width) + i) * std::size_t(image.channels) + c]);
  return out;
}

void write_table_image(const TableImage& image, const std::filesystem::path& path) {
  pictures::Header header{image.width, image.height};
  header.channels.resize(std::size_t(image.channels));
  // OpenImageIO writes the present time unless one is set.
  header.attributes = {{kMeta, image.meta}, {"compression", "zip"}, {"DateTime", "1980:01:01 00:00:00"}};
  write_beside(path, [&](const std::filesystem::path& temporary) {
    if (const auto failed = pictures::write(temporary, header, image.pixels))
      input_error("{}: cannot be written: {}", path.string(), failed->reason);
  });
}

TableImage read_table_image(const std::filesystem::path& path) {
  std::string reason;
  const auto in = pictures::open(path, reason);
  if (!in) input_error("{}: cannot be read: {}", path.string(), reason);
  const pictures::Header& header = in->header();
  TableImage image{header.width, header.height, int(header.channels.size()), {}, header.text(kMeta)};
  if (image.meta.empty()) input_error("{}: expected tables, with the attribute {}", path.string(), kMeta);
  image.pixels.resize(std::size_t(image.width) * std::size_t(image.height) * std::size_t(image.channels));
  if (const auto failed = in->read(image.pixels.data())) input_error("{}: cannot be read: {}", path.string(), *failed);
  return image;
}

}  // namespace brdfc::inline tables
