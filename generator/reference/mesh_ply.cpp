// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>

#include "core/error.h"
#include "core/parse.h"
#include "reference/mesh_file.h"

namespace brdfc::reference {

namespace {

enum class Type { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float32, Float64 };

std::optional<Type> type_of(const std::string& name) {
  static const std::map<std::string, Type> types{
      {"char", Type::Int8},     {"int8", Type::Int8},       {"uchar", Type::Uint8},    {"uint8", Type::Uint8},
      {"short", Type::Int16},   {"int16", Type::Int16},     {"ushort", Type::Uint16},  {"uint16", Type::Uint16},
      {"int", Type::Int32},     {"int32", Type::Int32},     {"uint", Type::Uint32},    {"uint32", Type::Uint32},
      {"float", Type::Float32}, {"float32", Type::Float32}, {"double", Type::Float64}, {"float64", Type::Float64}};
  const auto found = types.find(name);
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

struct Property {
  std::string name;
  Type type = Type::Float32;
  std::optional<Type> count;  ///< for a list: the type of its length
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

class PlyReader {
 public:
  explicit PlyReader(const std::filesystem::path& path) : name_(path.string()), bytes_(read_bytes(path)) {}

  MeshFile read() {
    read_header();
    for (const Element& e : elements_) {
      if (e.name == "vertex")
        read_vertices(e);
      else if (e.name == "face" || e.name == "tristrips")
        read_faces(e);
      else
        skip(e);
    }
    // Checks the indices at the end, because faces may come before the vertices.
    for (const MeshFile::Corner& c : file_.corners)
      if (c.position < 0 || std::size_t(c.position) >= file_.positions.size())
        input_error("{}: a face uses vertex {}, expected 0 to {}", name_, c.position,
                    std::int64_t(file_.positions.size()) - 1);
    // A vertex has the normal of the same index, and the UVs too where faces have none of their own.
    const auto of_vertices = std::int32_t(file_.uvs.size());
    file_.uvs.insert(file_.uvs.end(), face_uvs_.begin(), face_uvs_.end());
    for (MeshFile::Corner& c : file_.corners) {
      if (!file_.normals.empty()) c.normal = c.position;
      if (c.uv <= -2)
        c.uv = of_vertices - 2 - c.uv;
      else if (of_vertices)
        c.uv = c.position;
    }
    return std::move(file_);
  }

 private:
  void read_header() {
    bool format = false;
    for (int number = 1;; ++number) {
      const std::size_t end = bytes_.find('\n', at_);
      if (end == bytes_.npos) input_error("{}: a PLY file whose header does not end", name_);
      std::istringstream text(bytes_.substr(at_, std::min<std::size_t>(end - at_, 4096)));
      at_ = end + 1;
      const std::vector<std::string> words{std::istream_iterator<std::string>(text), {}};
      const std::string first = words.empty() ? std::string() : words[0];
      bool good = false;
      if (number == 1) {
        good = words.size() == 1 && first == "ply";
      } else if (first == "comment" || first == "obj_info") {
        good = true;
      } else if (first == "format") {
        good = !format && words.size() == 3 && words[2] == "1.0" &&
               (words[1] == "ascii" || words[1] == "binary_little_endian" || words[1] == "binary_big_endian");
        if (good) text_ = words[1] == "ascii", big_endian_ = words[1] == "binary_big_endian";
        format = true;
      } else if (first == "element") {
        const auto count = words.size() == 3 ? parse<std::uint32_t>(words[2]) : std::nullopt;
        good = count.has_value();
        if (good) elements_.push_back({words[1], *count, {}});
      } else if (first == "property") {
        const bool list = words.size() == 5 && words[1] == "list";
        const auto type = list ? type_of(words[3]) : words.size() == 3 ? type_of(words[1]) : std::nullopt;
        const auto count = list ? type_of(words[2]) : std::nullopt;
        good = !elements_.empty() && type && count.has_value() == list;
        if (good) elements_.back().properties.push_back({words.back(), *type, count});
      } else if (first == "end_header") {
        if (format && words.size() == 1) break;
      }
      if (!good) input_error("{}: line {} does not belong in the header of a PLY file", name_, number);
    }
    // An element takes at least one byte per property. An element without properties would never reach the end of the
    // file, whatever its count.
    for (const Element& e : elements_)
      if (e.count > bytes_.size()) input_error("{}: {} of '{}' do not fit into the file", name_, e.count, e.name);
  }

  template <class T> T raw() {
    if (bytes_.size() - at_ < sizeof(T)) ends_early();
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &bytes_[at_], sizeof(T));
    at_ += sizeof(T);
    if (big_endian_) std::ranges::reverse(bytes);
    return std::bit_cast<T>(bytes);
  }

  [[noreturn]] void ends_early() const { input_error("{}: the file ends before its last {}", name_, element_); }

  double value(Type type) {
    if (text_) {
      while (at_ < bytes_.size() && std::isspace(static_cast<unsigned char>(bytes_[at_]))) ++at_;
      if (at_ == bytes_.size()) ends_early();
      std::size_t end = at_;
      while (end < bytes_.size() && !std::isspace(static_cast<unsigned char>(bytes_[end]))) ++end;
      std::string_view word(&bytes_[at_], end - at_);
      at_ = end;
      const std::string_view all = word;
      if (word.starts_with('+')) word.remove_prefix(1);
      // Windows C libraries write values that are not numbers like this: 1.#QNAN, -1.#IND.
      const auto number = word.find('#') != word.npos ? std::nan("") : parse<double>(word);
      if (!number) input_error("{}: expected a number of a {}, got '{:.60}'", name_, element_, all);
      return *number;
    }
    switch (type) {
      case Type::Int8:
        return raw<std::int8_t>();
      case Type::Uint8:
        return raw<std::uint8_t>();
      case Type::Int16:
        return raw<std::int16_t>();
      case Type::Uint16:
        return raw<std::uint16_t>();
      case Type::Int32:
        return raw<std::int32_t>();
      case Type::Uint32:
        return raw<std::uint32_t>();
      case Type::Float32:
        return raw<float>();
      case Type::Float64:
        return raw<double>();
    }
    throw std::logic_error("a type that is none");
  }

  /// The values of a property: one, or those of a list.
  void values(const Property& p, std::vector<double>& out) {
    out.clear();
    double count = 1;
    if (p.count) count = value(*p.count);
    if (!(count >= 0 && count == std::floor(count) && count <= double(bytes_.size() - at_) + 1))
      input_error("{}: a list of {:g} values in a {} does not fit into the file", name_, count, element_);
    for (std::size_t i = 0; i < std::size_t(count); ++i) out.push_back(value(p.type));
  }

  void skip(const Element& e) {
    element_ = e.name;
    std::vector<double> ignored;
    for (std::size_t i = 0; i < e.count && !e.properties.empty(); ++i)
      for (const Property& p : e.properties) values(p, ignored);
    if (e.name == "edge" && e.count) file_.left_out["line"] += e.count;
  }

  static std::optional<std::size_t> find(const Element& e, std::initializer_list<const char*> names) {
    for (const char* name : names)
      for (std::size_t i = 0; i < e.properties.size(); ++i)
        if (e.properties[i].name == name) return i;
    return std::nullopt;
  }

  void read_vertices(const Element& e) {
    element_ = e.name;
    const auto x = find(e, {"x"}), y = find(e, {"y"}), z = find(e, {"z"});
    if (!x || !y || !z) input_error("{}: expected the properties x, y and z of vertices", name_);
    if (!file_.positions.empty()) input_error("{}: expected one list of vertices, found two", name_);
    const auto nx = find(e, {"nx"}), ny = find(e, {"ny"}), nz = find(e, {"nz"});
    // Names that MeshLab, Blender and older tools use.
    const auto u = find(e, {"s", "u", "texture_u", "u0", "tx"}), v = find(e, {"t", "v", "texture_v", "v0", "ty"});
    std::vector<double> one;
    std::vector<float> row(e.properties.size());
    for (std::size_t i = 0; i < e.count; ++i) {
      for (std::size_t k = 0; k < row.size(); ++k) {
        values(e.properties[k], one);
        row[k] = one.empty() ? 0 : float(one[0]);
      }
      file_.positions.push_back({row[*x], row[*y], row[*z]});
      if (nx && ny && nz) file_.normals.push_back({row[*nx], row[*ny], row[*nz]});
      if (u && v) file_.uvs.push_back({row[*u], row[*v]});
    }
  }

  void read_faces(const Element& e) {
    element_ = e.name;
    const auto corners = find(e, {"vertex_indices", "vertex_index"});
    if (e.count && (!corners || !e.properties[*corners].count))
      input_error("{}: expected the property list vertex_indices of each {}", name_, e.name);
    const auto uvs = find(e, {"texcoord"});
    std::vector<double> ignored, of_corners, of_uvs;
    for (std::size_t i = 0; i < e.count; ++i) {
      for (std::size_t k = 0; k < e.properties.size(); ++k)
        values(e.properties[k], k == *corners ? of_corners : uvs && k == *uvs ? of_uvs : ignored);
      if (e.name == "tristrips") {
        add_strips(of_corners);
        continue;
      }
      const bool own = uvs && e.properties[*uvs].count && of_uvs.size() == 2 * of_corners.size();
      for (std::size_t k = 0; k < of_corners.size(); ++k) {
        // Until the end, when the number of vertices is known, indices of -2 and below are UVs of faces.
        file_.corners.push_back({index(of_corners[k]), -1, own ? -2 - std::int32_t(face_uvs_.size()) : -1});
        if (own) face_uvs_.push_back({float(of_uvs[2 * k]), float(of_uvs[2 * k + 1])});
      }
      file_.end_face();
    }
  }

  std::int32_t index(double value) const {
    if (!(value >= 0 && value <= std::numeric_limits<std::int32_t>::max()))
      input_error("{}: a face uses vertex {:g}, expected 0 or more", name_, value);
    return std::int32_t(value);
  }

  /// Adds triangle strips, which -1 separates. Every second triangle of a strip has the opposite orientation.
  void add_strips(const std::vector<double>& list) {
    for (std::size_t begin = 0; begin < list.size();) {
      const std::size_t end =
          std::size_t(std::find(list.begin() + std::ptrdiff_t(begin), list.end(), -1.) - list.begin());
      for (std::size_t i = begin; i + 2 < end; ++i) {
        const bool odd = (i - begin) % 2;
        for (const std::size_t k : {i, i + (odd ? 2 : 1), i + (odd ? 1 : 2)})
          file_.corners.push_back({index(list[k]), -1, -1});
        file_.end_face();
      }
      begin = end + 1;
    }
  }

  std::string name_, bytes_, element_;
  std::size_t at_ = 0;
  bool text_ = false, big_endian_ = false;
  std::vector<Element> elements_;
  std::vector<std::array<float, 2>> face_uvs_;
  MeshFile file_;
};

}  // namespace

MeshFile read_ply(const std::filesystem::path& path) { return PlyReader(path).read(); }

}  // namespace brdfc::reference
