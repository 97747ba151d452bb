// SPDX-License-Identifier: GPL-3.0-or-later
// Light sampling: lamps and the environment.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "reference/block.h"
#include "reference/light_tree.h"
#include "reference/scene.h"

namespace brdfc::reference {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Sampled directions towards lights. pdf == 0 means that there is no direction.
struct LightSamples {
  Vectors wi;
  Numbers distance;
  Colors radiance;    ///< or, for a delta light, irradiance on a surface facing it
  Numbers pdf;        ///< per solid angle, times the probability of this light; for a delta light the probability alone
  Lanes<bool> delta;  ///< can't be met by a ray
};

/// Random numbers for light samples: one for the choice of the light, and three for the place on it.
struct LightNumbers {
  Numbers choice, u1, u2, u3;
};

/// Importance sampling of an equirectangular image. There is one cell for each texel, weighted by the integral of its
/// bilinear reconstruction.
class EnvironmentSampler {
 public:
  explicit EnvironmentSampler(const Environment& environment);
  struct Choice {
    double u = 0;    ///< horizontal place in the image, as in direction_to_equirectangular()
    double z = 0;    ///< sine of the latitude
    double pdf = 0;  ///< per solid angle; 0 if the image is black

    double v() const { return vectorised::asin(z) / kPi + 0.5; }
    Vec3<double> direction() const {
      const double phi = kPi * (1 - 2 * u), s = sqrt(maximum(1 - z * z, 0.0));
      return {s * vectorised::cos(phi), s * vectorised::sin(phi), z};
    }
  };
  Choice choose(double u1, double u2, double u3) const;
  /// The pdf of the direction at that place.
  double pdf(double u, double v) const;
  /// Prefetching, because images are larger than caches: for pdf() and the colour at a place; and for choose() with
  /// this u1, in two steps that should be some time apart.
  void fetch(double u, double v) const;
  void fetch_slot(double u1) const { __builtin_prefetch(&cells_[slot(u1 * double(cells_.size()))]); }
  void fetch_cell(double u1) const;
  /// Mean luminance over all directions.
  double mean() const { return mean_; }

 private:
  /// Data that are read together are stored together.
  struct Cell {
    double density = 0;  // per solid angle
    float keep = 1;      // probability to stay in this cell (Vose's alias table)
    int other = 0;       // the cell to go to otherwise
  };
  void fetch_texels(int x, int y) const;
  std::size_t slot(double scaled) const { return std::min(std::size_t(scaled), cells_.size() - 1); }
  /// The cell that u1 selects.
  unsigned cell(double u1) const {
    const double scaled = u1 * double(cells_.size());
    const std::size_t s = slot(scaled);
    return unsigned(scaled - double(s) < cells_[s].keep ? s : std::size_t(cells_[s].other));
  }
  std::size_t cell_at(double u, double v) const;
  const Image& image_;
  int width_, height_;
  std::vector<Cell> cells_;  // empty if the image is black
  std::vector<double> z_;    // sine of latitude at the lower edge of each row; row 0 is the top row
  double mean_ = 0;
};

class Lights {
 public:
  /// `sample_constant`: also sample an environment of constant colour. Otherwise only BRDF sampling finds it.
  Lights(const Scene& scene, bool sample_constant, std::size_t most_weighed = kMostWeighed);

  bool empty() const { return count_ == 0; }
  /// How many numbers chances() stores for each point.
  std::size_t kept() const { return tree_ ? std::size_t(kKept) : count_; }

  /// Computes the probabilities of choosing each light at points with these geometric normals. They are approximately
  /// proportional to the possible contributions, and 0 only for a light that is entirely below the surface or faces
  /// away. `lit` is false where no light can contribute. Each element of `chance` has room for kept() numbers.
  void chances(const Vectors& p, const Vectors& normal, std::size_t count, const Lanes<double*>& chance,
               Lanes<bool>& lit) const;

  /// The probability of light i, from the numbers that chances() stored. The environment is the last light.
  double chance(std::size_t i, const double* kept) const;

  /// Samples lights for the lanes where `lit` is true. `numbers` need values only where choose() and choose_more() say
  /// so.
  void sample(const Vectors& p, const Vectors& normal, std::size_t count, const Lanes<double*>& chance,
              const Lanes<bool>& lit, const LightNumbers& numbers, LightSamples& out) const;
  /// Which random numbers sample() needs. choose(): there is more than one light to choose from. choose_more(): for one
  /// light it takes more than a place on it.
  bool choose() const { return count_ > 1; }
  bool choose_more() const { return image_ && sampled_environment_; }
  /// Prefetches what sample() will read for that light with this u1, in two steps as EnvironmentSampler.
  void fetch_slot(double u1) const { image_->fetch_slot(u1); }
  void fetch_cell(double u1) const { image_->fetch_cell(u1); }

  /// Calls found(k, radiance, pdf) for every light that ray k meets before its distance. Lamps do not hide each other.
  /// `normal` is the surface normal at the ray's origin, and `chance` the probabilities that chances() stored there.
  /// `chance` is nullptr for camera rays and after a mirror; pdf is 0 then.
  template <class Found> void meet(const Rays& rays, const Numbers& distance, std::size_t count, const Vectors& normal,
                                   const Lanes<const double*>& chance, bool from_camera, const Found& found) const {
    if (tree_ && (!from_camera || camera_sees_)) {
      std::vector<std::size_t> lamps;
      Lanes<std::size_t> ends;
      meet_in_tree(rays, distance, count, lamps, ends);
      for (std::size_t k = 0, at = 0; k < count; ++k)
        for (; at < ends[k]; ++at) {
          const Light& light = scene_.lights[lamps[at]];
          if (from_camera && !light.camera_visible) continue;
          const double pdf = pdf_of_hit(lamps[at], rays.origin[k], rays.direction[k], distance[k]);
          if (pdf > 0) found(k, light.radiance, chance[k] ? pdf * this->chance(lamps[at], chance[k]) : 0.0);
        }
    }
    Numbers pdf;
    for (std::size_t i = 0; i < scene_.lights.size() && !tree_; ++i) {
      const Light& light = scene_.lights[i];
      if (from_camera && !light.camera_visible) continue;
      pdfs_of_hit(i, rays, distance, count, pdf);
      for (std::size_t k = 0; k < count; ++k)
        if (pdf[k] > 0) found(k, light.radiance, chance[k] ? pdf[k] * chance[k][i] : 0.0);
    }
    Numbers u, v;
    if (image_) places(rays.direction, distance, count, u, v);
    for (std::size_t k = 0; k < count; ++k) {
      if (distance[k] < kInfinity) continue;
      double of_environment = 0;
      const Rgb<double> radiance = environment(rays.direction[k], u[k], v[k], normal[k],
                                               chance[k] && sampled_environment_ ? &of_environment : nullptr);
      if (max_component(radiance) > 0)
        found(k, radiance, of_environment > 0 ? of_environment * chance[k][environment_place()] : 0.0);
    }
  }

 private:
  /// Precomputed data of a lamp, in a form that loops over lanes keep in registers.
  struct Lamp {
    Vec3<double> position, direction, u, v;  // as in Light
    double radius;
    Rgb<double> shine;              // radiance, or a delta light's intensity
    double luminance = 0;           // luminance of radiance x area, or of the intensity
    double area = 0;                // flat lamps only
    double per_u2 = 0, per_v2 = 0;  // 1 / |half axis|^2
    double cone_pdf = 0;            // suns with an angle only
    double one_minus_cos = 0;
    bool delta = false;  // rays can't meet it
  };

  /// A direction towards a light.
  struct Sample {
    Vec3<double> wi;
    double distance = kInfinity, pdf = 0;
    double brightness = 1;  // factor on the light's radiance
  };

  /// Calls body with the kind of a light as a compile-time constant.
  template <class Body> static void of_kind(Light::Kind kind, const Body& body);
  template <Light::Kind kKind>
  static double weight(const Lamp& lamp, const Vec3<double>& p, const Vec3<double>& normal);
  template <Light::Kind kKind>
  static Sample sample_light(const Lamp& lamp, const Vec3<double>& p, double u1, double u2);
  /// The pdf of sampling this direction towards the light; 0 if the ray does not meet it before `distance`.
  template <Light::Kind kKind>
  static double pdf_of_hit(const Lamp& lamp, const Vec3<double>& p, const Vec3<double>& direction, double distance);
  void pdfs_of_hit(std::size_t i, const Rays& rays, const Numbers& distance, std::size_t count, Numbers& pdf) const;
  double pdf_of_hit(std::size_t i, const Vec3<double>& p, const Vec3<double>& direction, double distance) const;

  /// Layout of the numbers stored for a point if a tree chooses: the point and its normal, the probability of the
  /// environment, and the weights of the tree's root.
  enum Kept { kPoint = 0, kNormal = 3, kEnvironment = 6, kRoot = 8, kKept = kRoot + LightTree::kWidth };
  static Vec3<double> vector_at(const double* v) { return {v[0], v[1], v[2]}; }
  /// Index of the probability of the environment.
  std::size_t environment_place() const { return tree_ ? std::size_t(kEnvironment) : scene_.lights.size(); }
  void weigh_in_tree(const Vectors& p, const Vectors& normal, std::size_t count, const Lanes<double*>& kept,
                     Lanes<bool>& lit) const;
  void choose_in_tree(std::size_t count, const Lanes<double*>& kept, const Lanes<bool>& lit, const Numbers& choice,
                      Lanes<std::size_t>& chosen, Numbers& chance) const;
  /// The lamps that rays may meet, ray by ray, and for each ray the end of its lamps in the list.
  void meet_in_tree(const Rays& rays, const Numbers& distance, std::size_t count, std::vector<std::size_t>& lamps,
                    Lanes<std::size_t>& ends) const;
  static LampBounds bounds_of(const Light& light, const Lamp& lamp);

  /// Places in the environment's image for rays that leave the scene, as in direction_to_equirectangular(). Prefetches
  /// the image there.
  void places(const Vectors& direction, const Numbers& distance, std::size_t count, Numbers& u, Numbers& v) const;
  /// Radiance from the environment; for an image, at place (u, v). If `pdf` is not null, also the pdf of sampling that
  /// direction.
  Rgb<double> environment(const Vec3<double>& direction, double u, double v, const Vec3<double>& normal,
                          double* pdf) const;

  const Scene& scene_;
  std::vector<Lamp> lamps_;
  std::optional<LightTree> tree_;  // only with many lamps
  bool camera_sees_ = false;       // at least one lamp
  std::unique_ptr<EnvironmentSampler> image_;
  bool sampled_environment_ = false;
  double environment_weight_ = 0;
  std::size_t count_ = 0;
};

}  // namespace brdfc::reference
