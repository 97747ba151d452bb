// SPDX-License-Identifier: GPL-3.0-or-later
// The reflectance of thin_film's facets against transfer matrices of the layers, summed over the wavelengths of the CIE
// observer's table.
#include <gtest/gtest.h>

#include <complex>

#include "core/data_dir.h"
#include "measure/probes.h"
#include "model/optical.h"
#include "model/spectrum.h"
#include "reference/color.h"

namespace brdfc {
namespace {

using Complex = std::complex<double>;
using Matrix = std::array<std::array<Complex, 2>, 2>;

/// A film of the index n2 and a thickness in nm, on n3.
struct Film {
  double thickness, n2;
  std::array<Complex, 3> n3;
};

/// F. Abeles' characteristic matrix of a layer (1950), as in M. Born, E. Wolf: Principles of Optics, section 1.6: both
/// polarisations, from the fields at the two surfaces. No series, no amplitudes of single surfaces.
double reflectance(double cosTheta, const Complex& n2, double thickness, const Complex& n3, double nm) {
  const double sin2 = 1 - cosTheta * cosTheta;
  const Complex cos2 = std::sqrt(1. - sin2 / (n2 * n2)), cos3 = std::sqrt(1. - sin2 / (n3 * n3));
  const Complex delta = 2 * kPi * n2 * cos2 * thickness / nm, i(0, 1);
  double sum = 0;
  for (const bool is_p : {false, true}) {
    const Complex a1 = is_p ? 1 / cosTheta : cosTheta, a2 = is_p ? n2 / cos2 : n2 * cos2,
                  a3 = is_p ? n3 / cos3 : n3 * cos3;
    // Waves are exp(-i omega t), so that n + i k absorbs.
    const Matrix m = {{{std::cos(delta), -i * std::sin(delta) / a2}, {-i * a2 * std::sin(delta), std::cos(delta)}}};
    const Complex b = m[0][0] + m[0][1] * a3, c = m[1][0] + m[1][1] * a3;
    sum += std::norm((a1 * b - c) / (a1 * b + c));
  }
  return sum / 2;
}

const std::array<std::pair<const char*, const char*>, 3> kSpaces = {
    {{"rec709", "Linear Rec.709"}, {"rec2020", "Linear Rec.2020"}, {"acescg", "ACEScg"}}};

/// The channels of a working space. Each has a base of its own.
std::array<double, 3> by_wavelengths(const Film& film, double cosTheta, const reference::ColorConfig& config) {
  std::array<double, 3> out;
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = config.from_xyz(
        xyz_of([&](double nm) { return reflectance(cosTheta, film.n2, film.thickness, film.n3[c], nm); }))[c];
  return out;
}

/// F of the model: f at the mirror direction, over that of a base which reflects nearly everything.
std::array<double, 3> of_model(const Film& film, double cosTheta, const char* space) {
  const Model& m = find_model("thin_film");
  const auto at = [&](ParamValues values) {
    values["space"] = std::string(space);
    values["ax"] = values["ay"] = 1.;
    const double sine = std::sqrt(1 - cosTheta * cosTheta);
    const Rgb<double> f = m.make_double(values)->eval({sine, 0, cosTheta}, {-sine, 0, cosTheta});
    return std::array{f.r, f.g, f.b};
  };
  ParamValues values = {{"thickness", film.thickness}, {"film_ior", film.n2}}, mirror = {{"film_ior", 1.}};
  for (std::size_t c = 0; c < 3; ++c) {
    const std::string name = std::string(1, "rgb"[c]);
    values["n_" + name] = film.n3[c].real();
    values["k_" + name] = film.n3[c].imag();
    mirror["n_" + name] = 1e-3;  // reflects all light, but for 1e-5 and less
    mirror["k_" + name] = 100.;
  }
  std::array<double, 3> f = at(values);
  const std::array<double, 3> one = at(mirror);
  for (std::size_t c = 0; c < 3; ++c) f[c] /= one[c];
  return f;
}

constexpr std::array<std::array<Complex, 3>, 5> kBases = {
    {{Complex(2.74, 3.84), Complex(2.51, 3.4), Complex(2.24, 3.01)},  // titanium
     {Complex(0.15, 4), Complex(0.13, 3.3), Complex(0.14, 2.5)},      // silver
     {Complex(2.9, 3.1), Complex(2.9, 2.9), Complex(2.55, 2.75)},     // iron
     {Complex(1.5), Complex(1.5), Complex(1.5)},
     {Complex(1.33), Complex(1.33), Complex(1.33)}}};

TEST(ThinFilm, IsNearTheSumOverWavelengths) {
  const reference::ColorConfig config(data_path("data/color/config.ocio"));
  for (const auto& [space, name] : kSpaces) {
    const reference::ColorConfig converted = config.with_working_space(name);
    std::vector<double> off;
    int outside = 0;
    measure::Random random(1);
    for (const auto& base : kBases)
      for (int k = 0; k < 200; ++k) {
        const Vec3<double> u = measure::uniform_cube(random);
        const Film film = {1500 * u.x, 1 + 1.7 * u.y, base};
        const double cosTheta = 0.02 + 0.98 * u.z;
        const std::array<double, 3> wanted = by_wavelengths(film, cosTheta, converted),
                                    got = of_model(film, cosTheta, space);
        for (std::size_t c = 0; c < 3; ++c) {
          outside += wanted[c] < 0 || wanted[c] > 1;
          off.push_back(std::abs(got[c] - std::clamp(wanted[c], 0., 1.)));
        }
      }
    std::ranges::sort(off);
    const double mean = std::accumulate(off.begin(), off.end(), 0.) / double(off.size());
    const double most = off[off.size() * 99 / 100];
    std::printf("%s: off by %.5f on average, 99 %% by less than %.4f, at most %.4f; %d of %zu outside\n", space, mean,
                most, off.back(), outside, off.size());
    EXPECT_LT(mean, 0.002) << space;
    EXPECT_LT(most, 0.02) << space;
    EXPECT_LT(off.back(), 0.1) << space;
    EXPECT_LE(outside, off.size() / 50) << space;
  }
}

/// The error of one n and k for each channel, in place of those of all wavelengths. It is larger for metals that are
/// coloured themselves; gold is outside Rec.709.
TEST(ThinFilm, IsNearTheSumOverTheSpectrumOfAMetal) {
  const reference::ColorConfig rec709 = reference::ColorConfig(data_path("data/color/config.ocio"));
  for (const char* name : {"titanium", "iron", "chromium", "aluminium", "silver", "copper", "gold"}) {
    const Substance metal = find_substance(name, ".");
    const ParamValues values =
        parameters_of(find_model("thin_film").info(), metal, [&](const Xyz& xyz) { return rec709.from_xyz(xyz); });
    Film film;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::string channel(1, "rgb"[c]);
      film.n3[c] = {std::get<double>(values.at("n_" + channel)), std::get<double>(values.at("k_" + channel))};
    }
    double sum = 0, most = 0;
    int count = 0;
    for (film.n2 = 1.4; film.n2 < 2.7; film.n2 += 0.3)
      for (film.thickness = 0; film.thickness < 800; film.thickness += 20)
        for (const double cosTheta : {1., 0.8, 0.5, 0.2}) {
          const std::array<double, 3> got = of_model(film, cosTheta, "rec709");
          const std::array<double, 3> wanted = rec709.from_xyz(xyz_of([&](double nm) {
            return reflectance(cosTheta, film.n2, film.thickness, Complex(metal.n.at(nm), metal.k.at(nm)), nm);
          }));
          for (std::size_t c = 0; c < 3; ++c) {
            const double off = std::abs(got[c] - std::clamp(wanted[c], 0., 1.));
            sum += off, most = std::max(most, off), ++count;
          }
        }
    std::printf("%s: off by %.4f on average, at most %.3f\n", name, sum / count, most);
    const bool is_colored = std::string(name) == "copper" || std::string(name) == "gold";
    EXPECT_LT(sum / count, is_colored ? 0.02 : 0.005) << name;
    EXPECT_LT(most, is_colored ? 0.35 : 0.1) << name;
  }
}

/// Without a film, and with one of air or of the base's own index, it is Fresnel's reflectance of the base.
TEST(ThinFilm, WithoutAFilmItIsTheBase) {
  for (const auto& base : kBases)
    for (const double cosTheta : {1., 0.7, 0.3, 0.05, 1e-3}) {
      std::array<double, 3> plain;
      for (std::size_t c = 0; c < 3; ++c) plain[c] = reflectance(cosTheta, 1, 0, base[c], 550);
      std::vector<Film> films = {{0, 1.5, base}, {0, 5, base}, {1e-3, 2.5, base}, {700, 1, base}, {1e4, 1, base}};
      if (base[0].imag() == 0) films.push_back({500, base[0].real(), base});
      for (const Film& film : films) {
        const std::array<double, 3> got = of_model(film, cosTheta, "rec709");
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(got[c], plain[c], film.thickness == 1e-3 ? 1e-4 : 2e-5) << cosTheta << " " << film.thickness;
      }
    }
}

/// Half a wave more is lost at a surface behind which the index is higher. Seen from above, a quarter wave of n2
/// between 1 and n3 = n2^2 cancels; of n2 > n3 it is brightest.
TEST(ThinFilm, PhasesJumpWhereTheIndexRises) {
  const auto at_green = [](double n2, double n3) {
    return of_model({549 / (4 * n2), n2, {Complex(n3), Complex(n3), Complex(n3)}}, 1, "rec709")[1];
  };
  EXPECT_LT(at_green(1.5, 2.25), 0.01);
  EXPECT_GT(at_green(2.25, 1.5), 0.25);
  // A thin film on less dense matter vanishes, one on denser matter adds little: the black film of a soap bubble.
  const std::array<Complex, 3> water = {Complex(1), Complex(1), Complex(1)};
  EXPECT_LT(of_model({5, 1.33, water}, 1, "rec709")[1], 1e-3);
}

/// Far thicker than the coherence of the channels: no colours, and the mean over thicknesses, which by Airy's formula
/// is (R12 + R23 - 2 R12 R23) / (1 - R12 R23).
TEST(ThinFilm, ThickFilmsHaveNoColours) {
  const double R12 = std::pow(0.5 / 2.5, 2), R23 = std::pow((2.4 - 1.5) / (2.4 + 1.5), 2);
  const std::array<Complex, 3> base = {Complex(2.4), Complex(2.4), Complex(2.4)};
  for (const double value : of_model({1e4, 1.5, base}, 1, "rec709"))
    EXPECT_NEAR(value, (R12 + R23 - 2 * R12 * R23) / (1 - R12 * R23), 2e-5);
}

}  // namespace
}  // namespace brdfc
