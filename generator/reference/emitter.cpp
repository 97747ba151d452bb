// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/emitter.h"

#include <algorithm>
#include <numeric>

#include "reference/cone.h"

namespace brdfc::reference {
namespace {

using Vector = Vec3<double>;
using Color = Rgb<double>;

/// A uniform sample of the disk of radius 1.
std::array<double, 2> in_disk(const std::array<double, 2>& u) {
  const double r = sqrt(u[0]), phi = 2 * kPi * u[1];
  return {r * cos(phi), r * sin(phi)};
}

/// A cosine-weighted sample about n, with pdf cos(theta) / pi.
Vector about(const Vector& n, const std::array<double, 2>& u) {
  const auto [x, y] = in_disk(u);
  Vector a, b;
  basis(n, a, b);
  return normalize(a * x + b * y + n * sqrt(std::max(1 - u[0], 0.0)));
}

double area(const Light& light) {
  return 4 * length(light.u) * length(light.v) * (light.kind == Light::Kind::Disk ? kPi / 4 : 1);
}

}  // namespace

Emitter::Emitter(const Scene& scene, const Sphere& bounds) : scene_(scene), bounds_(bounds) {
  const double cross_section = kPi * sqr(bounds.radius);
  for (const Light& light : scene.lights) {
    double power = 0;
    switch (light.kind) {
      case Light::Kind::Sun:
        power = light.radius > 0 ? luminance(light.radiance) * kPi * sqr(light.radius) * cross_section
                                 : luminance(light.intensity) * cross_section;
        break;
      case Light::Kind::Point:
        power = light.radius > 0 ? luminance(light.radiance) * 4 * sqr(kPi * light.radius)
                                 : luminance(light.intensity) * 4 * kPi;
        break;
      default:
        power = luminance(light.radiance) * kPi * area(light);
    }
    chances_.push_back(power);
  }
  const Environment& e = scene.environment;
  double mean = luminance(e.color);
  if (e.image) {
    image_ = std::make_unique<EnvironmentSampler>(e);
    mean = image_->mean();
  }
  chances_.push_back(mean * 4 * kPi * cross_section);
  const double sum = std::accumulate(chances_.begin(), chances_.end(), 0.0);
  if (sum > 0)
    for (double& c : chances_) c /= sum;
  else
    chances_.clear();
  ends_.resize(chances_.size());
  std::partial_sum(chances_.begin(), chances_.end(), ends_.begin());
}

EmittedRay Emitter::from_far(const Vector& direction, const Color& radiance, double pdf,
                             const std::array<double, 2>& disk) const {
  const auto [x, y] = in_disk(disk);
  Vector a, b;
  basis(direction, a, b);
  const Vector origin = bounds_.centre + (a * x + b * y - direction) * bounds_.radius;
  return {origin, direction, radiance * (kPi * sqr(bounds_.radius) / pdf)};
}

EmittedRay Emitter::emit(double choice, const std::array<double, 3>& where, const std::array<double, 2>& way) const {
  const auto end = std::upper_bound(ends_.begin(), ends_.end() - 1, choice);
  const std::size_t i = std::size_t(end - ends_.begin());
  if (!(chances_[i] > 0)) return {};  // rounding: the last lamp may have probability 0
  const double chance = chances_[i];
  const std::array<double, 2> place{where[0], where[1]};
  if (i == scene_.lights.size()) {
    if (!image_)
      return from_far(sample_cone({0, 0, 1}, 2, way[0], way[1]), scene_.environment.color, chance / (4 * kPi), place);
    const EnvironmentSampler::Choice from = image_->choose(where[2], way[0], way[1]);
    if (!(from.pdf > 0)) return {};
    return from_far(-from.direction(), scene_.environment.radiance(from.u, from.v()), from.pdf * chance, place);
  }
  const Light& light = scene_.lights[i];
  switch (light.kind) {
    case Light::Kind::Sun: {
      if (light.radius == 0) return from_far(light.direction, light.intensity, chance, place);
      const double h = one_minus_cos_from_sin2(sqr(light.radius));
      return from_far(sample_cone(light.direction, h, way[0], way[1]), light.radiance, chance / (2 * kPi * h), place);
    }
    case Light::Kind::Point: {
      const Vector out = sample_cone({0, 0, 1}, 2, place[0], place[1]);  // uniform on the sphere
      if (light.radius == 0) return {light.position, out, light.intensity * (4 * kPi / chance)};
      return {light.position + out * light.radius, about(out, way),
              light.radiance * (4 * sqr(kPi * light.radius) / chance)};
    }
    default: {
      std::array<double, 2> on{2 * place[0] - 1, 2 * place[1] - 1};
      if (light.kind == Light::Kind::Disk) on = in_disk(place);
      return {light.position + light.u * on[0] + light.v * on[1], about(light.direction, way),
              light.radiance * (kPi * area(light) / chance)};
    }
  }
}

}  // namespace brdfc::reference
