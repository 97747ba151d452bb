// SPDX-License-Identifier: GPL-3.0-or-later
#include <openssl/evp.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/vec.h"
#include "reference/image.h"
#include "reference/json_view.h"
#include "reference/mesh_file.h"

namespace brdfc::reference {

namespace fs = std::filesystem;

namespace {

constexpr int kMaxInt = std::numeric_limits<int>::max();

/// The rows of a 3 x 4 matrix.
using Matrix = std::array<std::array<double, 4>, 3>;

constexpr Matrix kIdentity{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
/// Rotates from glTF's y-up to z-up, as Blender's importer does.
constexpr Matrix kUpright{{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}}};

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 4; ++k) {
      for (int j = 0; j < 3; ++j) out[i][k] += a[i][j] * b[j][k];
      if (k == 3) out[i][k] += a[i][3];
    }
  return out;
}

double determinant(const Matrix& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/// The components of an accessor, and their number per element.
struct Values {
  std::vector<double> data;
  std::size_t width = 1;
  std::size_t count() const { return data.size() / width; }
};

/// Topologies of primitives, with glTF's numbers.
enum Mode { Points, Lines, LineLoop, LineStrip, Triangles, TriangleStrip, TriangleFan };

class GltfReader {
 public:
  explicit GltfReader(const fs::path& path) : path_(path), name_(path.string()) {
    std::string bytes = read_bytes(path);
    if (ending(path) == ".glb")
      json_ = parse_json(json_of_binary(bytes), name_);
    else
      json_ = parse_json(bytes, name_);
  }

  MeshFile read() {
    const JsonView root(json_, name_);
    if (!root.json().is_object()) root.fail("an object");
    const std::string version = root.at("asset").at("version").text();
    if (!version.starts_with("2.")) root.at("asset").at("version").fail("glTF 2.0");
    check_extensions(root);
    std::vector<int> roots;
    if (const auto scenes = root.find("scenes"); scenes && !scenes->elements().empty()) {
      const auto chosen = root.find("scene");
      const JsonView scene = element(*scenes, chosen ? *chosen : *scenes, chosen ? chosen->integer(0, kMaxInt) : 0);
      if (const auto nodes = scene.find("nodes"))
        for (const JsonView& node : nodes->elements()) roots.push_back(node.integer(0, kMaxInt));
    } else if (const auto nodes = root.find("nodes")) {
      // A file without scenes: takes the nodes that are no node's child.
      std::vector<bool> child(nodes->elements().size(), false);
      for (const JsonView& node : nodes->elements())
        if (const auto children = node.find("children"))
          for (const JsonView& c : children->elements())
            if (const int i = c.integer(0, kMaxInt); std::size_t(i) < child.size()) child[std::size_t(i)] = true;
      for (std::size_t i = 0; i < child.size(); ++i)
        if (!child[i]) roots.push_back(int(i));
    }
    if (const auto nodes = root.find("nodes")) {
      nodes_ = nodes->elements();
      seen_.assign(nodes_.size(), false);
    }
    read_nodes(roots);
    file_.flat = true;  // glTF's rule for primitives without normals
    return std::move(file_);
  }

 private:
  JsonView root() const { return JsonView(json_, name_); }

  /// An element of a list at the top level of the file. `where` is the place of the index.
  JsonView element(const JsonView& list, const JsonView& where, int index) const {
    const auto elements = list.elements();
    if (index < 0 || std::size_t(index) >= elements.size())
      where.error(fmt::format("expected one of {} {}, got {}", elements.size(), list.key(), index));
    return elements[std::size_t(index)];
  }
  JsonView element(const char* list, const JsonView& where) const {
    if (!root().has(list)) where.error(fmt::format("the file has no {}", list));
    return element(root().at(list), where, where.integer(0, kMaxInt));
  }

  /// The binary format: a header of 12 bytes, then chunks of length, type and bytes. The first chunk holds the JSON,
  /// the second the first buffer.
  std::string json_of_binary(const std::string& bytes) {
    const auto number = [&](std::size_t at) {
      std::uint32_t value;
      std::memcpy(&value, &bytes[at], sizeof value);
      return value;
    };
    if (bytes.size() < 20 || !bytes.starts_with("glTF")) input_error("{}: not a binary glTF file", name_);
    if (number(4) != 2) input_error("{}: binary glTF of version {}, expected 2", name_, number(4));
    std::string json;
    for (std::size_t at = 12; at + 8 <= bytes.size();) {
      const std::size_t length = number(at);
      const std::string type = bytes.substr(at + 4, 4);
      at += 8;
      if (length > bytes.size() - at)
        input_error("{}: the file ends {} bytes too early", name_, length - (bytes.size() - at));
      if (type == "JSON" && json.empty()) json = bytes.substr(at, length);
      if (type == std::string("BIN\0", 4) && !binary_) binary_ = bytes.substr(at, length);
      at += length;
    }
    return json;
  }

  /// Rejects extensions that change where triangles are and are not supported here.
  void check_extensions(const JsonView& root) const {
    static const std::map<std::string, std::string> known{
        {"KHR_draco_mesh_compression", "compressed by Draco; expected a file without mesh compression"},
        {"EXT_meshopt_compression", "compressed by meshoptimizer; expected a file without mesh compression"},
        {"KHR_meshopt_compression", "compressed by meshoptimizer; expected a file without mesh compression"},
        {"EXT_mesh_gpu_instancing", "made of GPU instances; expected a file whose instances are nodes"}};
    if (const auto used = root.find("extensionsUsed"))
      for (const JsonView& e : used->elements())
        if (const auto found = known.find(e.text()); found != known.end())
          input_error("{}: the meshes are {} ({})", name_, found->second, found->first);
    if (const auto required = root.find("extensionsRequired"))
      for (const JsonView& e : required->elements()) {
        const std::string name = e.text();
        // Materials, textures and lights are not read, so their extensions do not matter.
        if (name == "KHR_mesh_quantization" || name == "KHR_texture_transform" ||
            name.find("_materials_") != name.npos || name.find("_texture_") != name.npos ||
            name.find("_lights_") != name.npos)
          continue;
        input_error("{}: the file requires the extension {}, which is not known here", name_, name);
      }
  }

  const std::string& buffer(const JsonView& where) {
    const int index = where.integer(0, kMaxInt);
    if (const auto found = buffers_.find(index); found != buffers_.end()) return found->second;
    const JsonView j = element("buffers", where);
    std::string bytes;
    if (const auto uri = j.find("uri")) {
      const std::string text = uri->text();
      bytes = text.starts_with("data:") ? decoded(*uri, text) : bytes_beside(*uri, text);
    } else if (index == 0 && binary_) {
      bytes = *binary_;
    } else {
      j.error("expected a \"uri\", or the binary part of a .glb file");
    }
    const auto length = std::size_t(j.at("byteLength").number(0, 1e12));
    if (bytes.size() < length) j.error(fmt::format("expected {} bytes, found {}", length, bytes.size()));
    bytes.resize(length);
    return buffers_[index] = std::move(bytes);
  }

  static std::string decoded(const JsonView& j, const std::string& uri) {
    const std::size_t comma = uri.find(";base64,");
    if (comma == uri.npos) j.error("expected data in base64");
    const std::string_view text = std::string_view(uri).substr(comma + 8);
    if (text.size() > std::size_t(kMaxInt)) j.error("expected less than 2 GiB of data");
    std::string bytes(text.size() / 4 * 3 + 3, '\0');
    const int length = EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                                       reinterpret_cast<const unsigned char*>(text.data()), int(text.size()));
    if (length < 0) j.error("expected data in base64");
    bytes.resize(std::size_t(length));
    return bytes;
  }

  std::string bytes_beside(const JsonView& j, const std::string& uri) const {
    if (uri.find("://") != uri.npos) j.error("expected a file beside this one, not an address");
    std::string name;
    for (std::size_t i = 0; i < uri.size(); ++i) {
      unsigned value = 0;
      if (uri[i] == '%' && i + 2 < uri.size() &&
          std::from_chars(&uri[i + 1], &uri[i + 1] + 2, value, 16).ptr == &uri[i + 1] + 2)
        name += char(value), i += 2;
      else
        name += uri[i];
    }
    const fs::path file = path_.parent_path() / name;
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored)) j.error(fmt::format("{}: no such file", file.string()));
    return read_bytes(file);
  }

  struct Bytes {
    const std::string* data;
    std::size_t begin, size, stride;  ///< stride: 0 if elements are contiguous
  };

  Bytes view(const JsonView& where) {
    const JsonView j = element("bufferViews", where);
    const std::string& data = buffer(j.at("buffer"));
    const auto offset = j.find("byteOffset"), stride = j.find("byteStride");
    const auto begin = std::size_t(offset ? offset->number(0, 1e12) : 0);
    const auto size = std::size_t(j.at("byteLength").number(0, 1e12));
    if (begin + size > data.size())
      j.error(fmt::format("{} bytes from {} on, of a buffer of {}", size, begin, data.size()));
    return {&data, begin, size, std::size_t(stride ? stride->integer(0, 65536) : 0)};
  }

  static std::size_t size_of(const JsonView& type) {
    switch (type.integer(5120, 5126)) {
      case 5120:
      case 5121:
        return 1;
      case 5122:
      case 5123:
        return 2;
      case 5125:
      case 5126:
        return 4;
    }
    type.fail("a component type of 5120 to 5123, 5125 or 5126");
  }

  /// Reads a component. If `normalized`, integers stand for [0, 1] or [-1, 1].
  static double component(const char* at, int type, bool normalized) {
    const auto read = [&]<class T>(T) {
      T value;
      std::memcpy(&value, at, sizeof value);
      if constexpr (std::is_floating_point_v<T>)
        return double(value);
      else
        return normalized ? std::max(double(value) / double(std::numeric_limits<T>::max()), -1.) : double(value);
    };
    switch (type) {
      case 5120:
        return read(std::int8_t());
      case 5121:
        return read(std::uint8_t());
      case 5122:
        return read(std::int16_t());
      case 5123:
        return read(std::uint16_t());
      case 5125:
        return read(std::uint32_t());
      default:
        return read(float());
    }
  }

  /// Fills `out` with `count` elements of `width` components each, which begin at an offset in a buffer view.
  static void fill(const JsonView& where, const Bytes& bytes, std::size_t offset, std::size_t count, std::size_t width,
                   const JsonView& type, bool normalized, std::vector<double>& out) {
    const std::size_t size = size_of(type), stride = bytes.stride ? bytes.stride : size * width;
    const int kind = type.integer(5120, 5126);
    if (count && (offset > bytes.size || (bytes.size - offset) / stride + 1 < count ||
                  offset + (count - 1) * stride + size * width > bytes.size))
      where.error(fmt::format("{} elements do not fit into the {} bytes of its view", count, bytes.size));
    out.reserve(out.size() + count * width);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < width; ++k)
        out.push_back(component(&(*bytes.data)[bytes.begin + offset + i * stride + k * size], kind, normalized));
  }

  Values accessor(const JsonView& where, const std::string& expected) {
    const JsonView j = element("accessors", where);
    if (const std::string type = j.at("type").text(); type != expected) j.at("type").fail(expected);
    Values out;
    out.width = expected == "SCALAR" ? 1 : expected == "VEC2" ? 2 : 3;
    const auto count = std::size_t(j.at("count").integer(0, kMaxInt));
    const auto flag = j.find("normalized");
    const bool normalized = flag && flag->boolean();
    const auto offset_of = [](const JsonView& of) {
      const auto offset = of.find("byteOffset");
      return std::size_t(offset ? offset->number(0, 1e12) : 0);
    };
    if (const auto v = j.find("bufferView"))
      fill(j, view(*v), offset_of(j), count, out.width, j.at("componentType"), normalized, out.data);
    else if (const auto sparse = j.find("sparse"); !sparse || count > 10000000)
      j.error("expected a \"bufferView\"");
    else
      out.data.resize(count * out.width, 0);
    if (const auto sparse = j.find("sparse")) {
      const auto some = std::size_t(sparse->at("count").integer(0, kMaxInt));
      const JsonView indices = sparse->at("indices"), values = sparse->at("values");
      std::vector<double> places, replaced;
      fill(indices, view(indices.at("bufferView")), offset_of(indices), some, 1, indices.at("componentType"), false,
           places);
      fill(values, view(values.at("bufferView")), offset_of(values), some, out.width, j.at("componentType"), normalized,
           replaced);
      for (std::size_t i = 0; i < some; ++i) {
        if (!(places[i] >= 0 && places[i] < double(count)))
          indices.error(fmt::format("index {:g} of {} elements", places[i], count));
        std::copy_n(&replaced[i * out.width], out.width, &out.data[std::size_t(places[i]) * out.width]);
      }
    }
    return out;
  }

  static Matrix transform_of(const JsonView& node) {
    constexpr double kLargest = 1e12;
    if (const auto m = node.find("matrix")) {
      const auto columns = m->numbers<16>(-kLargest, kLargest);
      Matrix out;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 4; ++k) out[i][k] = columns[4 * k + i];
      return out;
    }
    std::array<double, 3> t{0, 0, 0}, s{1, 1, 1};
    std::array<double, 4> q{0, 0, 0, 1};
    if (const auto v = node.find("translation")) t = v->numbers<3>(-kLargest, kLargest);
    if (const auto v = node.find("scale")) s = v->numbers<3>(-kLargest, kLargest);
    if (const auto v = node.find("rotation")) q = v->numbers<4>(-kLargest, kLargest);
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 0)) node.at("rotation").fail("a quaternion that is not 0");
    for (double& x : q) x /= length;
    const auto [x, y, z, w] = q;
    const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    Matrix out;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) out[i][k] = r[i][k] * s[k];
      out[i][3] = t[i];
    }
    return out;
  }

  void read_nodes(const std::vector<int>& roots) {
    struct Entry {
      int node;
      Matrix above;
    };
    std::vector<Entry> waiting;
    for (auto i = roots.rbegin(); i != roots.rend(); ++i) waiting.push_back({*i, kUpright});
    while (!waiting.empty()) {
      const Entry entry = waiting.back();
      waiting.pop_back();
      if (std::size_t(entry.node) >= nodes_.size())
        input_error("{}: node {} is used, and there are {}", name_, entry.node, nodes_.size());
      if (seen_[std::size_t(entry.node)]) input_error("{}: node {} is used twice in the tree", name_, entry.node);
      seen_[std::size_t(entry.node)] = true;
      const JsonView& node = nodes_[std::size_t(entry.node)];
      const Matrix matrix = product(entry.above, transform_of(node));
      if (const auto mesh = node.find("mesh")) {
        if (node.has("skin")) ++file_.left_out["skin, whose mesh keeps its rest pose"];
        // A mesh with a skin is placed by its bones, not by the node.
        read_mesh(element("meshes", *mesh), node.has("skin") ? kUpright : matrix);
      }
      if (const auto children = node.find("children")) {
        const auto list = children->elements();
        for (auto c = list.rbegin(); c != list.rend(); ++c) waiting.push_back({c->integer(0, kMaxInt), matrix});
      }
    }
  }

  void read_mesh(const JsonView& mesh, const Matrix& matrix) {
    if (mesh.has("weights")) ++file_.left_out["set of shape keys"];
    for (const JsonView& primitive : mesh.at("primitives").elements()) read_primitive(primitive, matrix);
  }

  std::int32_t material_of(const JsonView& primitive) {
    const auto index = primitive.find("material");
    if (!index) return -1;
    const JsonView material = element("materials", *index);
    const auto name = material.find("name");
    const bool named = name && name->json().is_string() && !name->json().get<std::string>().empty();
    return file_.material(named ? name->text() : fmt::format("material {}", index->integer(0, kMaxInt)));
  }

  void read_primitive(const JsonView& primitive, const Matrix& matrix) {
    const JsonView attributes = primitive.at("attributes");
    const auto mode_key = primitive.find("mode");
    const int mode = mode_key ? mode_key->integer(Points, TriangleFan) : Triangles;
    if (mode < Triangles) {
      ++file_.left_out[mode == Points ? "set of points" : "set of lines"];
      return;
    }
    if (!attributes.has("POSITION")) attributes.error("expected the attribute POSITION");
    const Values positions = accessor(attributes.at("POSITION"), "VEC3");
    const std::size_t n = positions.count();
    const auto optional = [&](const char* key, const char* type) {
      const auto found = attributes.find(key);
      std::optional<Values> values;
      if (!found) return values;
      values = accessor(*found, type);
      if (values->count() != n) found->error(fmt::format("expected {} elements, as POSITION has", n));
      return values;
    };
    const std::optional<Values> normals = optional("NORMAL", "VEC3"), uvs = optional("TEXCOORD_0", "VEC2");
    const auto first = std::int32_t(file_.positions.size()), first_normal = std::int32_t(file_.normals.size()),
               first_uv = std::int32_t(file_.uvs.size());
    if (file_.positions.size() + n > std::size_t(std::numeric_limits<std::int32_t>::max()))
      input_error("{}: more than 2147483647 vertices", name_);
    // Normals are transformed by the inverse transpose; the cofactors are a multiple of it.
    const bool mirrored = determinant(matrix) < 0;
    const auto column = [&](std::size_t k) { return Vec3<double>{matrix[0][k], matrix[1][k], matrix[2][k]}; };
    const Vec3<double> cofactors[3] = {cross(column(1), column(2)), cross(column(2), column(0)),
                                       cross(column(0), column(1))};
    for (std::size_t i = 0; i < n; ++i) {
      const double* p = &positions.data[3 * i];
      std::array<float, 3> out;
      for (std::size_t r = 0; r < 3; ++r)
        out[r] = float(matrix[r][0] * p[0] + matrix[r][1] * p[1] + matrix[r][2] * p[2] + matrix[r][3]);
      file_.positions.push_back(out);
      if (normals) {
        const double* v = &normals->data[3 * i];
        Vec3<double> turned = cofactors[0] * v[0] + cofactors[1] * v[1] + cofactors[2] * v[2];
        const double size = length(turned) * (mirrored ? -1 : 1);
        if (size != 0) turned = turned * (1 / size);
        file_.normals.push_back({float(turned.x), float(turned.y), float(turned.z)});
      }
      if (uvs) file_.uvs.push_back({float(uvs->data[2 * i]), float(1 - uvs->data[2 * i + 1])});
    }
    Values indices;
    if (const auto v = primitive.find("indices")) {
      indices = accessor(*v, "SCALAR");
      for (const double index : indices.data)
        if (!(index >= 0 && index < double(n)))
          v->error(fmt::format("index {:g}, expected less than {}, the number of vertices", index, n));
    } else {
      for (std::size_t i = 0; i < n; ++i) indices.data.push_back(double(i));
    }
    const std::int32_t material = material_of(primitive);
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      if (mirrored) std::swap(b, c);
      for (const std::size_t k : {a, b, c}) {
        const auto i = std::int32_t(indices.data[k]);
        file_.corners.push_back({first + i, normals ? first_normal + i : -1, uvs ? first_uv + i : -1});
      }
      file_.end_face(material);
    };
    const std::size_t count = indices.data.size();
    for (std::size_t i = 0; i + 2 < count; i += mode == Triangles ? 3 : 1) {
      if (mode == TriangleFan)
        add(0, i + 1, i + 2);
      else if (mode == TriangleStrip && i % 2)
        add(i, i + 2, i + 1);
      else
        add(i, i + 1, i + 2);
    }
  }

  fs::path path_;
  std::string name_;
  nlohmann::json json_;
  std::optional<std::string> binary_;
  std::map<int, std::string> buffers_;
  std::vector<JsonView> nodes_;
  std::vector<bool> seen_;
  MeshFile file_;
};

}  // namespace

MeshFile read_gltf(const fs::path& path) { return GltfReader(path).read(); }

}  // namespace brdfc::reference
