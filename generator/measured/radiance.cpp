// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/radiance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <pugixml.hpp>
#include <sstream>

#include "core/error.h"
#include "core/parse.h"
#include "core/text.h"
#include "measured/binary_file.h"
#include "measured/grid_table.h"
#include "measured/number_text.h"
#include "measured/patches.h"
#include "measured/tensor_tree.h"

namespace brdfc::measured {
namespace {

/// The text of an element, on one line.
std::string text_of(const pugi::xml_node& node, const char* name) {
  std::istringstream in(node.child_value(name));
  std::string out;
  for (std::string word; in >> word;) out += (out.empty() ? "" : " ") + word;
  return out;
}

/// Radiance ignores the case of names.
bool same_name(const std::string& a, const std::string& b) {
  return std::ranges::equal(
      a, b, {}, [](unsigned char c) { return std::tolower(c); }, [](unsigned char c) { return std::tolower(c); });
}

/// A matrix or tree: what it is of, and its element.
struct Block {
  std::string wavelength, direction;
  pugi::xml_node node;
};

struct File {
  std::string name;
  pugi::xml_node layer;
  std::vector<Block> blocks;

  const Block* find(const std::string& wavelength, const std::string& direction) const {
    const Block* out = nullptr;
    for (const Block& block : blocks)
      if (same_name(block.wavelength, wavelength) && same_name(block.direction, direction)) {
        if (out) input_error("{}: WavelengthData {}, {}: expected once, found again", name, wavelength, direction);
        out = &block;
      }
    return out;
  }
  /// The text of a block's numbers.
  NumberText numbers(const Block& block) const {
    const std::string where =
        fmt::format("{}: WavelengthData {}, {}: ScatteringData", name, block.wavelength, block.direction);
    NumberText out(block.node.child_value("ScatteringData"), where);
    if (!out.peek()) input_error("{}: expected numbers, found none", where);
    return out;
  }
};

/// `document` owns what the result refers to.
File open(const std::filesystem::path& path, pugi::xml_document& document) {
  File out;
  out.name = path.string();
  std::ifstream in = open_file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const pugi::xml_parse_result parsed = document.load_buffer(bytes.data(), bytes.size());
  const std::string root = document.document_element().name();
  if (!parsed) {
    const auto end = bytes.begin() + std::clamp<std::ptrdiff_t>(parsed.offset, 0, std::ptrdiff_t(bytes.size()));
    input_error("{} line {}: expected XML of Radiance or WINDOW, found an error: {}{}", out.name,
                1 + std::count(bytes.begin(), end, '\n'), parsed.description(),
                root == "WindowElement" ? ": truncated?" : "");
  }
  if (root != "WindowElement")
    input_error("{}: expected XML of Radiance or WINDOW, with the element WindowElement, found {:.60}", out.name, root);
  out.layer = document.document_element().child("Optical").child("Layer");
  if (!out.layer) input_error("{}: WindowElement: expected Optical with an element Layer, found none", out.name);
  for (const pugi::xml_node& data : out.layer.children("WavelengthData"))
    for (const pugi::xml_node& block : data.children("WavelengthDataBlock"))
      out.blocks.push_back({text_of(data, "Wavelength"), text_of(block, "WavelengthDataDirection"), block});
  return out;
}

/// A whole number, or a finite one, in an element.
template <class T>
T number_of(const File& file, const std::string& where, const pugi::xml_node& node, const char* name) {
  const std::string text = text_of(node, name);
  const auto value = parse<T>(text);
  if (!value || !std::isfinite(double(*value)))
    input_error("{}: {}: {}: expected {}, got '{:.30}'", file.name, where, name,
                std::is_integral_v<T> ? "a whole number" : "a number", text);
  return *value;
}

/// The table of a basis in the file, or a published one for a matrix with so many numbers.
Patches patches_of(const File& file, const std::string& name, std::size_t numbers, std::vector<std::string>& notes) {
  std::vector<std::string> names;
  for (const pugi::xml_node& basis : file.layer.child("DataDefinition").children("AngleBasis")) {
    names.push_back(text_of(basis, "AngleBasisName"));
    if (!same_name(names.back(), name)) continue;
    const std::string where = fmt::format("AngleBasis {}", name);
    std::vector<Patches::Ring> rings;
    for (const pugi::xml_node& block : basis.children("AngleBasisBlock")) {
      const pugi::xml_node bounds = block.child("ThetaBounds");
      const Patches::Ring ring{number_of<double>(file, where, bounds, "LowerTheta"),
                               number_of<double>(file, where, bounds, "UpperTheta"),
                               number_of<std::size_t>(file, where, block, "nPhis")};
      const double from = rings.empty() ? 0 : rings.back().to;
      if (std::abs(ring.from - from) > 1e-6)
        input_error("{}: {}: LowerTheta: expected {:g}, where the block before ends, got {:g}", file.name, where, from,
                    ring.from);
      if (!(ring.to > from && ring.to <= 90))
        input_error("{}: {}: UpperTheta: expected more than {:g} and up to 90 degrees, got {:g}", file.name, where,
                    from, ring.to);
      if (!(ring.number >= 1 && ring.number <= 360))
        input_error("{}: {}: nPhis: expected 1 to 360, got {}", file.name, where, ring.number);
      rings.push_back({from, ring.to, ring.number});
    }
    if (!rings.empty()) return Patches(name, std::move(rings));
  }
  std::vector<const Patches*> published;
  std::vector<std::string> known;
  for (const Patches& patches : Patches::known()) {
    if (known.empty() || known.back() != patches.name()) known.push_back(patches.name());
    if (same_name(patches.name(), name)) published.push_back(&patches);
  }
  if (published.empty())
    input_error("{}: expected an AngleBasis with AngleBasisBlocks for '{:.60}', or one of {}; the file describes {}",
                file.name, name, join(known, ", "), names.empty() ? "none" : join(names, ", "));
  const auto fits = [&](const Patches* patches) { return patches->size() * patches->size() == numbers; };
  const auto number_fitting = std::ranges::count_if(published, fits);
  const Patches& out = number_fitting ? **std::ranges::find_if(published, fits) : *published[0];
  if (number_fitting > 1) {
    std::vector<double> ends;
    for (const Patches::Ring& ring : out.rings()) ends.push_back(ring.to);
    notes.push_back(
        fmt::format("{} is not described: taken for that of Radiance since July 2022, with rings up to {} degrees",
                    out.name(), join(ends, ", ")));
  }
  return out;
}

/// From X, Y and Z to Radiance's red, green and blue (src/common/color.h), whose white has X = Y = Z.
const Eigen::Matrix3d& rgb_of_xyz() {
  static const Eigen::Matrix3d out = [] {
    Eigen::Matrix3d primaries;
    primaries << 0.640, 0.290, 0.150, 0.330, 0.600, 0.060, 0.030, 0.110, 0.790;
    const Eigen::Vector3d luminances = primaries.inverse() * Eigen::Vector3d(1, 1, 1);
    return Eigen::Matrix3d((primaries * luminances.asDiagonal()).inverse());
  }();
  return out;
}

/// The side that was measured, in whose frame the file's x axis points the other way if it is the front.
enum class Side { Front, Back };

/// Directions as the file has them: where the light goes, and where it leaves, along x and y.
struct Directions {
  double x_i, y_i, x_o, y_o;
};
Directions in_file(Side side, const Vec3<double>& wi, const Vec3<double>& wo) {
  const double sign = side == Side::Front ? -1 : 1;
  return {-sign * wi.x, -wi.y, sign * wo.x, wo.y};
}

class MatrixTable final : public Table {
 public:
  MatrixTable(Side side, PatchMatrix matrix) : side_(side), matrix_(std::move(matrix)) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    if (!(wi.z > 0 && wo.z > 0)) return Rgb<double>(0);
    const Directions d = in_file(side_, wi, wo);
    const auto theta = [](const Vec3<double>& w) { return kDegrees * std::atan2(std::sqrt(sin2_theta(w)), w.z); };
    return matrix_.eval(theta(wi), kDegrees * std::atan2(d.y_i, d.x_i), theta(wo), kDegrees * std::atan2(d.y_o, d.x_o));
  }

 private:
  Side side_;
  PatchMatrix matrix_;
};

/// A tree of Y, and those of u' and v', if there are any.
class TreeTable final : public Table {
 public:
  TreeTable(Side side, std::size_t dimensions, std::vector<TensorTree> trees)
      : side_(side), dimensions_(dimensions), trees_(std::move(trees)) {}

  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    if (!(wi.z > 0 && wo.z > 0)) return Rgb<double>(0);
    const std::array<double, 3> value = signed_value(place(in_file(side_, wi, wo)));
    return {std::max(value[0], 0.), std::max(value[1], 0.), std::max(value[2], 0.)};
  }
  /// Red, green and blue, in which colours beyond them have negative numbers.
  std::array<double, 3> signed_value(const TensorTree::Place& at) const {
    const double y = double(trees_[0].at(at));
    if (trees_.size() == 1) return {y, y, y};
    const double u = double(trees_[1].at(at)), v = double(trees_[2].at(at));
    // Where a tree has no colour, because nothing is reflected there, it is grey.
    if (!(v > 0)) return {y, y, y};
    const Eigen::Vector3d rgb =
        rgb_of_xyz() * Eigen::Vector3d(y * 9 * u / (4 * v), y, y * (12 - 3 * u - 20 * v) / (4 * v));
    return {rgb[0], rgb[1], rgb[2]};
  }
  const TensorTree& luminances() const { return trees_[0]; }

 private:
  TensorTree::Place place(const Directions& d) const {
    if (dimensions_ == 4) {
      const auto i = square_of_disk(d.x_i, d.y_i), o = square_of_disk(d.x_o, d.y_o);
      return {i[0], i[1], o[0], o[1]};
    }
    // The outgoing direction is turned by the azimuth of the incident one. Of the first coordinate half is used.
    const double r = std::hypot(d.x_i, d.y_i), cos_phi = r > 0 ? d.x_i / r : 1, sin_phi = r > 0 ? d.y_i / r : 0;
    const auto o = square_of_disk(cos_phi * d.x_o + sin_phi * d.y_o, cos_phi * d.y_o - sin_phi * d.x_o);
    return {std::min((1 - r) / 2, std::nextafter(0.5, 0)), o[0], o[1], 0};
  }

  Side side_;
  std::size_t dimensions_;
  std::vector<TensorTree> trees_;
};

std::string said_of_negative(std::size_t negative, std::size_t all) {
  return fmt::format("{} negative, {} %: taken for 0", counted(negative, "number is", "numbers are"),
                     in_percent(double(negative) / double(all)));
}

void said_of_colours(std::size_t outside, std::size_t all, std::vector<std::string>& notes) {
  if (outside)
    notes.push_back(fmt::format("{} a colour outside Radiance's RGB, {} %: negative channels are taken for 0",
                                counted(outside, "cell has", "cells have"), in_percent(double(outside) / double(all))));
}

/// The numbers of a matrix, as they are.
std::vector<float> numbers_of(const File& file, const Block& block) {
  NumberText text = file.numbers(block);
  std::vector<float> out;
  const auto place = [&] { return fmt::format("number {}", out.size() + 1); };
  while (text.peek()) out.push_back(text.number(place));
  return out;
}

/// The same, incident patch by incident patch.
std::vector<float> matrix_of(const File& file, const Block& block, const Patches& patches, bool columns,
                             std::vector<float> numbers) {
  const std::string where = fmt::format("{}: WavelengthData {}, {}", file.name, block.wavelength, block.direction);
  for (const char* basis : {"ColumnAngleBasis", "RowAngleBasis"})
    if (const std::string name = text_of(block.node, basis); !same_name(name, patches.name()))
      input_error("{}: {}: expected {}, as for the columns of Visible, got '{:.60}'", where, basis, patches.name(),
                  name);
  const std::size_t size = patches.size(), count = size * size;
  if (numbers.size() != count)
    input_error("{}: ScatteringData: expected {} x {} numbers, because {} has {} patches, found {}{}", where, size,
                size, patches.name(), size, numbers.size(), numbers.size() < count ? ": truncated?" : "");
  if (columns) {
    std::vector<float> turned(count);
    for (std::size_t k = 0; k < count; ++k) turned[k % size * size + k / size] = numbers[k];
    return turned;
  }
  return numbers;
}

/// What a matrix or tree is beside its numbers.
struct Chosen {
  Side side;
  const Block* luminance;
  std::array<const Block*, 2> colours;
};

void read_matrix(const File& file, const Chosen& chosen, bool columns, Measurement& out) {
  std::vector<float> luminances = numbers_of(file, *chosen.luminance);
  const Patches patches =
      patches_of(file, text_of(chosen.luminance->node, "ColumnAngleBasis"), luminances.size(), out.notes);
  std::array<std::vector<float>, 3> planes;
  planes[1] = matrix_of(file, *chosen.luminance, patches, columns, std::move(luminances));
  const bool colours = chosen.colours[0] != nullptr;
  if (colours)
    for (const std::size_t k : {0, 1})
      planes[2 * k] = matrix_of(file, *chosen.colours[k], patches, columns, numbers_of(file, *chosen.colours[k]));
  std::size_t negative = 0, outside = 0;
  for (auto& plane : planes)
    for (float& v : plane) negative += v < 0, v = std::max(v, 0.f);
  std::vector<std::array<float, 3>> values(planes[1].size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!colours) {
      values[i].fill(planes[1][i]);
      continue;
    }
    const Eigen::Vector3d rgb =
        rgb_of_xyz() * Eigen::Vector3d(double(planes[0][i]), double(planes[1][i]), double(planes[2][i]));
    // Rounding of the conversion is not a colour.
    outside += rgb.minCoeff() < -1e-4 * rgb.maxCoeff();
    for (std::size_t c = 0; c < 3; ++c) values[i][c] = float(std::max(rgb[Eigen::Index(c)], 0.));
  }
  if (negative) out.notes.push_back(said_of_negative(negative, (colours ? 3 : 1) * values.size()));
  said_of_colours(outside, values.size(), out.notes);
  const Patches::Ring& last = patches.rings().back();
  out.notes.push_back(
      fmt::format("averages over patches up to {:.0f} degrees wide, the last from {:g} to {:g} degrees to the normal: "
                  "what is narrower is not in the data",
                  patches.widest(), last.from, last.to));
  out.grid = fmt::format("{0} x {0} patches of light and view, {1}", patches.size(), patches.name());
  out.isotropic = false;
  out.highest = last.to;
  out.largest = largest(values);
  out.table = std::make_shared<MatrixTable>(chosen.side, PatchMatrix(patches, std::move(values)));
}

void read_tree(const File& file, const Chosen& chosen, std::size_t dimensions, Measurement& out) {
  std::vector<TensorTree> trees;
  std::size_t negative = 0, numbers = 0;
  for (const Block* block : {chosen.luminance, chosen.colours[0], chosen.colours[1]}) {
    if (!block) continue;
    if (const std::string basis = text_of(block->node, "AngleBasis"); !same_name(basis, "LBNL/Shirley-Chiu"))
      input_error("{}: WavelengthData {}, {}: AngleBasis: expected LBNL/Shirley-Chiu, got '{:.60}'", file.name,
                  block->wavelength, block->direction, basis);
    trees.emplace_back(file.numbers(*block), dimensions);
    negative += trees.back().negative(), numbers += trees.back().size();
  }
  if (negative) out.notes.push_back(said_of_negative(negative, numbers));
  auto table = std::make_shared<TreeTable>(chosen.side, dimensions, std::move(trees));
  std::size_t outside = 0;
  table->luminances().for_each([&](const TensorTree::Place& at, float) {
    if (dimensions == 3 && at[0] > 0.5) return;  // no incident direction is there
    TensorTree::Place place = at;
    // A cell of the whole width has a middle where the used half ends.
    if (dimensions == 3 && at[0] == 0.5) place[0] = 0.25;
    const auto rgb = table->signed_value(place);
    const auto [least, most] = std::ranges::minmax(rgb);
    outside += least < -1e-4 * most;
    out.largest = std::max(out.largest, most);
  });
  const TensorTree& tree = table->luminances();
  said_of_colours(outside, tree.size(), out.notes);
  out.grid = fmt::format("a tree of {} cells over {} dimensions, the smallest 1/{} of the disk's width", tree.size(),
                         dimensions, tree.finest());
  out.isotropic = dimensions == 3;
  out.table = std::move(table);
}

/// What of the file is read, and a sentence on it and on the rest.
Chosen choose(const File& file, const std::array<const char*, 2>& colours, std::vector<std::string>& notes) {
  Chosen out{Side::Front, file.find("Visible", "Reflection Front"), {}};
  if (!out.luminance) out.side = Side::Back, out.luminance = file.find("Visible", "Reflection Back");
  if (!out.luminance) {
    std::vector<std::string> found;
    for (const Block& block : file.blocks) found.push_back(block.wavelength + ", " + block.direction);
    input_error("{}: expected WavelengthData Visible, Reflection Front or Reflection Back, found {:.300}", file.name,
                found.empty() ? "none" : join(found, "; "));
  }
  const std::string& direction = out.luminance->direction;
  for (std::size_t k = 0; k < 2; ++k) out.colours[k] = file.find(colours[k], direction);
  if (!out.colours[0] != !out.colours[1]) {
    notes.push_back(fmt::format("{} is there and {} is not: without both the data are grey",
                                colours[out.colours[0] ? 0 : 1], colours[out.colours[0] ? 1 : 0]));
    out.colours = {};
  }
  std::vector<std::string> directions, wavelengths;
  const auto add = [](std::vector<std::string>& to, const std::string& name) {
    if (std::ranges::find(to, name) == to.end()) to.push_back(name);
  };
  for (const Block& block : file.blocks) {
    const bool read =
        same_name(block.wavelength, "Visible") ||
        (out.colours[0] && (same_name(block.wavelength, colours[0]) || same_name(block.wavelength, colours[1])));
    if (!read)
      add(wavelengths, block.wavelength);
    else if (!same_name(block.direction, direction))
      add(directions, block.direction);
  }
  for (std::string& wavelength : wavelengths) directions.push_back("the data for " + wavelength);
  notes.push_back(direction +
                  (directions.empty() ? " is read" : fmt::format(" is read, not {:.300}", join(directions, ", "))));
  return out;
}

}  // namespace

Measurement read_radiance(const std::filesystem::path& path) {
  pugi::xml_document document;
  const File file = open(path, document);
  Measurement out;
  out.file = file.name;
  out.format = "Radiance";
  const pugi::xml_node material = file.layer.child("Material");
  std::vector<std::string> description;
  for (const char* name : {"Name", "Manufacturer"})
    if (std::string text = text_of(material, name); !text.empty()) description.push_back(std::move(text));
  out.description = join(description, ", ");
  const std::string structure = text_of(file.layer.child("DataDefinition"), "IncidentDataStructure");
  const bool columns = same_name(structure, "Columns");
  if (columns || same_name(structure, "Rows"))
    read_matrix(file, choose(file, {"CIE-X", "CIE-Z"}, out.notes), columns, out);
  else if (same_name(structure, "TensorTree3") || same_name(structure, "TensorTree4"))
    read_tree(file, choose(file, {"CIE-u", "CIE-v"}, out.notes), structure.back() == '3' ? 3 : 4, out);
  else
    input_error(
        "{}: DataDefinition: IncidentDataStructure: expected Columns, Rows, TensorTree3 or TensorTree4, got '{:.60}'",
        file.name, structure);
  if (file.layer.next_sibling("Layer")) out.notes.emplace_back("there are several layers: the first one is read");
  return out;
}

}  // namespace brdfc::measured
