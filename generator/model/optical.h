// SPDX-License-Identifier: GPL-3.0-or-later
// Substances given by their measured refractive index n + i k as a function of wavelength, and their approximation in
// the three channels of a working space.
//
// Quantities that are linear in light are averaged over the spectrum (model/spectrum.h): the reflectance at normal
// incidence, R_0; its complex amplitude r = (n - 1 + i k) / (n + 1 + i k), with R_0 = |r|^2; and the reflectance near
// the horizon. Each channel gets an index with exactly its R_0, and with the phase of r that gives the reflectance near
// the horizon. The phase is found by Newton's method, starting from that of the mean amplitude. Between these two
// angles the reflectance differs from the integral over all wavelengths by at most 5e-3 (tests/model/optical_test.cpp
// prints it).
//
// A transparent substance may absorb light: exp(-4 pi k d / lambda) remains after a distance d (Beer's law). The colour
// is exact at one thickness. For other distances each channel uses a power of it, as if all its wavelengths were
// absorbed equally; power_law_error() measures the error of that.
//
// No index reflects more than all the light. If a colour is outside the working space, as gold is outside Rec.709, the
// R_0 of a channel may be above 1; it is limited to kBrightest.
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

/// The largest R_0 of a channel, for which n and k are still those of a metal.
inline constexpr double kBrightest = 0.999;
/// The cosine of the grazing angle at which a channel's index also has the right reflectance.
inline constexpr double kGrazing = 0.1;
/// Wavelengths in nm that a substance's measurements must cover: those beyond contribute less than a tenth to X, Y and
/// Z of white. Measurements are extended by their end values, with a note if they end within kExpected.
inline constexpr double kNeededMin = 430, kNeededMax = 650;
inline constexpr double kExpectedMin = 400, kExpectedMax = 700;
/// Wavelengths in nm outside of which light is invisible; an invalid value there is ignored.
inline constexpr double kSeenMin = 380, kSeenMax = 780;
/// If a file states no unit and all of its wavelengths are at least this number, they are taken as nanometres.
inline constexpr double kNanometres = 100;
/// Measured values of k between 0 and minus this are noise about 0.
inline constexpr double kNoiseOfK = 1e-3;
/// A substance with at least this k is a conductor: it transmits no visible light.
inline constexpr double kConductor = 0.01;

/// The thickness in metres at which absorption is exact if none is stated: that of glass catalogues.
inline constexpr double kThickness = 0.01;
/// The range of thicknesses; one over a thickness is a density that models accept.
inline constexpr double kThinnest = 1e-6, kThickest = 1e6;
/// The smallest share of a channel that is transmitted through that thickness. Colours outside the working space have
/// none, which no absorption coefficient can produce.
inline constexpr double kDarkest = 1e-4;

/// The largest n or k that a file may have.
inline constexpr double kMaxIndex = 100;

/// A function of wavelength, given by numbers at increasing wavelengths in nm.
struct Curve {
  std::vector<double> nm, values;
  /// Linear interpolation, constant beyond the ends; 0 for an empty curve.
  double at(double wavelength) const;
};

/// A substance: a metal, a glass, a liquid.
struct Substance {
  std::string name;                     ///< "gold", or the path of a file
  std::string label;                    ///< "Gold"; for a file without a label, its name
  std::string source;                   ///< who measured it; may be empty
  Curve n, k;                           ///< k is empty if none is given
  std::vector<std::string> notes = {};  ///< for a file: assumptions that were made, and data that were ignored

  /// True if its mean k, weighted by the sensitivity of the eye, is that of a conductor.
  bool conductor() const;
  /// n at the Fraunhofer d line (587.56 nm), and the Abbe number (n_d - 1) / (n_F - n_C), which is infinite without
  /// dispersion.
  double index_d() const;
  double abbe() const;
  /// The Fresnel reflectance for unpolarised light; cosTheta in (0, 1].
  Xyz reflectance(double cosTheta) const;
  /// True if light is absorbed inside: k is given and is not 0 at all visible wavelengths.
  bool absorbs() const;
  /// The share of light that remains after this many metres inside.
  Xyz transmittance(double metres) const;
};

/// Reads a file in the export format of refractiveindex.info: a line wl,n, rows with a wavelength in micrometres and n,
/// then optionally the same for wl,k; or wl,n,k. Lines that start with # are skipped; the first of them is the label,
/// the second the source. Wavelengths of 100 and more are nanometres. Rows may be in any order; for a wavelength that
/// occurs twice the mean is used. Or a file of that site's database, YAML. Assumptions are listed in Substance::notes.
/// Throws InputError naming file, line and what was expected.
Substance read_substance(const std::filesystem::path&);

/// The substances of data/optical, by name.
const std::vector<Substance>& substances();
/// One of these substances; or one read from a file if the name ends with .csv, .txt, .yml or .yaml, where a relative
/// path is relative to `folder`. Throws InputError that lists the names, or as read_substance() does.
Substance find_substance(const std::string& name, const std::filesystem::path& folder);

/// Converts X, Y and Z to the working space.
using ToRgb = std::function<std::array<double, 3>(const Xyz&)>;

/// The optical values of a substance in a working space.
struct OpticalValues {
  std::array<double, 3> n, k;         ///< by channel
  std::array<double, 3> reflectance;  ///< at normal incidence, in [0, 1]
  std::array<double, 3> unclipped;    ///< the same without clipping, for a colour outside the working space
  double luminance;                   ///< the luminance Y of the reflectance
};
OpticalValues optical_values(const Substance&, const ToRgb&);

/// The share of each channel that remains after this many metres, in [kDarkest, 1].
std::array<double, 3> attenuation(const Substance&, double metres, const ToRgb&);
/// The largest error of a channel after a distance, as a share of the light, if the share that remains after
/// `thickness` is raised to the power distance / thickness. Both are in metres.
double power_law_error(const Substance&, double thickness, double distance, const ToRgb&);

/// The values of a substance for those parameters of a model that describe its material (ParamInfo::optical); other
/// parameters are not included. Absorption is exact at the thickness, which is in metres; they are the model's units of
/// length. Throws InputError if the model has no parameters for a substance of that kind, or if a thickness is given
/// but the model or the substance does not absorb.
ParamValues parameters_of(const ModelInfo&, const Substance&, const ToRgb&, std::optional<double> thickness = {});

/// The values of those parameters for a substance that absorbs nothing of which parameters_of() says nothing.
ParamValues clear_inside(const ModelInfo&);

/// Beer's law: the share that remains after this many metres, at the wavelength in nm.
template <class T> T transmittance(const T& nm, const T& k, const T& metres) {
  return exp(-(T(4 * kPi) * k / (nm * T(1e-9))) * metres);
}

/// The amplitude r at normal incidence.
template <class T> struct Amplitude { T real, imaginary; };
template <class T> Amplitude<T> normal_amplitude(const T& n, const T& k) {
  const T below = named("below", sqr(n + T(1)) + sqr(k));
  return {((n - T(1)) * (n + T(1)) + sqr(k)) / below, T(2) * k / below};
}

/// n and k of a channel from means over the spectrum: R_0, r, and the reflectance at kGrazing.
template <class T> struct Index { T n, k; };
template <class T> Index<T> nearest_index(const T& R0, const Amplitude<T>& r, const T& grazing) {
  const T R = named("R", minimum(maximum(R0, T(1e-6)), T(kBrightest)));
  const T root = named("root", sqrt(R));
  // n + i k = (1 + r) / (1 - r), from |r|^2 = R and the cosine and sine of the phase of r.
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
    // The step is damped, because without absorption the result does not depend on the phase's sign, and the slope
    // there is 0.
    // A channel limited to kBrightest keeps the phase of the mean: no index has its reflectance near the horizon.
    const T missing = select(R0 < T(kBrightest), grazing - at_grazing(p[0], p[1]), T(0));
    const T step = missing * slope / (sqr(slope) + T(1e-4));
    const T angle = minimum(maximum(step, T(-0.2)), T(0.2));
    return unit(p[0] - angle * p[1], maximum(p[1] + angle * p[0], T(0)));
  });
  return index(phase[0], phase[1]);
}

}  // namespace brdfc::inline model
