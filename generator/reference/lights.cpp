// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/lights.h"

#include <algorithm>
#include <cmath>

#include "reference/cone.h"
#include "reference/procedural.h"

namespace brdfc::reference {

namespace {

using Vector = Vec3<double>;

}  // namespace

EnvironmentSampler::EnvironmentSampler(const Environment& environment) : image_(*environment.image) {
  const Image& image = image_;
  width_ = image.width;
  height_ = image.height;
  const std::size_t cells = std::size_t(width_) * height_;
  z_.resize(height_);
  for (int y = 0; y < height_; ++y) z_[y] = y + 1 == height_ ? -1.0 : sin(kPi * (0.5 - double(y + 1) / height_));

  std::vector<double> weight(cells);
  double total = 0;
  for (int y = 0; y < height_; ++y) {
    const double solid_angle = ((y == 0 ? 1.0 : z_[y - 1]) - z_[y]) * 2 * kPi / width_;
    for (int x = 0; x < width_; ++x) {
      // The integral of the bilinear reconstruction over a texel: (1, 6, 1) / 8 in each direction.
      double sum = 0;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
          sum += (i == 0 ? 0.75 : 0.125) * (j == 0 ? 0.75 : 0.125) *
                 luminance(image.color((x + i + width_) % width_, std::clamp(y + j, 0, height_ - 1)));
      weight[std::size_t(y) * width_ + x] = sum * solid_angle;
      total += sum * solid_angle;
    }
  }
  mean_ = total * environment.strength / (4 * kPi);
  if (!(total > 0)) return;

  cells_.resize(cells);
  for (int y = 0; y < height_; ++y) {
    const double solid_angle = ((y == 0 ? 1.0 : z_[y - 1]) - z_[y]) * 2 * kPi / width_;
    for (int x = 0; x < width_; ++x) {
      const std::size_t i = std::size_t(y) * width_ + x;
      cells_[i].density = weight[i] / total / solid_angle;
    }
  }
  // Vose's alias table: a cell in constant time.
  std::vector<int> small, large;
  for (std::size_t i = 0; i < cells; ++i) {
    weight[i] *= double(cells) / total;
    (weight[i] < 1 ? small : large).push_back(int(i));
  }
  while (!small.empty() && !large.empty()) {
    const int s = small.back(), l = large.back();
    small.pop_back();
    cells_[s].keep = float(weight[s]);
    cells_[s].other = l;
    weight[l] -= 1 - weight[s];
    if (weight[l] < 1) {
      large.pop_back();
      small.push_back(l);
    }
  }
  for (const auto& rest : {small, large})
    for (const int i : rest) cells_[i].keep = 1;
}

Vec3<double> EnvironmentSampler::sample(double u1, double u2, double u3, double& pdf, double& u, double& v) const {
  pdf = u = v = 0;
  if (cells_.empty()) return {0, 0, 1};
  const unsigned cell = this->cell(u1);
  const int x = int(cell % unsigned(width_)), y = int(cell / unsigned(width_));
  const double top = y == 0 ? 1.0 : z_[y - 1];
  const double z = top + (z_[y] - top) * u3;
  u = (x + u2) / width_;
  v = asin(z) / kPi + 0.5;
  const double phi = kPi * (1 - 2 * u), s = sqrt(std::max(1 - z * z, 0.0));
  pdf = cells_[cell].density;
  return {s * cos(phi), s * sin(phi), z};
}

std::size_t EnvironmentSampler::cell_at(double u, double v) const {
  const int x = std::clamp(int(u * width_), 0, width_ - 1), y = std::clamp(int((1 - v) * height_), 0, height_ - 1);
  return std::size_t(y) * width_ + x;
}

double EnvironmentSampler::pdf(double u, double v) const { return cells_.empty() ? 0 : cells_[cell_at(u, v)].density; }

void EnvironmentSampler::fetch(double u, double v) const {
  const std::size_t cell = cell_at(u, v);
  if (!cells_.empty()) __builtin_prefetch(&cells_[cell]);
  __builtin_prefetch(&image_.rgb[3 * cell]);
}

void EnvironmentSampler::fetch_cell(double u1) const {
  const unsigned cell = this->cell(u1);
  __builtin_prefetch(&cells_[cell]);
  // The colour is between this row and one of its neighbours.
  const int x = int(cell % unsigned(width_)), y = int(cell / unsigned(width_));
  for (int row = std::max(y - 1, 0); row <= std::min(y + 1, height_ - 1); ++row)
    __builtin_prefetch(image_.pixel(x, row));
}

Lights::Lights(const Scene& scene, bool sample_constant) : scene_(scene), count_(scene.lights.size()) {
  for (const Light& light : scene.lights) {
    Known k;
    k.luminance = luminance(light.intensity);
    if (light.kind == Light::Kind::Rectangle || light.kind == Light::Kind::Disk) {
      k.area = 4 * length(light.u) * length(light.v) * (light.kind == Light::Kind::Disk ? kPi / 4 : 1);
      k.luminance = luminance(light.radiance) * k.area;
      k.per_u2 = 1 / dot(light.u, light.u);
      k.per_v2 = 1 / dot(light.v, light.v);
    } else if (light.kind == Light::Kind::Sun && light.radius > 0) {
      k.one_minus_cos = one_minus_cos_from_sin2(sqr(light.radius));
      k.cone_pdf = 1 / (2 * kPi * k.one_minus_cos);
    }
    known_.push_back(k);
  }
  const Environment& e = scene.environment;
  if (e.image) {
    image_ = std::make_unique<EnvironmentSampler>(e);
    sampled_environment_ = image_->mean() > 0;
    environment_weight_ = kPi * image_->mean();
  } else if (sample_constant) {
    environment_weight_ = kPi * luminance(e.color);
    sampled_environment_ = environment_weight_ > 0;
  }
  if (sampled_environment_) ++count_;
}

std::array<double, 2> Lights::place(const Vector& direction) const {
  if (!image_) return {};
  double u, v;
  direction_to_equirectangular(direction, u, v);
  image_->fetch(u, v);
  return {u, v};
}

Rgb<double> Lights::environment(const Vector& direction, const std::array<double, 2>& place, const Vector& normal,
                                double* pdf) const {
  const Environment& e = scene_.environment;
  if (!e.image) {
    if (pdf) *pdf = dot(direction, normal) > 0 ? 1 / (2 * kPi) : 0.0;
    return e.color;
  }
  if (pdf) *pdf = image_->pdf(place[0], place[1]);
  return e.radiance(place[0], place[1]);
}

double Lights::weight(std::size_t i, const Vector& p, const Vector& normal) const {
  const Light& light = scene_.lights[i];
  const Known& known = known_[i];
  if (light.kind == Light::Kind::Sun) {
    // Of the disk of the sun the highest point counts.
    return dot(-light.direction, normal) > -light.radius ? known.luminance : 0.0;
  }
  const Vector d = light.position - p;
  const double height = dot(d, normal), distance2 = dot(d, d);
  if (light.kind == Light::Kind::Point)
    return height > -light.radius ? known.luminance / std::max(distance2, sqr(light.radius)) : 0.0;
  const double extent = abs(dot(light.u, normal)) + abs(dot(light.v, normal));
  if (height <= -extent || dot(d, light.direction) >= 0) return 0;
  return known.luminance / std::max(distance2, known.area * kInvPi);
}

bool Lights::chances(const Vector& p, const Vector& normal, std::span<double> chance) const {
  double sum = 0;
  for (std::size_t i = 0; i < scene_.lights.size(); ++i) sum += chance[i] = weight(i, p, normal);
  if (sampled_environment_) sum += chance.back() = environment_weight_;
  if (!(sum > 0)) return false;
  if (count_ == 1)
    chance[0] = 1;
  else
    for (double& c : chance) c /= sum;
  return true;
}

LightSample Lights::sample(const Vector& p, const Vector& normal, std::span<const double> chance, double choice,
                           double u1, double u2, double u3) const {
  std::size_t i = 0;
  while (i + 1 < chance.size() && choice >= chance[i]) choice -= chance[i++];
  if (!(chance[i] > 0)) return {};  // rounding: the last light may have no chance
  LightSample s;
  if (i < scene_.lights.size()) {
    s = sample_light(i, p, u1, u2);
  } else if (image_) {
    double u, v;
    s.wi = image_->sample(u1, u2, u3, s.pdf, u, v);
    s.radiance = scene_.environment.radiance(u, v);
  } else {
    s.wi = sample_cone(normal, 1, u1, u2);
    s.pdf = 1 / (2 * kPi);
    s.radiance = scene_.environment.color;
  }
  s.pdf *= chance[i];
  return s;
}

LightSample Lights::sample_light(std::size_t i, const Vector& p, double u1, double u2) const {
  const Light& light = scene_.lights[i];
  const Known& known = known_[i];
  LightSample s;
  s.radiance = light.radiance;
  switch (light.kind) {
    case Light::Kind::Sun: {
      if (light.radius == 0) {
        s.wi = -light.direction;
        s.radiance = light.intensity;
        s.pdf = 1;
        s.delta = true;
        return s;
      }
      s.wi = sample_cone(-light.direction, known.one_minus_cos, u1, u2);
      s.pdf = known.cone_pdf;
      return s;
    }
    case Light::Kind::Point: {
      const Vector d = light.position - p;
      const double distance2 = dot(d, d), distance = sqrt(distance2);
      if (light.radius == 0) {
        if (!(distance > 0)) return {};
        s.wi = d / distance;
        s.distance = distance;
        s.radiance = light.intensity / distance2;
        s.pdf = 1;
        s.delta = true;
        return s;
      }
      const double r2 = sqr(light.radius);
      if (distance2 > r2) {
        const double h = one_minus_cos_from_sin2(r2 / distance2);
        s.wi = sample_cone(d / distance, h, u1, u2);
        s.pdf = 1 / (2 * kPi * h);
        const double along = dot(d, s.wi), across2 = std::max(distance2 - along * along, 0.0);
        s.distance = along - sqrt(std::max(r2 - across2, 0.0));
      } else {
        s.wi = sample_cone({0, 0, 1}, 2, u1, u2);
        s.pdf = 1 / (4 * kPi);
        const double along = dot(d, s.wi);
        s.distance = along + sqrt(std::max(along * along - distance2 + r2, 0.0));
      }
      return s;
    }
    default: {
      double a = 2 * u1 - 1, b = 2 * u2 - 1;
      if (light.kind == Light::Kind::Disk) {
        const double r = sqrt(u1), phi = 2 * kPi * u2;
        a = r * cos(phi);
        b = r * sin(phi);
      }
      const Vector d = light.position + light.u * a + light.v * b - p;
      const double distance2 = dot(d, d);
      s.distance = sqrt(distance2);
      if (!(s.distance > 0)) return {};
      s.wi = d / s.distance;
      const double cosine = -dot(s.wi, light.direction);
      if (!(cosine > 0)) return {};
      s.pdf = distance2 / (cosine * known.area);
      return s;
    }
  }
}

double Lights::pdf_of_hit(std::size_t i, const Vector& p, const Vector& w, double distance) const {
  const Light& light = scene_.lights[i];
  const Known& known = known_[i];
  switch (light.kind) {
    case Light::Kind::Sun: {
      if (light.radius == 0 || distance < kInfinity) return 0;
      const Vector off = w + light.direction;  // |off|^2 = 2 (1 - cos)
      return dot(off, off) <= 2 * known.one_minus_cos ? known.cone_pdf : 0.0;
    }
    case Light::Kind::Point: {
      if (light.radius == 0) return 0;
      const Vector d = light.position - p;
      const double along = dot(d, w), r2 = sqr(light.radius), distance2 = dot(d, d);
      const Vector across = d - w * along;
      const double half2 = r2 - dot(across, across);
      if (half2 < 0) return 0;
      if (distance2 > r2)
        return along > 0 && along - sqrt(half2) < distance ? 1 / (2 * kPi * one_minus_cos_from_sin2(r2 / distance2))
                                                           : 0.0;
      return along + sqrt(half2) < distance ? 1 / (4 * kPi) : 0.0;
    }
    default: {
      const double cosine = -dot(w, light.direction);
      if (!(cosine > 0)) return 0;
      const Vector d = light.position - p;
      const double t = -dot(d, light.direction) / cosine;
      // dot(d, direction) < 0 in front of the lamp, so t > 0 there.
      if (!(t > 0 && t < distance)) return 0;
      const Vector q = w * t - d;
      const double a = dot(q, light.u) * known.per_u2, b = dot(q, light.v) * known.per_v2;
      if (light.kind == Light::Kind::Disk ? a * a + b * b > 1 : abs(a) > 1 || abs(b) > 1) return 0;
      return t * t / (cosine * known.area);
    }
  }
}

}  // namespace brdfc::reference
