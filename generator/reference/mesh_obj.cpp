// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/error.h"
#include "core/parse.h"
#include "reference/mesh_file.h"

namespace brdfc::reference {

namespace {

constexpr std::string_view kBlank = " \t\r\v\f";

/// Removes the first word from a text and returns it; empty at the end of the text.
std::string_view next_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(kBlank));
  text.remove_prefix(word.size());
  return word;
}

class ObjReader {
 public:
  explicit ObjReader(const std::filesystem::path& path) : name_(path.string()), bytes_(read_bytes(path)) {}

  MeshFile read() {
    std::string joined;
    for (std::string_view rest = bytes_; !rest.empty();) {
      std::string_view line = take_line(rest);
      // A backslash at the end of a line joins it to the next one.
      if (ends_in_backslash(line)) {
        joined.clear();
        while (ends_in_backslash(line)) {
          joined += line.substr(0, line.rfind('\\'));
          joined += ' ';
          line = take_line(rest);
        }
        joined += line;
        line = joined;
      }
      read_line(without_comment(line));
    }
    check_corners();
    return std::move(file_);
  }

 private:
  std::string_view take_line(std::string_view& rest) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    ++line_;
    return line;
  }

  static bool ends_in_backslash(std::string_view line) {
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line.ends_with('\\');
  }

  /// A comment begins at the start of a line or after a blank; the # in 1.#QNAN does not begin one.
  static std::string_view without_comment(std::string_view line) {
    for (std::size_t i = 0; i < line.size(); ++i)
      if (line[i] == '#' && (i == 0 || kBlank.find(line[i - 1]) != kBlank.npos)) return line.substr(0, i);
    return line;
  }

  template <class... Args> [[noreturn]] void error(fmt::format_string<Args...> format, Args&&... args) const {
    input_error("{} line {}: {}", name_, line_, fmt::format(format, std::forward<Args>(args)...));
  }

  void read_line(std::string_view line) {
    std::string_view rest = line;
    const std::string_view key = next_word(rest);
    if (key == "v") {
      file_.positions.push_back(numbers<3>(rest, 3));
    } else if (key == "vn") {
      file_.normals.push_back(numbers<3>(rest, 3));
    } else if (key == "vt") {
      file_.uvs.push_back(numbers<2>(rest, 1));
    } else if (key == "f" || key == "fo") {
      while (true) {
        const std::string_view word = next_word(rest);
        if (word.empty()) break;
        file_.corners.push_back(corner(word));
      }
      const std::size_t before = file_.ends.size();
      file_.end_face(material_);
      if (file_.ends.size() > before) lines_.push_back(line_);
    } else if (key == "usemtl") {
      rest.remove_prefix(std::min(rest.find_first_not_of(kBlank), rest.size()));
      const std::string_view name = rest.substr(0, rest.find_last_not_of(kBlank) + 1);
      material_ = name.empty() ? -1 : file_.material(name);
    } else if (key == "l") {
      ++file_.left_out["line"];
    } else if (key == "p") {
      ++file_.left_out["point"];
    } else if (key == "curv" || key == "curv2" || key == "surf") {
      ++file_.left_out["curve or free-form surface"];
    }
  }

  /// N numbers. The first `needed` must be present, missing others are 0, and those after N are ignored.
  template <std::size_t N> std::array<float, N> numbers(std::string_view rest, std::size_t needed) const {
    std::array<float, N> out{};
    for (std::size_t i = 0; i < N; ++i) {
      std::string_view word = next_word(rest);
      if (word.empty() && i >= needed) break;
      const std::string_view all = word;
      if (word.starts_with('+')) word.remove_prefix(1);
      // Windows C libraries write values that are not numbers like this: 1.#QNAN, -1.#IND.
      const auto value = word.find('#') != word.npos ? std::nan("") : parse<double>(word);
      if (!value) error("expected {} numbers, got '{:.60}'", N, all);
      out[i] = float(*value);
    }
    return out;
  }

  /// "position", "position/uv", "position//normal" or "position/uv/normal". Indices count from 1, negative ones from
  /// the end.
  MeshFile::Corner corner(std::string_view word) const {
    const std::string_view all = word;
    MeshFile::Corner c;
    for (const auto& [index, size, what] :
         {std::tuple(&c.position, file_.positions.size(), "vertex"), std::tuple(&c.uv, file_.uvs.size(), "UV"),
          std::tuple(&c.normal, file_.normals.size(), "normal")}) {
      const std::string_view part = word.substr(0, word.find('/'));
      word.remove_prefix(std::min(part.size() + 1, word.size()));
      if (part.empty() && index != &c.position) continue;
      const auto number = parse<std::int64_t>(part);
      if (!number || *number == 0) error("expected a corner as 1, 1/2, 1//3 or 1/2/3, got '{:.60}'", all);
      const std::int64_t place = *number < 0 ? std::int64_t(size) + *number : *number - 1;
      if (place < 0 || place > std::numeric_limits<std::int32_t>::max())
        error("the corner '{:.60}' goes back before the first {}", all, what);
      *index = std::int32_t(place);
    }
    return c;
  }

  /// Checks the indices at the end, because faces may come before their vertices.
  void check_corners() {
    for (std::size_t face = 0, i = 0; face < file_.ends.size(); ++face)
      for (; i < file_.ends[face]; ++i) {
        line_ = lines_[face];
        const MeshFile::Corner& c = file_.corners[i];
        check(c.position, file_.positions.size(), "vertex");
        check(c.uv, file_.uvs.size(), "UV");
        check(c.normal, file_.normals.size(), "normal");
      }
  }

  void check(std::int32_t index, std::size_t size, const char* what) const {
    if (index >= std::int64_t(size))
      error("the face uses {} {}, expected at most {}", what, std::int64_t(index) + 1, size);
  }

  std::string name_, bytes_;
  int line_ = 0;
  std::vector<int> lines_;  // one per face
  std::int32_t material_ = -1;
  MeshFile file_;
};

}  // namespace

MeshFile read_obj(const std::filesystem::path& path) { return ObjReader(path).read(); }

}  // namespace brdfc::reference
