// SPDX-License-Identifier: GPL-3.0-or-later
#include "pictures/pictures.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "core/error.h"
#include "core/process.h"
#include "pictures/library.h"

namespace brdfc::pictures {

namespace fs = std::filesystem;

namespace {

bool same_name(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

/// The first attribute of that name; nullptr if there is none.
const Attribute* find(const Header& header, std::string_view name) {
  const auto found = std::ranges::find_if(header.attributes, [&](const auto& a) { return same_name(a.name, name); });
  return found == header.attributes.end() ? nullptr : &*found;
}

#ifdef BRDFC_PICTURES_MODULE
fs::path module_file() {
  // Beside the program in a build, in lib/brdfc as `cmake --install` lays it out.
  const fs::path program = program_file(), beside = program.parent_path() / BRDFC_PICTURES_MODULE,
                 installed = program.parent_path().parent_path() / "lib" / "brdfc" / BRDFC_PICTURES_MODULE;
  for (const fs::path& file : {beside, installed})
    if (fs::exists(file)) return file;
  input_error("the module for picture files is missing: expected {} or {}", beside.string(), installed.string());
}

const Library& library() {
  static const Library& loaded = load(module_file());  // is tried again if it throws
  return loaded;
}
#else
const Library& library() { return *brdfc_pictures_library(); }
#endif

template <class T>
std::optional<WriteError> write_pixels(const fs::path& path, const Header& header, std::span<const T> pixels) {
  if (pixels.size() != std::size_t(header.width) * std::size_t(header.height) * header.channels.size())
    throw std::logic_error(path.string() + ": pixels do not match the header");
  return library().write(path, header, pixels.data());
}

}  // namespace

const Library& load(const fs::path& module) {
  using Entry = decltype(brdfc_pictures_library);
  return *reinterpret_cast<Entry*>(load_symbol(module, "brdfc_pictures_library"))();
}

std::string Header::text(std::string_view name) const {
  const Attribute* found = find(*this, name);
  const auto* text = found ? std::get_if<std::string>(&found->value) : nullptr;
  return text ? *text : "";
}

std::optional<std::vector<float>> Header::numbers(std::string_view name, std::size_t count) const {
  const Attribute* found = find(*this, name);
  const auto* numbers = found ? std::get_if<std::vector<float>>(&found->value) : nullptr;
  return numbers && numbers->size() == count ? std::optional(*numbers) : std::nullopt;
}

std::unique_ptr<Reader> open(const fs::path& path, std::string& reason, const std::string& format) {
  return library().open(path, reason, format);
}

std::optional<WriteError> write(const fs::path& path, const Header& header, std::span<const float> pixels) {
  return write_pixels(path, header, pixels);
}

std::optional<WriteError> write(const fs::path& path, const Header& header, std::span<const unsigned char> pixels) {
  return write_pixels(path, header, pixels);
}

void require() { library(); }

}  // namespace brdfc::pictures
