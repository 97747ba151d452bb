// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/stability_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/json_text.h"
#include "core/parallel.h"
#include "core/write_beside.h"
#include "measure/probes.h"
#include "model/model.h"
#include "pictures/pictures.h"

namespace brdfc::report {
namespace {

constexpr int kWidth = 240, kHeight = 160, kScale = 2;

/// Relative error at (x, y) in [0, 1]^2, with y upwards. NaN means that the formula fails, a negative value that there
/// is no light.
using Map = std::function<double(double x, double y)>;

std::array<double, 3> color_of(double error) {
  if (!std::isfinite(error)) return {0.85, 0.1, 0.1};
  if (error < 0) return {0.75, 0.75, 0.75};
  const double t = std::clamp((std::log10(std::max(error, 1e-17)) + 16) / 16, 0., 1.);
  // From dark blue through green to yellow: bright colours are large errors.
  return {std::clamp(1.6 * t - 0.45, 0.05, 1.), std::clamp(0.1 + 0.9 * t, 0., 0.95),
          std::clamp(0.45 - 0.35 * t, 0.1, 1.)};
}

std::array<int, 3> bytes(const std::array<double, 3>& color) {
  std::array<int, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) out[i] = int(255 * color[i] + 0.5);
  return out;
}

void write_map(const std::string& path, const Map& map) {
  std::vector<unsigned char> pixels(std::size_t(3 * kWidth * kHeight * kScale * kScale));
  for_all(kHeight, [&](std::size_t index) {
    const int row = int(index);
    for (int column = 0; column < kWidth; ++column) {
      const auto c = bytes(color_of(map((column + 0.5) / kWidth, 1 - (row + 0.5) / kHeight)));
      for (int i = 0; i < kScale * kScale; ++i) {
        const int x = column * kScale + i % kScale, y = row * kScale + i / kScale;
        for (std::size_t k = 0; k < 3; ++k)
          pixels[std::size_t(3 * (y * kWidth * kScale + x)) + k] = static_cast<unsigned char>(c[k]);
      }
    }
  });
  pictures::Header header{kWidth * kScale, kHeight * kScale};
  header.channels = {"R", "G", "B"};
  header.floating = false;
  if (pictures::write(path, header, pixels))
    throw InputError(fmt::format("{}: expected a place that can be written", path));
}

/// The unit vector that a rounded direction stands for.
Vec3<Wide> exact(const Vec3<double>& w) { return normalize(Vec3<Wide>::from(w)); }

double relative_error(double got, const Wide& truth) {
  if (!(truth > Wide(1e-290))) return -1;
  if (!std::isfinite(got)) return std::numeric_limits<double>::quiet_NaN();
  return double(Wide(abs(Wide((Wide(got) - truth) / truth))));
}

// ---- the formulas as printed in the papers; they exist only here, for comparison ---------------------------------

/// Radziszewski and Alda, eq. 17, with the factor 2 that is missing there.
double printed_f_theta(double n, double x, double y) {
  const double m = 2 * std::log(std::cosh(n)), t2 = std::pow(std::tanh(n), 2);
  const double d = t2 - (1 - std::exp(-m * x)) * (1 - std::exp(-m * y));
  return 2 * m * t2 * std::exp(-m * (x + y)) / (d * d);
}

/// Ashikhmin and Shirley, eq. 16 with eq. 11, for R_s = 1.
double printed_specular(double nu, double nv, const Vec3<double>& wi, const Vec3<double>& wo) {
  const Vec3<double> h = normalize(wi + wo);
  const double hn = h.z, exponent = (nu * h.x * h.x + nv * h.y * h.y) / (1 - hn * hn);
  return std::sqrt((nu + 1) * (nv + 1)) / (8 * kPi) * std::pow(hn, exponent) / (dot(h, wi) * std::max(wi.z, wo.z));
}

/// Phong's highlight: a power of the cosine.
double printed_highlight(double e, const Vec3<double>& wi, const Vec3<double>& wo) {
  return std::pow(std::max(wo.z * wi.z - wo.x * wi.x - wo.y * wi.y, 0.), e) / wi.z;
}

/// Oren and Nayar's full formula of section 4.3, computed from angles, for rho = 1.
double printed_rough(double sigma, const Vec3<double>& wi, const Vec3<double>& wo) {
  const double ti = std::acos(wi.z), to = std::acos(wo.z), s = sigma * sigma;
  const double a = std::max(ti, to), b = std::min(ti, to);
  const double c = std::cos(std::atan2(wi.y, wi.x) - std::atan2(wo.y, wo.x));
  const double bent = c < 0 ? std::pow(2 * b / kPi, 3) : 0;
  const double C1 = 1 - 0.5 * s / (s + 0.33), C2 = 0.45 * s / (s + 0.09) * (std::sin(a) - bent),
               C3 = 0.125 * s / (s + 0.09) * std::pow(4 * a * b / (kPi * kPi), 2);
  const double direct = C1 + c * C2 * std::tan(b) + (1 - std::abs(c)) * C3 * std::tan((a + b) / 2);
  const double again = 0.17 * s / (s + 0.13) * (1 - c * std::pow(2 * b / kPi, 2));
  return (direct + again) / kPi;
}

double by_factors(double low, double high, double t) { return low * std::pow(high / low, t); }

struct Figure {
  std::string file, title, x, y;
  Map map;
};

/// The relative error of a printed formula's value, or of our formula if none is given.
double error_of(const Model& model, const ParamValues& v, const Vec3<double>& wi, const Vec3<double>& wo,
                std::optional<double> printed) {
  return relative_error(printed ? *printed : model.make_double(v)->eval(wi, wo).r,
                        model.make_wide(v)->eval(exact(wi), exact(wo)).r);
}

/// Directions in the plane of incidence of kOblique, rotated from ideal reflection towards the normal by `angle`.
const Vec3<double> kOblique = direction(std::sqrt(0.75), 0.4);
Vec3<double> beside_reflection(double angle) {
  const double c = std::cos(kPi / 6 - angle), s = std::sin(kPi / 6 - angle);
  return {-s * std::cos(0.4), -s * std::sin(0.4), c};
}

std::vector<Figure> printed_forms() {
  constexpr double kCosR = 0.6, kN0 = 1e-3, kN1 = 1e8;
  const auto only = [](bool printed, double value) { return printed ? std::optional(value) : std::nullopt; };
  const auto latitudinal = [=](bool printed) -> Map {
    return [=](double x, double y) {
      const double n = by_factors(kN0, kN1, y);
      const Vec3<double> wi = direction(x, 1), wo = direction(kCosR, 2);
      return error_of(find_model("radziszewski_alda"), {{"n", n}, {"part", std::string("latitudinal")}}, wi, wo,
                      only(printed, printed_f_theta(n, wi.z * wi.z, kCosR * kCosR) / (2 * kPi)));
    };
  };
  const auto specular = [=](bool printed) -> Map {
    return [=](double x, double y) {
      const double n = by_factors(1, 1e8, y);
      const Vec3<double> wi = beside_reflection(by_factors(1e-12, 1, x) / 2);
      return error_of(find_model("ashikhmin_shirley"),
                      {{"nu", n}, {"nv", n}, {"rs", 1.}, {"part", std::string("specular")}}, wi, kOblique,
                      only(printed, printed_specular(n, n, wi, kOblique)));
    };
  };
  const auto highlight = [=](bool printed) -> Map {
    return [=](double x, double y) {
      const double e = by_factors(1, 1e8, y);
      const Vec3<double> wi = beside_reflection(by_factors(1e-12, 1, x));
      return error_of(find_model("phong"), {{"ks", 1.}, {"e", e}}, wi, kOblique,
                      only(printed, printed_highlight(e, wi, kOblique)));
    };
  };
  // Nearly opposite azimuths, where the printed formula multiplies sin alpha - (2 beta / pi)^3 by tan beta.
  const auto rough = [=](bool printed) -> Map {
    return [=](double x, double y) {
      const double sigma = 0.66 * y, c = by_factors(1e-12, 1, x);
      const Vec3<double> wo = direction(c, 0.3), wi = direction(0.5 * c, 0.3 + 0.9 * kPi);
      return error_of(find_model("oren_nayar"), {{"rho", 1.}, {"sigma", sigma}}, wi, wo,
                      only(printed, printed_rough(sigma, wi, wo)));
    };
  };
  const char* cosine = "cos theta_i from 0 to 1, cos theta_r = 0.6";
  const char* gloss = "n from 1e-3 to 1e8, logarithmic";
  const char* offset = "angle from ideal reflection, 1e-12 to 1 rad, logarithmic; view at 30 degrees";
  const char* exponent = "e from 1 to 1e8, logarithmic";
  const char* grazing = "cos theta_o = 2 cos theta_i from 1e-12 to 1, logarithmic; azimuths 162 degrees apart";
  const char* exponents = "n_u = n_v from 1 to 1e8, logarithmic";
  return {{"radziszewski_alda_printed", "Radziszewski-Alda, eq. 17 as printed", cosine, gloss, latitudinal(true)},
          {"radziszewski_alda_ours", "Radziszewski-Alda, as computed here", cosine, gloss, latitudinal(false)},
          {"ashikhmin_shirley_printed", "Ashikhmin-Shirley, eq. 16 as printed", offset, exponents, specular(true)},
          {"ashikhmin_shirley_ours", "Ashikhmin-Shirley, as computed here", offset, exponents, specular(false)},
          {"phong_printed", "Phong, as printed", offset, exponent, highlight(true)},
          {"phong_ours", "Phong, as computed here", offset, exponent, highlight(false)},
          {"oren_nayar_printed", "Oren-Nayar, section 4.3 as printed", grazing, "sigma from 0 to 0.66", rough(true)},
          {"oren_nayar_ours", "Oren-Nayar, as computed here", grazing, "sigma from 0 to 0.66", rough(false)}};
}

/// The largest error over some light directions, for every view and every value of the model's first number.
Figure figure_of(const Model& model) {
  const ModelInfo& info = model.info();
  const ParamInfo* number = nullptr;
  for (const ParamInfo& p : info.params)
    if (!number && p.kind == ParamKind::Number) number = &p;
  const double low = number ? std::max(number->min, std::min(1e-3, number->max)) : 0;
  const bool factors = number && number->by_factors;
  const auto value = [=](double y) {
    return factors ? by_factors(low, number->max, y) : number->min + y * (number->max - number->min);
  };
  const Map map = [&model, number, value](double x, double y) {
    ParamValues v;
    if (number) v[number->name] = value(y);
    const auto wide = model.make_wide(v);
    const auto ours = model.make_double(v);
    const Vec3<double> wo = direction(by_factors(1e-6, 1, x), 0.7);
    measure::Random random(std::uint64_t(1000 * x) * 1000 + std::uint64_t(1000 * y));
    double worst = -1;
    for (int i = 0; i < 5; ++i) {
      Vec3<double> wi = i == 0 ? Vec3<double>{-wo.x, -wo.y, wo.z} : measure::uniform_direction(random);
      if (const Sample<double> s = ours->sample(wo, measure::uniform_cube(random)); i > 2 && s.pdf > 0) wi = s.wi;
      if (!(wi.z > 0)) continue;
      const Rgb<double> f = ours->eval(wi, wo);
      const Rgb<Wide> t = wide->eval(exact(wi), exact(wo));
      for (const double e : {relative_error(f.r, t.r), relative_error(f.g, t.g), relative_error(f.b, t.b)}) {
        if (std::isnan(e)) return e;
        worst = std::max(worst, e);
      }
    }
    return worst;
  };
  const std::string range =
      number ? fmt::format("{} from {:g} to {:g}{}", number->name, value(0), value(1), factors ? ", logarithmic" : "")
             : "no number";
  return {info.name, info.label, "cos theta_o from 1e-6 to 1, logarithmic", range, map};
}

}  // namespace

void write_stability_maps(const std::string& dir, std::span<const Model* const> chosen) {
  std::error_code error;
  std::filesystem::create_directories(dir, error);
  if (error) throw InputError(fmt::format("{}: expected a folder that can be written: {}", dir, error.message()));
  nlohmann::ordered_json printed = nlohmann::ordered_json::array(), of_models = printed, colors = printed;
  const auto add = [&](nlohmann::ordered_json& maps, const Figure& f) {
    const std::string picture = f.file + ".png";
    write_map(dir + "/" + picture, f.map);
    maps.push_back({{"picture", picture}, {"title", f.title}, {"x", f.x}, {"y", f.y}});
  };
  for (const Figure& f : printed_forms())
    if (std::ranges::any_of(chosen, [&](const Model* m) { return f.file.starts_with(m->info().name + "_"); }))
      add(printed, f);
  for (const Model* model : chosen)
    if (model->has_scatter()) add(of_models, figure_of(*model));
  for (int e = -16; e <= 0; e += 2) colors.push_back({{"exponent", e}, {"rgb", bytes(color_of(std::pow(10., e)))}});
  const nlohmann::ordered_json out{{"format", 1},
                                   {"generator", "brdfc " BRDFC_VERSION},
                                   {"width", kWidth * kScale},
                                   {"height", kHeight * kScale},
                                   {"colors", colors},
                                   {"printed", printed},
                                   {"models", of_models}};
  write_beside(dir + "/maps.json", [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary);
    file << json_text(out, 2) << "\n";
    file.close();
    if (!file) input_error("{}/maps.json: expected a place that can be written", dir);
  });
}

}  // namespace brdfc::report
