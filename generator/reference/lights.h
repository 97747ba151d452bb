// SPDX-License-Identifier: GPL-3.0-or-later
// Sampling of everything that shines: lamps and the environment.
#pragma once

#include <limits>
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
  /// pdf per solid angle; 0 if the image is black.
  Vec3<double> sample(double u1, double u2, double u3, double& pdf) const;
  double pdf(const Vec3<double>& direction) const;
  /// Mean luminance over all directions.
  double mean() const { return mean_; }

 private:
  struct Alias {
    double keep = 1;
    int other = 0;
  };
  int width_, height_;
  std::vector<Alias> alias_;
  std::vector<double> density_;  // per solid angle
  std::vector<double> z_;        // sine of latitude at the lower edge of each row, row 0 on top
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
  /// 0 only for a light that is wholly below the surface or shows its back. False if no light can contribute.
  bool chances(const Vec3<double>& p, const Vec3<double>& normal, std::vector<double>& chance) const;

  LightSample sample(const Vec3<double>& p, const Vec3<double>& normal, const std::vector<double>& chance,
                     double choice, double u1, double u2, double u3) const;

  /// Calls found(radiance, pdf) for every light that a ray from p meets before `distance`; `chance` as given to
  /// sample() at p, nullptr for the camera or after a mirror (pdf is 0 then). Lamps do not hide each other.
  template <class Found> void meet(const Vec3<double>& p, const Vec3<double>& direction, double distance,
                                   const Vec3<double>& normal, const std::vector<double>* chance, bool from_camera,
                                   const Found& found) const {
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
      const Light& light = scene_.lights[i];
      if (from_camera && !light.camera_visible) continue;
      const double pdf = pdf_of_hit(i, p, direction, distance);
      if (pdf > 0) found(light.radiance, chance ? pdf * (*chance)[i] : 0.0);
    }
    if (distance == kInfinity) {
      const Rgb<double> radiance = scene_.environment.radiance(direction);
      if (max_component(radiance) > 0)
        found(radiance, chance && sampled_environment_
                            ? environment_pdf(direction, normal) * (*chance)[scene_.lights.size()]
                            : 0.0);
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
  double environment_pdf(const Vec3<double>& direction, const Vec3<double>& normal) const;
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
