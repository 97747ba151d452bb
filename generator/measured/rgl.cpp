// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/rgl.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "measured/tensor_file.h"
#include "measured/warp.h"
#include "model/sampling.h"
#include "model/spectrum.h"

namespace brdfc::measured {
namespace {

/// The angle to the normal, without the loss of digits of acos() near it.
double elevation(const Vec3<double>& w) { return std::atan2(std::sqrt(sin2_theta(w)), w.z); }
double theta_to_unit(double theta) { return std::sqrt(theta * (2 / kPi)); }
double phi_to_unit(double phi) { return (phi + kPi) / (2 * kPi); }

/// A file's tables. Its wi is the viewer's direction.
struct RglTables {
  std::vector<float> phis, thetas;
  Warp ndf, sigma, vndf;
  std::array<Warp, 3> rgb;
  Warp light;  ///< what all channels of rgb reflect together, never below 0, as a distribution
  bool isotropic = true, jacobian = true;
  int reduction = 1;  ///< how many times the azimuths in the file go into a circle

  /// Mirrors directions at planes through the normal, so that the view has an azimuth that was measured: of negative y,
  /// and of negative x where a quarter was measured. Another call undoes it.
  struct Turn {
    bool x = false, y = false;
    Vec3<double> operator()(const Vec3<double>& w) const { return {x ? -w.x : w.x, y ? -w.y : w.y, w.z}; }
  };
  Turn turn_of(const Vec3<double>& view) const {
    if (reduction < 2) return {};
    const bool y = view.y < 0, x = reduction == 4 ? view.x < 0 : y;
    return {!x, !y};
  }

  /// The view in the file's coordinates, and the slices around it.
  struct View {
    double phi, theta;
    Blend slices;
  };
  View view_of(const Vec3<double>& wi) const {
    const double phi = std::atan2(wi.y, wi.x), theta = elevation(wi);
    return {phi, theta, blend(phis, thetas, phi, theta)};
  }
  /// A half vector in the unit square.
  Point2 square_of(const Vec3<double>& m, const View& view) const {
    const double phi = std::atan2(m.y, m.x) - (isotropic ? view.phi : 0);
    return {theta_to_unit(elevation(m)), wrap(phi_to_unit(phi))};
  }
  Vec3<double> half_vector(const Point2& u, const View& view) const {
    return direction(std::cos(u.x * u.x * (kPi / 2)), 2 * kPi * u.y - kPi + (isotropic ? view.phi : 0));
  }
};

/// Dupuy and Jakob's sampling, section 4.2 of their paper: the distribution of what a view reflects, in the square of
/// uniform numbers, is mapped to visible normals. A small cosine lobe reaches what that omits.
class RglSampler final : public Sampler {
 public:
  explicit RglSampler(std::shared_ptr<const RglTables> tables) : tables_(std::move(tables)) {}

  double pdf(const Vec3<double>& light, const Vec3<double>& view) const override {
    if (!(light.z > 0 && view.z > 0)) return 0;
    const RglTables::Turn turn = tables_->turn_of(view);
    return turned_pdf(turn(light), turn(view));
  }
  Sample<double> sample(const Vec3<double>& view, const Vec3<double>& u) const override {
    const RglTables::Turn turn = tables_->turn_of(view);
    const Vec3<double> wi = turn(view);
    Vec3<double> wo;
    if (u.x < kCosine) {
      wo = sample_cosine(u.y, u.z);
    } else {
      const RglTables::View at = tables_->view_of(wi);
      const Point2 place = tables_->light.sample({u.y, u.z}, at.slices);
      const Vec3<double> m = tables_->half_vector(tables_->vndf.sample(place, at.slices), at);
      wo = m * (2 * dot(m, wi)) - wi;
    }
    if (!(wi.z > 0 && wo.z > 0)) return {{0, 0, 1}, Rgb<double>(0), 0};
    return {turn(wo), Rgb<double>(0), turned_pdf(wo, wi)};
  }

 private:
  static constexpr double kCosine = 0.01;

  double turned_pdf(const Vec3<double>& wo, const Vec3<double>& wi) const {
    const Vec3<double> m = normalize(wi + wo);
    const RglTables::View at = tables_->view_of(wi);
    const Point2 u = tables_->square_of(m, at);
    const double stretch = std::max(2 * kPi * kPi * u.x * std::sqrt(sin2_theta(m)), 1e-6) * 4 * dot(wi, m);
    const double place = tables_->light.eval(tables_->vndf.invert(u, at.slices), at.slices);
    return kCosine * cosine_pdf(wo) + (1 - kCosine) * tables_->vndf.eval(u, at.slices) * place / stretch;
  }

  std::shared_ptr<const RglTables> tables_;
};

class Rgl final : public Table {
 public:
  explicit Rgl(std::shared_ptr<const RglTables> tables) : tables_(std::move(tables)) {}
  std::shared_ptr<const Sampler> sampler() const override { return std::make_shared<RglSampler>(tables_); }

  Rgb<double> eval(const Vec3<double>& light, const Vec3<double>& view) const override {
    if (!(light.z > 0 && view.z > 0)) return Rgb<double>(0);
    const RglTables& t = *tables_;
    const RglTables::Turn turn = t.turn_of(view);
    const Vec3<double> wi = turn(view), wo = turn(light);
    const RglTables::View at = t.view_of(wi);
    const Point2 u_wi{theta_to_unit(at.theta), phi_to_unit(at.phi)}, u_m = t.square_of(normalize(wi + wo), at);
    const Point2 place = t.vndf.invert(u_m, at.slices);
    double scale = 1 / light.z;
    if (t.jacobian) {
      const Blend all{{0}, {1}, 1};
      const double area = t.sigma.eval(u_wi, all);
      if (!(area > 0)) return Rgb<double>(0);  // no facet faces the viewer
      scale *= t.ndf.eval(u_m, all) / (4 * area);
    }
    const auto channel = [&](std::size_t c) { return std::max(t.rgb[c].eval(place, at.slices) * scale, 0.); };
    return {channel(0), channel(1), channel(2)};
  }

 private:
  std::shared_ptr<const RglTables> tables_;
};

/// Throws unless the numbers increase.
void require_increasing(const TensorFile& file, const std::string& field, const std::vector<float>& v) {
  for (std::size_t i = 1; i < v.size(); ++i)
    if (!(v[i] > v[i - 1])) file.fail(field, fmt::format("increasing numbers, got {} after {}", v[i], v[i - 1]));
}

Warp read_warp(TensorFile& file, const std::string& field, std::size_t slices, bool cumulative) {
  const std::vector<std::size_t>& shape = file.shape(field, cumulative ? 4 : 2);
  const std::size_t height = shape[shape.size() - 2], width = shape.back();
  if (width < 2 || height < 2) file.fail(field, "at least 2 x 2 numbers a slice");
  std::vector<float> data = file.numbers(field);
  if (data.size() != slices * width * height)
    file.fail(field,
              fmt::format("{} slices, one for each phi_i and theta_i, got {}", slices, data.size() / (width * height)));
  if (const auto bad = std::find_if(data.begin(), data.end(), [](float v) { return v < 0; }); bad != data.end())
    file.fail(field, fmt::format("no number below 0, got {}", *bad));
  if (cumulative) {
    if (const std::size_t empty = Warp::empty_slice(data, width, height); empty < slices)
      file.fail(field, fmt::format("a number above 0 in each slice, found none in slice {}", empty));
  } else if (std::ranges::none_of(data, [](float v) { return v > 0; })) {
    file.fail(field, "a number above 0, found none");
  }
  return Warp(std::move(data), width, height, cumulative);
}

/// The sum of channels, without what is below 0, and with a little everywhere, so that no slice is empty.
std::vector<float> sum_of(const std::array<std::vector<float>, 3>& planes, std::size_t size) {
  std::vector<float> out(planes[0].size());
  for (std::size_t first = 0; first < out.size(); first += size) {
    double all = 0;
    for (std::size_t i = first; i < first + size; ++i) {
      double sum = 0;
      for (const auto& plane : planes) sum += std::max(double(plane[i]), 0.) / 3;
      out[i] = float(sum);
      all += sum;
    }
    const float least = float(all > 0 ? 1e-4 * all / double(size) : 1);
    for (std::size_t i = first; i < first + size; ++i) out[i] += least;
  }
  return out;
}

/// For each wavelength of a file its share in X, Y and Z: spectra are linear between wavelengths and constant beyond.
std::vector<Xyz> shares(const std::vector<float>& nm) {
  std::vector<Xyz> out(nm.size(), Xyz{});
  for (std::size_t i = 0; i < kWavelengths; ++i) {
    const double at = kWavelengthMin + double(i) * kWavelengthStep;
    const std::size_t second = std::size_t(std::lower_bound(nm.begin(), nm.end(), at) - nm.begin());
    const auto add = [&](std::size_t k, double weight) {
      for (std::size_t c = 0; c < 3; ++c) out[k][c] += weight * xyz_weights()[i][c];
    };
    if (second == 0)
      add(0, 1);
    else if (second == nm.size())
      add(second - 1, 1);
    else {
      const double w = (at - double(nm[second - 1])) / (double(nm[second]) - double(nm[second - 1]));
      add(second - 1, 1 - w), add(second, w);
    }
  }
  return out;
}

}  // namespace

Measurement read_rgl(const std::filesystem::path& path, const ToRgb& to_rgb) {
  TensorFile file(path);
  Measurement out;
  out.file = file.name();
  out.format = "RGL";
  auto table = std::make_shared<RglTables>();
  file.shape("phi_i", 1), file.shape("theta_i", 1);
  table->phis = file.numbers("phi_i");
  table->thetas = file.numbers("theta_i");
  require_increasing(file, "phi_i", table->phis);
  require_increasing(file, "theta_i", table->thetas);
  if (table->thetas.front() < 0 || table->thetas.back() > 1.5708f)
    file.fail("theta_i",
              fmt::format("radians from 0 to pi / 2, got {} to {}", table->thetas.front(), table->thetas.back()));
  if (std::abs(table->phis.front()) > 6.2832f || std::abs(table->phis.back()) > 6.2832f)
    file.fail("phi_i", fmt::format("radians, got {} to {}", table->phis.front(), table->phis.back()));
  const std::size_t slices = table->phis.size() * table->thetas.size();
  if (slices > (std::size_t(1) << 24)) file.fail("phi_i", "at most 2^24 directions, together with theta_i");
  table->ndf = read_warp(file, "ndf", 1, false);
  table->sigma = read_warp(file, "sigma", 1, false);
  table->vndf = read_warp(file, "vndf", slices, true);
  if (file.has("jacobian")) {
    const auto jacobian = file.bytes("jacobian");
    if (jacobian.size() != 1) file.fail("jacobian", fmt::format("one byte, got {}", jacobian.size()));
    table->jacobian = jacobian[0] != 0;
  } else {
    out.notes.emplace_back("jacobian: not in the file, taken for 1");
  }
  if (file.has("description")) {
    const auto text = file.bytes("description");
    for (const std::uint8_t c : text) out.description += c >= ' ' && c < 127 ? char(c) : ' ';
  }
  const bool spectral = file.has("wavelengths");
  const std::string field = spectral ? "spectra" : "rgb";
  const std::vector<std::size_t> shape = file.shape(field, 5);
  std::vector<Xyz> to_xyz;
  if (spectral) {
    file.shape("wavelengths", 1);
    const std::vector<float> nm = file.numbers("wavelengths");
    require_increasing(file, "wavelengths", nm);
    if (nm.front() > 430 || nm.back() < 650)
      file.fail("wavelengths", fmt::format("430 to 650 nm at least, got {} to {}", nm.front(), nm.back()));
    to_xyz = shares(nm);
  }
  const std::size_t channels = spectral ? to_xyz.size() : 3, height = shape[3], width = shape[4];
  if (shape[0] != table->phis.size() || shape[1] != table->thetas.size() || shape[2] != channels || width < 2 ||
      height < 2)
    file.fail(field, fmt::format("{} x {} x {} x n x n numbers, n at least 2, got {}", table->phis.size(),
                                 table->thetas.size(), channels, join(shape, " x ")));
  // The conversion of spectra is linear, as interpolation is, so it may come first.
  std::array<std::vector<float>, 3> planes;
  {
    const std::vector<float> data = file.numbers(field);
    const std::size_t size = width * height;
    std::array<std::array<double, 3>, 3> rgb_of_xyz{};
    if (spectral)
      for (std::size_t c = 0; c < 3; ++c) {
        Xyz unit{};
        unit[c] = 1;
        rgb_of_xyz[c] = to_rgb(unit);
      }
    std::size_t negative = 0;
    for (auto& plane : planes) plane.resize(slices * size);
    for (std::size_t s = 0; s < slices; ++s)
      for (std::size_t i = 0; i < size; ++i) {
        std::array<double, 3> value{};
        if (spectral) {
          Xyz xyz{};
          for (std::size_t k = 0; k < channels; ++k)
            for (std::size_t c = 0; c < 3; ++c) xyz[c] += to_xyz[k][c] * double(data[(s * channels + k) * size + i]);
          for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t k = 0; k < 3; ++k) value[c] += rgb_of_xyz[k][c] * xyz[k];
        } else {
          for (std::size_t c = 0; c < 3; ++c) value[c] = data[(s * channels + c) * size + i];
        }
        for (std::size_t c = 0; c < 3; ++c) {
          negative += value[c] < 0;
          planes[c][s * size + i] = float(value[c]);
          out.largest = std::max(out.largest, value[c]);
        }
      }
    if (negative)
      out.notes.push_back(fmt::format("{} negative in Rec.709, {} %: f is taken for 0 where they make it negative",
                                      counted(negative, "number is", "numbers are"),
                                      in_percent(double(negative) / double(3 * slices * size))));
  }
  table->light = Warp(sum_of(planes, width * height), width, height, true);
  for (std::size_t c = 0; c < 3; ++c) table->rgb[c] = Warp(std::move(planes[c]), width, height, false);
  table->isotropic = table->phis.size() <= 2;
  if (!table->isotropic)
    table->reduction =
        int(std::lround(std::min(2 * kPi / (double(table->phis.back()) - double(table->phis.front())), 100.)));
  if (!table->isotropic) {
    const auto in_degrees = [](double radians) { return radians * 180 / kPi; };
    const double to = table->reduction == 4   ? -kPi / 2
                      : table->reduction >= 2 ? 0
                                              : kPi,
                 first = double(table->phis.front()), last = double(table->phis.back()),
                 step = (last - first) / double(table->phis.size() - 1);
    if (first > -kPi + 1.01 * step || last < to - 1.01 * step)
      out.notes.push_back(
          fmt::format("phi_i: measured from {:.4g} to {:.4g} degrees, and azimuths from -180 to {:.4g} are needed: the "
                      "values at these ends hold beyond",
                      in_degrees(first), in_degrees(last), in_degrees(to)));
  }
  static const std::set<std::string> known{"phi_i",    "theta_i",     "ndf",     "sigma", "vndf",       "luminance",
                                           "jacobian", "description", "spectra", "rgb",   "wavelengths"};
  for (const auto& [name, f] : file.fields())
    if (!known.count(name)) out.notes.push_back(fmt::format("{}: this field is not known and was not read", name));
  out.isotropic = table->isotropic;
  out.highest = double(table->thetas.back()) * 180 / kPi;
  out.grid = fmt::format("{} x {} directions of view, {} x {} of light{}", table->phis.size(), table->thetas.size(),
                         height, width, spectral ? fmt::format(", {} wavelengths", channels) : "");
  out.table = std::make_shared<Rgl>(std::move(table));
  return out;
}

}  // namespace brdfc::measured
