// SPDX-License-Identifier: GPL-3.0-or-later
// Substances by their measured refractive index n + i k over the wavelength, and what stands for them in the three
// channels of a working space.
//
// What is linear in light is averaged over the spectrum (model/spectrum.h): the reflectance from above, R_0; the
// complex amplitude of it, r = (n - 1 + i k) / (n + 1 + i k), whose square it is; the reflectance near the horizon.
// Each channel gets the index of exactly its R_0, whose r has the phase that gives the reflectance near the horizon. It
// is found from the mean amplitude's by Newton steps, and is off the integral over all wavelengths by at most 5e-3
// between (tests/model/optical_test.cpp prints it).
//
// What lets light through may absorb it on the way: exp(-4 pi k d / lambda) after a distance d (Beer's law). Its colour
// is taken at one thickness, where it is exact. Over other distances a channel has a power of it, as if all its
// wavelengths were absorbed alike; power_law_error() says how far that is off.
//
// No index reflects more than all the light. Where a colour lies outside of the working space, as gold does outside of
// Rec.709, a channel's R_0 may be above 1: it stops at kBrightest.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/dispersion.h"
#include "model/fresnel.h"
#include "model/model.h"
#include "model/spectrum.h"

namespace brdfc::inline model {

/// The largest R_0 of a channel: n and k stay those of a metal.
inline constexpr double kBrightest = 0.999;
/// Cosine of the angle near the horizon whose reflectance a channel's index has as well.
inline constexpr double kGrazing = 0.1;
/// Wavelengths in nm that a substance's measurements must span: beyond them is less than a tenth of what the eye sees
/// of white in any of X, Y and Z. Measurements go on as they end, which is said of those that end within kExpected.
inline constexpr double kNeededMin = 430, kNeededMax = 650;
inline constexpr double kExpectedMin = 400, kExpectedMax = 700;
/// Wavelengths in nm outside of which nothing is seen: a bad value there is left out.
inline constexpr double kSeenMin = 380, kSeenMax = 780;
/// The wavelength, whatever its unit, from which on all of a file's are taken for nanometres: the infrared of 100 um
/// colours nothing.
inline constexpr double kNanometres = 100;
/// Measured k below 0 down to this much are noise about 0.
inline constexpr double kNoiseOfK = 1e-3;
/// The k from which on a substance is a conductor: it lets no light through that one could see.
inline constexpr double kConductor = 0.01;

/// The thickness in metres at which absorption is exact where none is stated: that of catalogues of glass.
inline constexpr double kThickness = 0.01;
/// The range of thicknesses: one over it is a density that models accept.
inline constexpr double kThinnest = 1e-6, kThickest = 1e6;
/// The least share of a channel that passes that thickness. Colours outside of the working space have none, which no
/// absorption per length gives.
inline constexpr double kDarkest = 1e-4;

/// The largest n or k that a file may have.
inline constexpr double kMaxIndex = 100;

/// Numbers over increasing wavelengths in nm.
struct Curve {
  std::vector<double> nm, values;
  /// Linear in between, constant beyond the ends; 0 of an empty one.
  double at(double wavelength) const;
};

/// A metal, a glass, a liquid.
struct Substance {
  std::string name;                     ///< "gold", or the path of a file
  std::string label;                    ///< "Gold"; of a file without one its name
  std::string source;                   ///< who measured it; may be empty
  Curve n, k;                           ///< k is empty where none is given
  std::vector<std::string> notes = {};  ///< of a file: what was assumed, or left out of it

  /// Whether its mean k, as the eye weighs it, is that of a conductor.
  bool conductor() const;
  /// n at the Fraunhofer line d (587.56 nm), and Abbe's number (n_d - 1) / (n_F - n_C); infinite without dispersion.
  double index_d() const;
  double abbe() const;
  /// Fresnel reflectance, unpolarised; cosTheta in (0, 1].
  Xyz reflectance(double cosTheta) const;
  /// Whether light is absorbed inside: k is given, and not 0 all over the visible.
  bool absorbs() const;
  /// What is left of light after that many metres inside.
  Xyz transmittance(double metres) const;
};

/// Reads a file as refractiveindex.info exports it: a line wl,n, rows of a wavelength in micrometres and n, then the
/// same of wl,k, which may be missing; or wl,n,k. Lines that start with # are skipped; the first is the label, the
/// second the source. Wavelengths of 100 and more are nanometres; rows may come in any order, and of a wavelength that
/// stands twice the mean is taken. What was assumed is said in Substance::notes. Throws InputError naming file, line
/// and what was expected.
Substance read_substance(const std::filesystem::path&);

/// Those of data/optical, by name.
const std::vector<Substance>& substances();
/// One of them, or a file if the name ends with .csv; a relative one is looked for in `folder`. Throws InputError
/// listing the names, or as read_substance().
Substance find_substance(const std::string& name, const std::filesystem::path& folder);

/// From X, Y and Z to the working space.
using ToRgb = std::function<std::array<double, 3>(const Xyz&)>;

/// What a substance is in a working space.
struct OpticalValues {
  std::array<double, 3> n, k;         ///< by channel
  std::array<double, 3> reflectance;  ///< from above, in [0, 1]
  std::array<double, 3> unclipped;    ///< the same where a colour lies outside of the working space
  double luminance;                   ///< Y of it
};
OpticalValues optical_values(const Substance&, const ToRgb&);

/// What is left of a channel after that many metres, in [kDarkest, 1].
std::array<double, 3> attenuation(const Substance&, double metres, const ToRgb&);
/// How far a channel is off at most after a distance, as a share of the light, where it has the power distance /
/// thickness of what is left after the thickness; both in metres.
double power_law_error(const Substance&, double thickness, double distance, const ToRgb&);

/// The parameters of a model that say what its surface is made of (ParamInfo::optical), as the substance has them; the
/// others are not in it. Absorption is exact at the thickness, in metres, which are the model's units of length.
/// Throws InputError if the model has none for a substance of that kind, or if a thickness is given to a model or a
/// substance that absorbs nothing.
ParamValues parameters_of(const ModelInfo&, const Substance&, const ToRgb&, std::optional<double> thickness = {});

/// Beer's law: what is left after that many metres at the wavelength in nm.
template <class T> T transmittance(const T& nm, const T& k, const T& metres) {
  return exp(-(T(4 * kPi) * k / (nm * T(1e-9))) * metres);
}

/// r at normal incidence.
template <class T> struct Amplitude { T real, imaginary; };
template <class T> Amplitude<T> normal_amplitude(const T& n, const T& k) {
  const T below = named("below", sqr(n + T(1)) + sqr(k));
  return {((n - T(1)) * (n + T(1)) + sqr(k)) / below, T(2) * k / below};
}

/// n and k of a channel, from means over the spectrum: R_0, r, and the reflectance at kGrazing.
template <class T> struct Index { T n, k; };
template <class T> Index<T> nearest_index(const T& R0, const Amplitude<T>& r, const T& grazing) {
  const T R = named("R", minimum(maximum(R0, T(1e-6)), T(kBrightest)));
  const T root = named("root", sqrt(R));
  // From |r|^2 = R and the cosine and sine of its phase: n + i k = (1 + r) / (1 - r).
  const auto index = [&](const T& cosine, const T& sine) {
    const T below = T(1) + R - T(2) * root * cosine;
    return Index<T>{(T(1) - R) / below, T(2) * root * sine / below};
  };
  const auto at_grazing = [&](const T& cosine, const T& sine) {
    const Index<T> i = index(cosine, sine);
    return fresnel_conductor(T(kGrazing), T((1 - kGrazing) * (1 + kGrazing)), i.n, i.k);
  };
  const auto unit = [](const T& cosine, const T& sine) {
    const T length = maximum(sqrt(sqr(cosine) + sqr(sine)), tiny<T>());
    return std::array<T, 2>{cosine / length, sine / length};
  };
  const std::array<T, 2> phase = iterate(4, unit(r.real, maximum(r.imaginary, T(0))), [&](const std::array<T, 2>& p) {
    const T h = T(1e-4);
    const auto turned = [&](const T& angle) { return unit(p[0] - angle * p[1], p[1] + angle * p[0]); };
    const std::array<T, 2> up = turned(h), down = turned(-h);
    const T slope = (at_grazing(up[0], up[1]) - at_grazing(down[0], down[1])) / (T(2) * h);
    // Damped, for without absorption nothing depends on the phase's sign: there the slope is 0.
    // What stopped at kBrightest keeps the mean's phase: no index reflects what it should near the horizon.
    const T missing = select(R0 < T(kBrightest), grazing - at_grazing(p[0], p[1]), T(0));
    const T step = missing * slope / (sqr(slope) + T(1e-4));
    const T angle = minimum(maximum(step, T(-0.2)), T(0.2));
    return unit(p[0] - angle * p[1], maximum(p[1] + angle * p[0], T(0)));
  });
  return index(phase[0], phase[1]);
}

}  // namespace brdfc::inline model
