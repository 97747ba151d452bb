// SPDX-License-Identifier: GPL-3.0-or-later
// Sampling of everything that shines: lamps and the environment.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "reference/scene.h"

namespace brdfc::reference {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A direction towards a light. pdf == 0: none.
struct LightSample {
  Vec3<double> wi;
  double distance = kInfinity;
  /// Radiance, or for a point without extent its irradiance facing it.
  Rgb<double> radiance{0, 0, 0};
  double pdf = 0;      ///< per solid angle, times the chance to choose this light; for a delta light the chance alone
  bool delta = false;  ///< can't be met by a ray
};

/// Importance-sampled equirectangular image: a cell a texel, with the integral of its bilinear reconstruction.
class EnvironmentSampler {
 public:
  explicit EnvironmentSampler(const Environment& environment);
  /// A direction, its density per solid angle, 0 if the image is black, and its place in the image, as
  /// direction_to_equirectangular() gives it.
  Vec3<double> sample(double u1, double u2, double u3, double& pdf, double& u, double& v) const;
  /// Density of the direction at that place.
  double pdf(double u, double v) const;
  /// Images are larger than caches. These fetch what will be read soon: pdf() and the colour at a place; and, in two
  /// steps, each some time after the other, sample() with this u1.
  void fetch(double u, double v) const;
  void fetch_slot(double u1) const { __builtin_prefetch(&cells_[slot(u1 * double(cells_.size()))]); }
  void fetch_cell(double u1) const;
  /// Mean luminance over all directions.
  double mean() const { return mean_; }

 private:
  /// What is read together lies together.
  struct Cell {
    double density = 0;  // per solid angle
    float keep = 1;      // chance to stay, of Vose's alias table
    int other = 0;       // cell to go to otherwise
  };
  std::size_t slot(double scaled) const { return std::min(std::size_t(scaled), cells_.size() - 1); }
  /// The cell that u1 chooses.
  unsigned cell(double u1) const {
    const double scaled = u1 * double(cells_.size());
    const std::size_t s = slot(scaled);
    return unsigned(scaled - double(s) < cells_[s].keep ? s : std::size_t(cells_[s].other));
  }
  std::size_t cell_at(double u, double v) const;
  const Image& image_;
  int width_, height_;
  std::vector<Cell> cells_;  // empty if the image is black
  std::vector<double> z_;    // sine of latitude at the lower edge of each row, row 0 on top
  double mean_ = 0;
};

class Lights {
 public:
  /// `sample_constant`: take directions also from an environment of one colour, which is otherwise left to the
  /// BRDF's own sampling.
  Lights(const Scene& scene, bool sample_constant);

  bool empty() const { return count_ == 0; }
  std::size_t count() const { return count_; }

  /// Chance of each light for a point with this geometric normal, about in proportion to what it can contribute;
  /// 0 only for a light that is wholly below the surface or shows its back. False if no light can contribute. There are
  /// count() of them.
  bool chances(const Vec3<double>& p, const Vec3<double>& normal, std::span<double> chance) const;

  LightSample sample(const Vec3<double>& p, const Vec3<double>& normal, std::span<const double> chance, double choice,
                     double u1, double u2, double u3) const;

  /// Is the environment an image that is sampled?
  bool samples_image() const { return image_ && sampled_environment_; }
  const EnvironmentSampler& image() const { return *image_; }
  /// Where in the environment's image a ray ends that leaves the scene, as direction_to_equirectangular() gives it;
  /// what is there will be read soon.
  std::array<double, 2> place(const Vec3<double>& direction) const;

  /// Calls found(radiance, pdf) for every light that a ray from p meets before `distance`; `chance` as given to
  /// sample() at p, nullptr for the camera or after a mirror (pdf is 0 then). Lamps do not hide each other. `place` is
  /// that of the direction, where the ray leaves the scene.
  template <class Found> void meet(const Vec3<double>& p, const Vec3<double>& direction, double distance,
                                   const std::array<double, 2>& place, const Vec3<double>& normal, const double* chance,
                                   bool from_camera, const Found& found) const {
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
      const Light& light = scene_.lights[i];
      if (from_camera && !light.camera_visible) continue;
      const double pdf = pdf_of_hit(i, p, direction, distance);
      if (pdf > 0) found(light.radiance, chance ? pdf * chance[i] : 0.0);
    }
    if (distance == kInfinity) {
      double pdf = 0;
      const Rgb<double> radiance =
          environment(direction, place, normal, chance && sampled_environment_ ? &pdf : nullptr);
      if (max_component(radiance) > 0) found(radiance, pdf > 0 ? pdf * chance[scene_.lights.size()] : 0.0);
    }
  }

 private:
  /// What sampling needs again and again.
  struct Known {
    double luminance = 0;           // of radiance x area, or of the intensity
    double area = 0;                // of a flat lamp
    double per_u2 = 0, per_v2 = 0;  // 1 / |half axis|^2
    double cone_pdf = 0;            // of a sun with an angle
    double one_minus_cos = 0;
  };

  double weight(std::size_t i, const Vec3<double>& p, const Vec3<double>& normal) const;
  /// Radiance from the environment, and where asked for the density of sampling that direction.
  Rgb<double> environment(const Vec3<double>& direction, const std::array<double, 2>& place, const Vec3<double>& normal,
                          double* pdf) const;
  LightSample sample_light(std::size_t i, const Vec3<double>& p, double u1, double u2) const;
  /// Density of sampling this direction towards the light; 0 if the ray does not meet it before `distance`.
  double pdf_of_hit(std::size_t i, const Vec3<double>& p, const Vec3<double>& direction, double distance) const;

  const Scene& scene_;
  std::vector<Known> known_;
  std::unique_ptr<EnvironmentSampler> image_;
  bool sampled_environment_ = false;
  double environment_weight_ = 0;
  std::size_t count_ = 0;
};

}  // namespace brdfc::reference
