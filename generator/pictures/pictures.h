// SPDX-License-Identifier: GPL-3.0-or-later
// Picture files as plain data. Only this room uses OpenImageIO's library of file formats. It is loaded when the first
// file is read or written, because Debian's takes 0.2 s to load.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace brdfc::pictures {

/// An attribute of a file: a text, a number or several.
struct Attribute {
  std::string name;
  std::variant<std::string, int, float, std::vector<float>> value;
};

/// All of a picture but its pixels.
struct Header {
  int width = 0, height = 0;
  int depth = 1;                        ///< greater than 1 for volumes
  std::vector<std::string> channels{};  ///< names; where one is empty, OpenImageIO writes its own
  /// Whether pixels are stored as floating-point numbers. What is written then has 32 bits, otherwise 8 bits.
  bool floating = true;
  std::vector<Attribute> attributes{};

  /// The text of an attribute; empty if there is no such text. Capitals and small letters count as equal.
  std::string text(std::string_view name) const;
  /// An attribute of that many numbers; nullopt if there is none.
  std::optional<std::vector<float>> numbers(std::string_view name, std::size_t count) const;
};

/// A picture file that is open.
class Reader {
 public:
  virtual ~Reader() = default;
  virtual const Header& header() const = 0;
  /// Reads all pixels, with interleaved channels. Integers become numbers in [0, 1]. There must be room for width *
  /// height * channels numbers. Returns OpenImageIO's error, or nullopt if there was none.
  virtual std::optional<std::string> read(float* pixels) = 0;
};

/// Opens a file. `format` names the only format to try, such as "png"; if it is empty, all are tried. Returns nullptr
/// and sets `reason` to OpenImageIO's error if the file can't be opened.
std::unique_ptr<Reader> open(const std::filesystem::path&, std::string& reason, const std::string& format = "");

struct WriteError {
  bool unknown_format;  ///< no format has the file's extension
  std::string reason;   ///< OpenImageIO's error
};

/// Writes a file in the format of its extension. Returns nullopt if that succeeded. A byte of 255 is a value of 1.
std::optional<WriteError> write(const std::filesystem::path&, const Header&, std::span<const float> pixels);
std::optional<WriteError> write(const std::filesystem::path&, const Header&, std::span<const unsigned char> pixels);

/// Loads OpenImageIO now, before a calculation whose result could not be written without it. All functions above throw
/// InputError if it can't be loaded.
void require();

}  // namespace brdfc::pictures
