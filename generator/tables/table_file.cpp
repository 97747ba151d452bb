// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/table_file.h"

#include <OpenImageIO/imageio.h>

#include "core/error.h"

namespace brdfc::inline tables {
namespace {

constexpr const char* kMeta = "brdfc:table";

}  // namespace

void write_table_image(const TableImage& image, const std::filesystem::path& path) {
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
  spec.attribute(kMeta, image.meta);
  spec.attribute("compression", "zip");
  // OpenImageIO stamps the present time unless one is given.
  spec.attribute("DateTime", "1980:01:01 00:00:00");
  const std::string beside = path.string() + ".part.exr";
  const auto out = OIIO::ImageOutput::create(beside);
  if (!out) input_error("{}: cannot be written: {}", path.string(), OIIO::geterror());
  if (!out->open(beside, spec) || !out->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()) || !out->close()) {
    const std::string reason = out->geterror();
    std::error_code ignored;
    std::filesystem::remove(beside, ignored);
    input_error("{}: cannot be written: {}", path.string(), reason);
  }
  std::error_code error;
  std::filesystem::rename(beside, path, error);
  if (error) input_error("{}: cannot be written: {}", path.string(), error.message());
}

TableImage read_table_image(const std::filesystem::path& path) {
  const auto in = OIIO::ImageInput::open(path.string());
  if (!in) input_error("{}: cannot be read: {}", path.string(), OIIO::geterror());
  const OIIO::ImageSpec& spec = in->spec();
  TableImage image{spec.width, spec.height, spec.nchannels, {}, std::string(spec.get_string_attribute(kMeta))};
  if (image.meta.empty()) input_error("{}: expected tables, with the attribute {}", path.string(), kMeta);
  image.pixels.resize(std::size_t(image.width) * std::size_t(image.height) * std::size_t(image.channels));
  if (!in->read_image(0, 0, 0, image.channels, OIIO::TypeDesc::FLOAT, image.pixels.data()))
    input_error("{}: cannot be read: {}", path.string(), in->geterror());
  return image;
}

void replace_stored(const std::filesystem::path& path, const std::string& model,
                    const std::function<void(const std::filesystem::path&)>& write) {
  const std::filesystem::path folder = path.parent_path();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) input_error("{}: cannot be created: {}", folder.string(), error.message());
  write(path);
  const std::string prefix = model + "_";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().stem().string();
    // Names of models may begin alike: what follows is a hash of 16 digits and no more.
    if (name.starts_with(prefix) && name.size() == prefix.size() + 16 && entry.path() != path)
      std::filesystem::remove(entry.path());
  }
}

}  // namespace brdfc::inline tables
