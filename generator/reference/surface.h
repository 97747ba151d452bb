// SPDX-License-Identifier: GPL-3.0-or-later
// Materials, in the form that tracers evaluate.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "model/model.h"
#include "model/sampling.h"
#include "reference/lights.h"
#include "reference/random.h"
#include "reference/scene.h"

namespace brdfc::reference {

inline constexpr int kRouletteStart = 3;  ///< scattering events before Russian roulette may end a path

/// The index of refraction that a path follows, and its throughput.
struct Bent {
  double ior;
  Rgb<double> throughput;
};
/// Chooses the index for a path. If the channels have different indices, one channel is chosen, with a probability
/// proportional to its throughput. u is in [0, 1).
inline Bent bend(const std::array<double, 3>& iors, const Rgb<double>& throughput, double u) {
  if (iors[0] == iors[1] && iors[1] == iors[2]) return {iors[1], throughput};
  const auto& [r, g, b] = throughput;
  const double all = r + g + b, at = u * all;
  if (at < r) return {iors[0], {all, 0, 0}};
  if (at < r + g) return {iors[1], {0, all, 0}};
  return {iors[2], {0, 0, b > 0 ? all : 0}};
}

/// A material ready for evaluation, with precomputed properties.
class Surface {
 public:
  explicit Surface(const Material& material)
      : material_(material),
        brdf_(material.model->make_double(material.values)),
        packed_(material.model->make_packed(material.values)),
        has_scatter_(material.model->has_scatter()),
        has_mirror_(material.model->has_mirror()),
        has_transmit_(material.model->has_transmit()),
        has_medium_(material.model->has_medium()),
        through_(brdf_->scatters_through()) {
    if (!has_scatter_ || !(has_mirror_ || has_transmit_)) return;  // no choice between lobe and delta terms
    Random random(0, 0, 0);
    for (int i = 0; i < kCosines; ++i) {
      double sum = 0;
      for (int k = 0; k < kSamples; ++k) {
        const double z = (i + random.uniform()) / kCosines, phi = 2 * kPi * random.uniform();
        const double s = std::sqrt(1 - z * z);
        const Sample<double> sample = brdf_->sample({s * std::cos(phi), s * std::sin(phi), z}, random.uniform3());
        sum += luminance(sample.weight);
      }
      albedo_[i] = sum / kSamples;
    }
  }

  bool has_scatter() const { return has_scatter_; }
  bool has_mirror() const { return has_mirror_; }
  bool has_transmit() const { return has_transmit_; }
  bool has_medium() const { return has_medium_; }
  bool scatters_through() const { return through_; }
  /// Whether shading normals are bent (model/horizon.h). Those of matte models, which have no mirror direction, are
  /// not.
  bool bends_normals() const { return material_.model->info().look != Look::Matte; }

  /// Probability of following one of the delta terms, whose weights add up to `delta`, instead of sampling the rest.
  /// Any number strictly between 0 and 1 is unbiased if both exist. The estimated albedo of the rest only keeps the
  /// weights even.
  double delta_chance(const Rgb<double>& delta, double cosine) const {
    const double m = luminance(delta);
    if (!has_scatter_) return 1;
    if (!(m > 0)) return 0;
    const double rest = albedo_[std::min(int(std::abs(cosine) * kCosines), kCosines - 1)];
    return std::min(std::max(m / (m + rest), 0.05), 0.95);
  }

  /// BRDFs that a thread binds anew at each place; nullptr if they are the same everywhere.
  struct Scratch {
    std::unique_ptr<Brdf<double>> brdf;
    std::unique_ptr<PackedBrdf> packed;
  };
  Scratch make_scratch() const {
    if (material_.textures.empty()) return {};
    return {material_.model->make_double(material_.values), material_.model->make_packed(material_.values)};
  }
  /// The BRDF at texture coordinates, valid until `scratch` is bound to others.
  const Brdf<double>& at(double u, double v, Scratch& scratch) const {
    if (!scratch.brdf) return *brdf_;
    for (const auto& [name, image] : material_.textures) {
      const Rgb<double> c = bilinear(*image, u, v, Wrap::Repeat, Wrap::Repeat);
      scratch.brdf->assign(name, {c.r, c.g, c.b});
    }
    return *scratch.brdf;
  }
  /// The same for kLanes places. place(k) returns texture coordinates.
  template <class Place> const PackedBrdf& at(const Place& place, Scratch& scratch) const {
    if (!scratch.packed) return *packed_;
    for (const auto& [name, image] : material_.textures) {
      std::array<Pack, 3> value;
      for (std::size_t k = 0; k < kLanes; ++k) {
        const auto [u, v] = place(k);
        const Rgb<double> c = bilinear(*image, u, v, Wrap::Repeat, Wrap::Repeat);
        value[0][k] = c.r, value[1][k] = c.g, value[2][k] = c.b;
      }
      scratch.packed->assign(name, value);
    }
    return *scratch.packed;
  }

  [[noreturn, gnu::noinline]] void bad_value(const char* what, const Vec3<double>& wi, const Vec3<double>& wo,
                                             const Rgb<double>& value) const {
    throw ValueError(fmt::format(
        "{} {}: {} = ({:.9g}, {:.9g}, {:.9g}) at wi = ({:.17g}, {:.17g}, {:.17g}), wo = ({:.17g}, {:.17g}, {:.17g})",
        material_.model->info().name, format_values(material_.model->info(), material_.values), what, value.r, value.g,
        value.b, wi.x, wi.y, wi.z, wo.x, wo.y, wo.z));
  }

  void check(const char* what, const Vec3<double>& wi, const Vec3<double>& wo, const Rgb<double>& value) const {
    // Written so that NaN fails the test.
    const auto good = [](double x) { return x >= 0 && x < kInfinity; };
    if (!(good(value.r) && good(value.g) && good(value.b))) bad_value(what, wi, wo, value);
  }

 private:
  static constexpr int kCosines = 32, kSamples = 128;
  const Material& material_;
  std::unique_ptr<Brdf<double>> brdf_;
  std::unique_ptr<PackedBrdf> packed_;
  const bool has_scatter_, has_mirror_, has_transmit_, has_medium_, through_;
  std::array<double, kCosines> albedo_{};
};

/// Per-thread data for the surfaces, which threads share.
class SurfaceScratch {
 public:
  explicit SurfaceScratch(const std::vector<Surface>& surfaces) {
    for (const Surface& s : surfaces) brdfs_.push_back(s.make_scratch());
  }
  /// The scratch that Surface::at() asks for.
  Surface::Scratch& of(int material) { return brdfs_[std::size_t(material)]; }

 private:
  std::vector<Surface::Scratch> brdfs_;
};

}  // namespace brdfc::reference
