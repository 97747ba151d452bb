// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/alta.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "core/csv.h"
#include "core/error.h"
#include "core/parse.h"
#include "core/text.h"
#include "measured/angle_rows.h"
#include "measured/binary_file.h"
#include "measured/gaps.h"
#include "measured/merl.h"

namespace brdfc::measured {
namespace {

/// A view closer to the horizon, by its cosine, has no value that a weight by this cosine leaves.
constexpr double kLowest = 1e-6;

enum class Input {
  Cartesian,
  SphericalLightView,
  ViewLightAzimuth,
  ProjectedView,
  HalfDifference,
  HalfDifferenceIsotropic,
  Half,
  HalfCosines,
  HalfCosine,
};
struct InputKind {
  const char* name;
  Input input;
  std::size_t numbers;
};
constexpr InputKind kInputs[] = {
    {"CARTESIAN", Input::Cartesian, 6},
    {"SPHERICAL_TL_PL_TV_PV", Input::SphericalLightView, 4},
    {"ISOTROPIC_TV_TL_DPHI", Input::ViewLightAzimuth, 3},
    {"ISOTROPIC_TL_TV_PROJ_DPHI", Input::ProjectedView, 3},
    {"RUSIN_TH_PH_TD_PD", Input::HalfDifference, 4},
    {"RUSIN_TH_TD_PD", Input::HalfDifferenceIsotropic, 3},
    {"RUSIN_TH_TD", Input::Half, 2},
    {"COS_TH_TD", Input::HalfCosines, 2},
    {"COS_TH", Input::HalfCosine, 1},
};

struct OutputKind {
  const char* name;
  bool weighted;  ///< by the cosine of the view
};
constexpr OutputKind kOutputs[] = {
    {"INV_STERADIAN", false}, {"INV_STERADIAN_COSINE_FACTOR", true}, {"RGB_COLOR", false}};

template <class Kind, std::size_t N> std::string names(const Kind (&kinds)[N]) {
  std::vector<const char*> out;
  for (const Kind& kind : kinds) out.push_back(kind.name);
  return join(out, ", ");
}

struct Header {
  std::map<std::string, std::string> values;
  int lines = 0;
};

Header read_header(std::istream& in, const std::string& file) {
  Header out;
  std::string line;
  while (in.peek() == '#' && std::getline(in, line)) {
    ++out.lines;
    std::istringstream words(line.substr(1));
    std::string key, value;
    // "# text" is a comment.
    if (line.size() < 2 || std::isspace(static_cast<unsigned char>(line[1])) || !(words >> key)) continue;
    std::getline(words, value);
    if ((key == "ALTA" && value.find("END") != std::string::npos) || key == "ALTA_END_HEADER") break;
    if (!out.values.emplace(key, trim(value)).second && (key == "DIM" || key.starts_with("PARAM_")))
      input_error("{} line {}: #{}: expected once, found again", file, out.lines, key);
  }
  return out;
}

const std::string& required(const Header& header, const std::string& file, const char* key, const char* what) {
  const auto found = header.values.find(key);
  if (found == header.values.end() || found->second.empty())
    input_error("{}: expected a line #{} with {} at the beginning of the file, found none", file, key, what);
  return found->second;
}

template <class Kind, std::size_t N>
const Kind& kind_of(const Header& header, const std::string& file, const char* key, const Kind (&kinds)[N]) {
  const std::string& name = required(header, file, key, "the kind of the numbers");
  const auto found = std::ranges::find_if(kinds, [&](const Kind& kind) { return name == kind.name; });
  if (found == std::end(kinds)) input_error("{}: #{}: expected one of {}, got '{:.60}'", file, key, names(kinds), name);
  return *found;
}

/// The numbers of a row, which spaces separate.
std::vector<double> numbers_of(const std::string& line, const std::string& where) {
  std::vector<double> out;
  std::istringstream words(line);
  for (std::string word; words >> word;) {
    const auto value = parse(word);
    if (!value || !std::isfinite(*value)) input_error("{}: expected finite numbers, got '{:.60}'", where, word);
    out.push_back(*value);
  }
  return out;
}

bool by_half_vector(Input input) { return input >= Input::HalfDifference; }

/// Reads one row's coordinates.
class Coordinates {
 public:
  Coordinates(const std::string& where, const std::vector<double>& x) : where_(where), x_(x) {}

  double theta(std::size_t k) const { return checked(degrees_of_radians(x_[k]), 0, 90, "an angle from 0 to pi/2", k); }
  double phi(std::size_t k) const {
    return checked(degrees_of_radians(x_[k]), -1e6, 1e6, "an angle in radians up to 1e4", k);
  }
  double from_cosine(std::size_t k) const {
    // Rounding may have made a cosine of 1 larger.
    return kDegrees * std::acos(std::min(checked(x_[k], 0, 1 + 1e-9, "a cosine from 0 to 1", k), 1.));
  }
  Vec3<double> vector(std::size_t k) const {
    const Vec3<double> v{x_[k], x_[k + 1], x_[k + 2]};
    const double len = length(v);
    if (!(std::abs(len - 1) <= 1e-6 && v.z > 0))
      input_error("{}: numbers {} to {}: expected a unit vector above the surface, its length is {} and its z {}",
                  where_, k + 1, k + 3, len, v.z);
    return v / len;
  }
  /// (x, y) are theta cos phi and theta sin phi.
  std::array<double, 2> projected(std::size_t k) const {
    const double degrees = degrees_of_radians(std::hypot(x_[k], x_[k + 1]));
    if (degrees > 90) input_error("{}: numbers {} and {}: expected a length up to pi/2", where_, k + 1, k + 2);
    return {degrees, kDegrees * std::atan2(x_[k + 1], x_[k])};
  }

 private:
  double checked(double value, double least, double most, const char* what, std::size_t k) const {
    if (!(value >= least && value <= most))
      input_error("{}: number {}: expected {}, got {}", where_, k + 1, what, x_[k]);
    return value;
  }
  const std::string& where_;
  const std::vector<double>& x_;
};

/// theta and phi of two directions in degrees: of light and view, or of the half vector and of the view about it.
std::array<double, 4> angles_in_degrees(Input input, const Coordinates& x) {
  switch (input) {
    case Input::SphericalLightView:
      return {x.theta(0), x.phi(1), x.theta(2), x.phi(3)};
    // The file's azimuth is the light's, from that of the view.
    case Input::ViewLightAzimuth:
      return {x.theta(1), 0, x.theta(0), -x.phi(2)};
    case Input::ProjectedView: {
      const auto [theta, phi] = x.projected(1);
      return {x.theta(0), 0, theta, phi};
    }
    case Input::HalfDifference:
      return {x.theta(0), x.phi(1), x.theta(2), x.phi(3)};
    case Input::HalfDifferenceIsotropic:
      return {x.theta(0), 0, x.theta(1), x.phi(2)};
    // One value holds for all phi_d. With 90 degrees both directions are above the surface.
    case Input::Half:
      return {x.theta(0), 0, x.theta(1), 90};
    case Input::HalfCosines:
      return {x.from_cosine(0), 0, x.from_cosine(1), 90};
    case Input::HalfCosine:
      return {x.from_cosine(0), 0, 0, 90};
    case Input::Cartesian:
      break;
  }
  return {};
}

Angles steps_of(const std::array<double, 4>& a) {
  const auto first = angles_of(a[0], a[1]), second = angles_of(a[2], a[3]);
  return {first[0], first[1], second[0], second[1]};
}

/// View and light of angles of the half vector and of the view about it.
std::array<Vec3<double>, 2> view_and_light(const std::array<double, 4>& a) {
  return directions({a[0] / kDegrees, a[2] / kDegrees, a[3] / kDegrees});
}
bool below_horizon(const std::array<double, 4>& a) {
  const auto [view, light] = view_and_light(a);
  return !(view.z > 1e-9 && light.z > 1e-9);
}

/// Fills what was not measured above the horizon. `phi_d` is in degrees, as in the file.
void fill(HalfGridTable& table, const std::vector<double>& phi_d) {
  std::vector<bool> above;
  for (const double h : table.theta_h.at)
    for (const double p : table.phi_h.at)
      for (const double d : table.theta_d.at)
        for (const double q : phi_d) above.push_back(!below_horizon({h, p, d, q}));
  const std::array<const AngleAxis*, 4> axes{&table.theta_h, &table.phi_h, &table.theta_d, &table.phi_d};
  fill_gaps(table.values, axes, std::array<std::size_t, 4>{2, 3, 0, 1}, above);
}

/// The half circle or quarter in which all azimuths lie, in steps.
HalfGridTable::Azimuths azimuths_of(const std::set<long>& phi_d) {
  using Azimuths = HalfGridTable::Azimuths;
  if (*phi_d.rbegin() > steps(180)) return Azimuths::Circle;
  return *phi_d.rbegin() > steps(90) ? Azimuths::Half : Azimuths::Quarter;
}

void read_half_grid(AngleRows& rows, Measurement& out) {
  const auto axis = [&](std::size_t k) {
    AngleAxis made;
    for (const long v : rows.axis(k)) made.at.push_back(degrees(v));
    return made;
  };
  auto table = std::make_shared<HalfGridTable>();
  table->theta_h = axis(0), table->phi_h = axis(1), table->theta_d = axis(2), table->phi_d = axis(3);
  table->values = rows.values(below_horizon);
  if (const auto said = rows.contradiction()) out.notes.push_back(*said);
  for (const auto& [of, title] : {std::pair(&table->theta_h, "theta_h"), std::pair(&table->theta_d, "theta_d")})
    if (of->at.size() == 1)
      out.notes.push_back(fmt::format("{} has one value: the data are taken for the same at all", title));
    else if (of->at.front() > 1 || of->at.back() < 85)
      out.notes.push_back(fmt::format("{}: measured from {:g} to {:g} degrees: the values at these ends hold beyond",
                                      title, of->at.front(), of->at.back()));
  table->phi_h.ends = AngleAxis::Ends::Circle;
  const std::array sizes{table->theta_h.at.size(), table->phi_h.at.size(), table->theta_d.at.size(),
                         table->phi_d.at.size()};
  const bool phi_d_matters = vary(table->values, sizes, 3);
  if (table->phi_h.at.size() > 1) add_gaps("phi_h", table->phi_h.at, 360, vary(table->values, sizes, 1), out.notes);
  using Azimuths = HalfGridTable::Azimuths;
  AngleAxis& phi_d = table->phi_d;
  const std::vector<double> given_phi_d = phi_d.at;
  table->azimuths = azimuths_of(rows.axis(3));
  if (phi_d.at.size() == 1) {
    out.notes.emplace_back("phi_d has one value: the data are taken for the same at all");
  } else if (table->azimuths == Azimuths::Quarter) {
    out.notes.emplace_back("phi_d lies within a quarter of a circle: the rest is taken for its mirror image");
  } else {
    if (table->azimuths == Azimuths::Half) {
      out.notes.emplace_back("phi_d lies within half a circle: light and view are taken for exchangeable");
    }
    const double turn = table->azimuths == Azimuths::Half ? 180 : 360;
    // With 0 and 180 degrees both ends are there; otherwise the last value is followed by the first.
    const bool whole = phi_d.at.back() - phi_d.at.front() == turn;
    add_gaps("phi_d", phi_d.at, whole ? 0 : turn, phi_d_matters, out.notes);
    phi_d.ends = whole ? AngleAxis::Ends::Constant : AngleAxis::Ends::Circle;
    for (double& v : phi_d.at) v *= 360 / turn;
  }
  fill(*table, given_phi_d);
  out.grid = fmt::format("{} x {} half vectors, {} x {} difference vectors", table->theta_h.at.size(),
                         table->phi_h.at.size(), table->theta_d.at.size(), phi_d.at.size());
  out.isotropic = table->phi_h.at.size() == 1;
  out.largest = largest(table->values);
  out.table = std::move(table);
}

}  // namespace

Measurement read_alta(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::ifstream in = open_file(path, std::ios::binary);
  const Header header = read_header(in, name);
  const std::string& dimensions = required(header, name, "DIM", "the numbers of coordinates and values of a row");
  const InputKind& kind = kind_of(header, name, "PARAM_IN", kInputs);
  const OutputKind& output = kind_of(header, name, "PARAM_OUT", kOutputs);
  if (const auto format = header.values.find("FORMAT"); format != header.values.end() && format->second != "text")
    input_error("{}: #FORMAT: expected text, got '{:.60}'", name, format->second);
  const std::vector<double> sizes = numbers_of(dimensions, fmt::format("{}: #DIM", name));
  const bool color = std::string(output.name) == "RGB_COLOR";
  if (sizes.size() != 2 || sizes[0] != double(kind.numbers) || !(sizes[1] == 3 || (sizes[1] == 1 && !color)))
    input_error("{}: #DIM: expected {} {} for {} and {}, got '{:.60}'", name, kind.numbers, color ? "3" : "1 or 3",
                kind.name, output.name, dimensions);
  const std::size_t channels = std::size_t(sizes[1]), numbers = kind.numbers + channels;
  const auto segments = header.values.find("VS");
  const bool intervals = segments != header.values.end() && segments->second.find_first_of("12") != std::string::npos;

  const bool half = by_half_vector(kind.input), vectors = kind.input == Input::Cartesian;
  AngleRows rows(name,
                 half ? AngleRows::Names{"theta_h", "phi_h", "theta_d", "phi_d"}
                      : AngleRows::Names{"theta_i", "phi_i", "theta_o", "phi_o"},
                 half ? std::set<std::size_t>{2} : std::set<std::size_t>{0, 2});
  std::size_t negative = 0, holes = 0, lowest = 0;
  std::vector<AngleRow> given;
  std::string line;
  for (int at = header.lines + 1; std::getline(in, line); ++at) {
    if (trim(line).empty() || line[0] == '#') continue;
    const std::string where = fmt::format("{} line {}", name, at);
    const std::vector<double> row = numbers_of(line, where);
    if (row.size() < numbers || (row.size() > numbers && !intervals))
      input_error("{}: expected {} numbers, {} coordinates and {} values, got {}", where, numbers, kind.numbers,
                  channels, row.size());
    const Coordinates x(where, row);
    std::array<double, 4> a{};
    Angles angles;
    double cosTheta_o;
    bool below = false;
    if (vectors) {
      const Vec3<double> view = x.vector(0), light = x.vector(3);
      const auto i = angles_of(light), o = angles_of(view);
      angles = {i[0], i[1], o[0], o[1]};
      cosTheta_o = view.z;
    } else {
      a = angles_in_degrees(kind.input, x);
      angles = steps_of(a);
      cosTheta_o = half ? view_and_light(a)[0].z : std::cos(a[2] / kDegrees);
      below = half && below_horizon(a);
    }
    if (output.weighted && !half && cosTheta_o < kLowest) {
      ++lowest;
      continue;
    }
    const double scale = output.weighted && !below ? 1 / cosTheta_o : 1;
    std::array<float, 3> value;
    int below_0 = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double v = row[kind.numbers + (channels == 3 ? c : 0)] * scale;
      if (!std::isfinite(float(v))) input_error("{}: expected values up to 1e38, got {}", where, v);
      below_0 += v < 0;
      value[c] = float(std::max(v, 0.));
    }
    // As in MERL's files, a place where all channels are negative was not measured.
    if (half && (below_0 == 3 || (below && value == std::array<float, 3>{}))) {
      holes += !below;
      value.fill(NAN);
    } else {
      negative += std::size_t(channels == 3 ? below_0 : below_0 / 3);
    }
    given.push_back({angles, value, at, false, vectors});
  }
  // A half circle is one whichever way round azimuths are counted.
  const bool mirrored = !half && kind.numbers == 3 && std::ranges::none_of(given, [](const AngleRow& row) {
    return row.angles[3] > 0 && row.angles[3] < steps(180);
  });
  for (AngleRow& row : given) {
    if (mirrored && row.angles[3] > 0) row.angles[3] = steps(360) - row.angles[3];
    rows.add(row);
  }
  if (vectors || kind.input == Input::ProjectedView) rows.remove_rounding();
  rows.collect();
  Measurement out;
  out.file = name;
  out.format = "ALTA";
  out.pairs = rows.given().size();
  if (const auto sample = header.values.find("SAMPLE"); sample != header.values.end())
    for (const char c : sample->second) out.description += c >= ' ' && c < 127 ? c : ' ';
  if (channels == 1) out.notes.emplace_back("one number a row: the data are grey");
  if (intervals) out.notes.emplace_back("confidence intervals are not read");
  if (output.weighted)
    out.notes.emplace_back("values are divided by the cosine of the view, with which they are weighted");
  if (lowest)
    out.notes.push_back(fmt::format("{} of a view at the horizon left out", counted(lowest, "row is", "rows are")));
  if (holes)
    out.notes.push_back(fmt::format("{} above the horizon negative: not measured, {}",
                                    counted(holes, "place is", "places are"), kFilled));
  if (negative)
    out.notes.push_back(fmt::format("{} negative: taken for 0", counted(negative, "number is", "numbers are")));
  if (half)
    read_half_grid(rows, out);
  else
    read_grid_of_directions(rows, out);
  return out;
}

}  // namespace brdfc::measured
