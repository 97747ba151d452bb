// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text_file.h"

#include <cstdint>
#include <fstream>
#include <iterator>

#include "core/error.h"

namespace brdfc::inline core {
namespace {

void append_utf8(std::string& out, std::uint32_t code) {
  if (code < 0x80) {
    out += char(code);
    return;
  }
  const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
  constexpr std::uint32_t first[] = {0, 0xC0, 0xE0, 0xF0};
  out += char(first[more] | (code >> (6 * more)));
  for (int i = more - 1; i >= 0; --i) out += char(0x80 | ((code >> (6 * i)) & 0x3F));
}

/// UTF-16 after its mark as UTF-8. Halves of pairs without the other half become U+FFFD.
std::string from_utf16(const std::string& bytes, bool big_endian) {
  std::string out;
  std::uint32_t high = 0;
  for (std::size_t i = 2; i + 1 < bytes.size(); i += 2) {
    const auto first = std::uint8_t(bytes[i]), second = std::uint8_t(bytes[i + 1]);
    const std::uint32_t unit = big_endian ? first << 8 | second : second << 8 | first;
    const bool is_high = unit >= 0xD800 && unit < 0xDC00, is_low = unit >= 0xDC00 && unit < 0xE000;
    if (high && is_low) {
      append_utf8(out, 0x10000 + ((high - 0xD800) << 10 | (unit - 0xDC00)));
      high = 0;
      continue;
    }
    if (high) append_utf8(out, 0xFFFD);
    high = is_high ? unit : 0;
    if (!is_high) append_utf8(out, is_low ? 0xFFFD : unit);
  }
  if (high) append_utf8(out, 0xFFFD);
  return out;
}

}  // namespace

std::string plain_text(const std::string& bytes, const std::string& file) {
  std::string text = bytes.starts_with("\xff\xfe")       ? from_utf16(bytes, false)
                     : bytes.starts_with("\xfe\xff")     ? from_utf16(bytes, true)
                     : bytes.starts_with("\xef\xbb\xbf") ? bytes.substr(3)
                                                         : bytes;
  if (text.find('\0') != std::string::npos)
    input_error("{}: expected text, in UTF-8, or in UTF-16 with a byte-order mark", file);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool ends = text[i] == '\r';
    if (ends && i + 1 < text.size() && text[i + 1] == '\n') ++i;
    text[kept++] = ends ? '\n' : text[i];
  }
  text.resize(kept);
  return text;
}

std::vector<std::string> read_lines(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::error_code ignored;
  if (!in || std::filesystem::is_directory(file, ignored)) input_error("{}: cannot be read", file.string());
  const std::string text = plain_text({std::istreambuf_iterator<char>(in), {}}, file.string());
  std::vector<std::string> out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    out.push_back(text.substr(at, end == std::string::npos ? end : end - at));
    at = end == std::string::npos ? text.size() : end + 1;
  }
  return out;
}

}  // namespace brdfc::inline core
