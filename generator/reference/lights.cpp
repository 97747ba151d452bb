// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/lights.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "reference/cone.h"
#include "reference/procedural.h"

namespace brdfc::reference {

namespace {

using Vector = Vec3<double>;

/// Colours outside the working space's gamut have negative components, which need samples as well.
Rgb<double> magnitude(const Rgb<double>& c) { return {std::abs(c.r), std::abs(c.g), std::abs(c.b)}; }

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
      // The integral of the bilinear reconstruction over a texel: weights (1, 6, 1) / 8 in each direction.
      double sum = 0;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
          sum += (i == 0 ? 0.75 : 0.125) * (j == 0 ? 0.75 : 0.125) *
                 luminance(magnitude(image.color((x + i + width_) % width_, std::clamp(y + j, 0, height_ - 1))));
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
  // Vose's alias method: selects a cell in constant time.
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

EnvironmentSampler::Choice EnvironmentSampler::choose(double u1, double u2, double u3) const {
  if (cells_.empty()) return {};
  const unsigned cell = this->cell(u1);
  const int x = int(cell % unsigned(width_)), y = int(cell / unsigned(width_));
  const double top = y == 0 ? 1.0 : z_[y - 1];
  return {(x + u2) / width_, top + (z_[y] - top) * u3, cells_[cell].density};
}

std::size_t EnvironmentSampler::cell_at(double u, double v) const {
  const int x = std::clamp(int(u * width_), 0, width_ - 1), y = std::clamp(int((1 - v) * height_), 0, height_ - 1);
  return std::size_t(y) * width_ + x;
}

double EnvironmentSampler::pdf(double u, double v) const { return cells_.empty() ? 0 : cells_[cell_at(u, v)].density; }

void EnvironmentSampler::fetch_texels(int x, int y) const {
  // Bilinear interpolation needs this row and one of its neighbours.
  for (int row = std::max(y - 1, 0); row <= std::min(y + 1, height_ - 1); ++row)
    __builtin_prefetch(image_.pixel(x, row));
}

void EnvironmentSampler::fetch(double u, double v) const {
  const std::size_t cell = cell_at(u, v);
  if (!cells_.empty()) __builtin_prefetch(&cells_[cell]);
  fetch_texels(int(cell % unsigned(width_)), int(cell / unsigned(width_)));
}

void EnvironmentSampler::fetch_cell(double u1) const {
  const unsigned cell = this->cell(u1);
  __builtin_prefetch(&cells_[cell]);
  fetch_texels(int(cell % unsigned(width_)), int(cell / unsigned(width_)));
}

Lights::Lights(const Scene& scene, bool sample_constant, std::size_t most_weighed)
    : scene_(scene), count_(scene.lights.size()) {
  for (const Light& light : scene.lights) {
    Lamp l{light.position, light.direction, light.u, light.v, light.radius, light.radiance};
    if (light.kind == Light::Kind::Rectangle || light.kind == Light::Kind::Disk) {
      l.area = 4 * length(light.u) * length(light.v) * (light.kind == Light::Kind::Disk ? kPi / 4 : 1);
      l.luminance = luminance(light.radiance) * l.area;
      l.per_u2 = 1 / dot(light.u, light.u);
      l.per_v2 = 1 / dot(light.v, light.v);
    } else {
      l.luminance = luminance(light.intensity);
      l.delta = light.radius == 0;
      if (l.delta) l.shine = light.intensity;
      l.one_minus_cos = one_minus_cos_from_sin2(sqr(light.radius));
      l.cone_pdf = 1 / (2 * kPi * l.one_minus_cos);
    }
    lamps_.push_back(l);
    camera_sees_ |= light.camera_visible;
  }
  if (lamps_.size() > most_weighed) {
    std::vector<LampBounds> bounds;
    for (std::size_t i = 0; i < lamps_.size(); ++i) bounds.push_back(bounds_of(scene.lights[i], lamps_[i]));
    tree_.emplace(bounds);
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

BRDFC_VECTORISED void Lights::places(const Vectors& direction, const Numbers& distance, std::size_t count, Numbers& u,
                                     Numbers& v) const {
  if (std::none_of(distance.begin(), distance.begin() + count, [](double d) { return d == kInfinity; })) return;
  for_lanes(count, [&](std::size_t k) { direction_to_equirectangular(direction[k], u[k], v[k]); });
  for (std::size_t k = 0; k < count; ++k)
    if (distance[k] == kInfinity) image_->fetch(u[k], v[k]);
}

Rgb<double> Lights::environment(const Vector& direction, double u, double v, const Vector& normal, double* pdf) const {
  const Environment& e = scene_.environment;
  if (!e.image) {
    if (pdf) *pdf = dot(direction, normal) > 0 ? 1 / (2 * kPi) : 0.0;
    return e.color;
  }
  if (pdf) *pdf = image_->pdf(u, v);
  return e.radiance(u, v);
}

template <class Body> void Lights::of_kind(Light::Kind kind, const Body& body) {
  using Kind = Light::Kind;
  switch (kind) {
    case Kind::Sun:
      return body(std::integral_constant<Kind, Kind::Sun>());
    case Kind::Point:
      return body(std::integral_constant<Kind, Kind::Point>());
    case Kind::Rectangle:
      return body(std::integral_constant<Kind, Kind::Rectangle>());
    case Kind::Disk:
      return body(std::integral_constant<Kind, Kind::Disk>());
  }
}

template <Light::Kind kKind> inline double Lights::weight(const Lamp& lamp, const Vector& p, const Vector& normal) {
  if constexpr (kKind == Light::Kind::Sun) {
    // The highest point of the sun's disk decides whether it is above the horizon.
    return dot(-lamp.direction, normal) > -lamp.radius ? lamp.luminance : 0.0;
  } else {
    const Vector d = lamp.position - p;
    const double height = dot(d, normal), distance2 = dot(d, d);
    if constexpr (kKind == Light::Kind::Point) {
      return height > -lamp.radius ? lamp.luminance / maximum(distance2, sqr(lamp.radius)) : 0.0;
    } else {
      const double extent = abs(dot(lamp.u, normal)) + abs(dot(lamp.v, normal));
      const bool shows = (height > -extent) & (dot(d, lamp.direction) < 0);
      return shows ? lamp.luminance / maximum(distance2, lamp.area * kInvPi) : 0.0;
    }
  }
}

template <Light::Kind kKind>
inline Lights::Sample Lights::sample_light(const Lamp& lamp, const Vector& p, double u1, double u2) {
  Sample s;
  if constexpr (kKind == Light::Kind::Sun) {
    if (lamp.delta) {
      s.wi = -lamp.direction;
      s.pdf = 1;
    } else {
      s.wi = sample_cone(-lamp.direction, lamp.one_minus_cos, u1, u2);
      s.pdf = lamp.cone_pdf;
    }
  } else if constexpr (kKind == Light::Kind::Point) {
    const Vector d = lamp.position - p;
    const double distance2 = dot(d, d), distance = sqrt(distance2), r2 = sqr(lamp.radius);
    if (lamp.delta) {
      s.wi = d * (1 / distance);
      s.distance = distance;
      s.brightness = 1 / distance2;
      s.pdf = distance > 0 ? 1 : 0;
    } else if (distance2 > r2) {
      const double h = one_minus_cos_from_sin2(r2 / distance2);
      s.wi = sample_cone(d * (1 / distance), h, u1, u2);
      s.pdf = 1 / (2 * kPi * h);
      const double along = dot(d, s.wi), across2 = std::max(distance2 - along * along, 0.0);
      s.distance = along - sqrt(std::max(r2 - across2, 0.0));
    } else {
      s.wi = sample_cone({0, 0, 1}, 2, u1, u2);
      s.pdf = 1 / (4 * kPi);
      const double along = dot(d, s.wi);
      s.distance = along + sqrt(std::max(along * along - distance2 + r2, 0.0));
    }
  } else {
    double a = 2 * u1 - 1, b = 2 * u2 - 1;
    if constexpr (kKind == Light::Kind::Disk) {
      const double r = sqrt(u1), phi = 2 * kPi * u2;
      a = r * cos(phi);
      b = r * sin(phi);
    }
    const Vector d = lamp.position + lamp.u * a + lamp.v * b - p;
    const double distance2 = dot(d, d);
    s.distance = sqrt(distance2);
    s.wi = d * (1 / s.distance);
    const double cosine = -dot(s.wi, lamp.direction);
    s.pdf = cosine > 0 ? distance2 / (cosine * lamp.area) : 0;  // false for NaN
  }
  return s;
}

template <Light::Kind kKind>
inline double Lights::pdf_of_hit(const Lamp& lamp, const Vector& p, const Vector& w, double distance) {
  if constexpr (kKind == Light::Kind::Sun) {
    const Vector off = w + lamp.direction;  // |off|^2 = 2 (1 - cos)
    const bool meets = (distance == kInfinity) & (dot(off, off) <= 2 * lamp.one_minus_cos);
    return meets ? lamp.cone_pdf : 0;
  } else if constexpr (kKind == Light::Kind::Point) {
    const Vector d = lamp.position - p;
    const double along = dot(d, w), r2 = sqr(lamp.radius), distance2 = dot(d, d);
    const Vector across = d - w * along;
    const double half2 = r2 - dot(across, across), half = sqrt(maximum(half2, 0.0));
    const bool outside = distance2 > r2, meets = (half2 >= 0) & ((outside ? along - half : along + half) < distance);
    const double pdf = outside ? 1 / (2 * kPi * one_minus_cos_from_sin2(r2 / distance2)) : 1 / (4 * kPi);
    return meets & ((along > 0) | !outside) ? pdf : 0;
  } else {
    const double cosine = -dot(w, lamp.direction);
    const Vector d = lamp.position - p;
    const double t = -dot(d, lamp.direction) / cosine;
    const Vector q = w * t - d;
    const double a = dot(q, lamp.u) * lamp.per_u2, b = dot(q, lamp.v) * lamp.per_v2;
    const bool inside = kKind == Light::Kind::Disk ? a * a + b * b <= 1 : maximum(abs(a), abs(b)) <= 1;
    // In front of the lamp dot(d, direction) < 0, so t > 0 there.
    const bool meets = (cosine > 0) & (t > 0) & (t < distance) & inside;
    return meets ? t * t / (cosine * lamp.area) : 0;
  }
}

BRDFC_VECTORISED void Lights::chances(const Vectors& p, const Vectors& normal, std::size_t count,
                                      const Lanes<double*>& chance, Lanes<bool>& lit) const {
  if (tree_) return weigh_in_tree(p, normal, count, chance, lit);
  Numbers sum, mine;
  sum.fill(sampled_environment_ ? environment_weight_ : 0);
  for (std::size_t i = 0; i < lamps_.size(); ++i) {
    const Lamp lamp = lamps_[i];
    of_kind(scene_.lights[i].kind, [&](auto kind) {
      for_lanes(count, [&](std::size_t k) {
        mine[k] = weight<kind>(lamp, p[k], normal[k]);
        sum[k] += mine[k];
      });
    });
    for (std::size_t k = 0; k < count; ++k) chance[k][i] = mine[k];
  }
  for (std::size_t k = 0; k < count; ++k) {
    lit[k] = sum[k] > 0;
    if (!lit[k]) continue;
    if (sampled_environment_) chance[k][count_ - 1] = environment_weight_;
    if (count_ == 1)
      chance[k][0] = 1;
    else
      for (std::size_t i = 0; i < count_; ++i) chance[k][i] /= sum[k];
  }
}

BRDFC_VECTORISED void Lights::sample(const Vectors& p, const Vectors& normal, std::size_t count,
                                     const Lanes<double*>& chance, const Lanes<bool>& lit, const LightNumbers& u,
                                     LightSamples& out) const {
  Lanes<std::size_t> chosen{};
  Numbers chance_of_chosen;
  if (tree_)
    choose_in_tree(count, chance, lit, u.choice, chosen, chance_of_chosen);
  else if (choose())
    for (std::size_t k = 0; k < count; ++k) {
      if (!lit[k]) continue;
      double choice = u.choice[k];
      std::size_t& i = chosen[k];
      while (i + 1 < count_ && choice >= chance[k][i]) choice -= chance[k][i++];
    }
  const std::size_t lamps = lamps_.size();
  Lanes<bool> in_image{};
  Numbers image_u{}, image_z{};
  for (std::size_t begin = 0, end; begin < count; begin = end) {
    const std::size_t i = chosen[begin];
    end = begin + 1;
    while (end < count && chosen[end] == i) ++end;
    std::fill(out.delta.begin() + begin, out.delta.begin() + end, i < lamps && lamps_[i].delta);
    if (i < lamps) {
      const Lamp lamp = lamps_[i];
      of_kind(scene_.lights[i].kind, [&](auto kind) {
        for_lanes(begin, end == count ? lanes_for(count) : end, [&](std::size_t k) {
          const Sample s = sample_light<kind>(lamp, p[k], u.u1[k], u.u2[k]);
          out.wi.set(k, s.wi);
          out.distance[k] = s.distance;
          out.radiance.set(k, lamp.shine * s.brightness);
          out.pdf[k] = s.pdf;
        });
      });
    } else {
      for (std::size_t k = begin; k < end; ++k) {
        out.distance[k] = kInfinity;
        if (!lit[k]) continue;
        if (image_) {
          const auto [x, z, pdf] = image_->choose(u.u1[k], u.u2[k], u.u3[k]);
          in_image[k] = true;
          image_u[k] = x, image_z[k] = z, out.pdf[k] = pdf;
        } else {
          out.wi.set(k, sample_cone(normal[k], 1, u.u1[k], u.u2[k]));
          out.radiance.set(k, scene_.environment.color);
          out.pdf[k] = 1 / (2 * kPi);
        }
      }
    }
  }
  if (std::find(in_image.begin(), in_image.end(), true) != in_image.end()) {
    Vectors wi;
    Numbers image_v;
    for_lanes(count, [&](std::size_t k) {
      const EnvironmentSampler::Choice choice{image_u[k], image_z[k]};
      wi.set(k, choice.direction());
      image_v[k] = choice.v();
    });
    for (std::size_t k = 0; k < count; ++k)
      if (in_image[k]) {
        out.wi.set(k, wi[k]);
        out.radiance.set(k, scene_.environment.radiance(image_u[k], image_v[k]));
      }
  }
  // Because of rounding, the last light may be selected although its probability is 0.
  for (std::size_t k = 0; k < count; ++k)
    out.pdf[k] = lit[k] ? out.pdf[k] * (tree_ ? chance_of_chosen[k] : chance[k][chosen[k]]) : 0;
}

LampBounds Lights::bounds_of(const Light& light, const Lamp& lamp) {
  LampBounds b;
  b.power = lamp.luminance;
  b.can_be_met = !lamp.delta;
  switch (light.kind) {
    case Light::Kind::Sun:
      b.far = true;
      b.centre = -light.direction;
      b.radius = sqrt(2 * lamp.one_minus_cos);  // the longest chord from its centre
      break;
    case Light::Kind::Point:
      b.centre = light.position;
      b.radius = light.radius;
      break;
    default:
      b.centre = light.position;
      b.radius = light.kind == Light::Kind::Disk ? std::max(length(light.u), length(light.v))
                                                 : sqrt(dot(light.u, light.u) + dot(light.v, light.v));
      b.direction = light.direction;
      b.cos_cone = 1;
  }
  return b;
}

BRDFC_VECTORISED void Lights::weigh_in_tree(const Vectors& p, const Vectors& normal, std::size_t count,
                                            const Lanes<double*>& kept, Lanes<bool>& lit) const {
  const LightTree& tree = *tree_;
  const double environment = sampled_environment_ ? environment_weight_ : 0;
  for (std::size_t k = 0; k < count; ++k) {
    double* const to = kept[k];
    to[kPoint] = p.x[k], to[kPoint + 1] = p.y[k], to[kPoint + 2] = p.z[k];
    to[kNormal] = normal.x[k], to[kNormal + 1] = normal.y[k], to[kNormal + 2] = normal.z[k];
    const double sum = environment + tree.weigh_root(p[k], normal[k], to + kRoot);
    lit[k] = sum > 0;
    to[kEnvironment] = lit[k] ? environment / sum : 0;
  }
}

BRDFC_VECTORISED void Lights::choose_in_tree(std::size_t count, const Lanes<double*>& kept, const Lanes<bool>& lit,
                                             const Numbers& choice, Lanes<std::size_t>& chosen, Numbers& chance) const {
  const LightTree& tree = *tree_;
  for (std::size_t k = 0; k < count; ++k) {
    if (!lit[k]) continue;
    const double* const from = kept[k];
    const double of_environment = from[kEnvironment];
    if (choice[k] < of_environment) {
      chosen[k] = scene_.lights.size();
      chance[k] = of_environment;
      continue;
    }
    const double rest = 1 - of_environment;
    const LightTree::Choice lamp = tree.choose(vector_at(from + kPoint), vector_at(from + kNormal), from + kRoot,
                                               (choice[k] - of_environment) / rest);
    chosen[k] = lamp.lamp;
    chance[k] = lamp.chance * rest;
  }
}

BRDFC_VECTORISED void Lights::meet_in_tree(const Rays& rays, const Numbers& distance, std::size_t count,
                                           std::vector<std::size_t>& lamps, Lanes<std::size_t>& ends) const {
  const LightTree& tree = *tree_;
  for (std::size_t k = 0; k < count; ++k) {
    tree.meet(rays.origin[k], rays.direction[k], distance[k], lamps);
    ends[k] = lamps.size();
  }
}

BRDFC_VECTORISED double Lights::chance(std::size_t i, const double* kept) const {
  if (!tree_) return kept[i];
  if (i == lamps_.size()) return kept[kEnvironment];
  return (1 - kept[kEnvironment]) * tree_->chance(i, vector_at(kept + kPoint), vector_at(kept + kNormal), kept + kRoot);
}

double Lights::pdf_of_hit(std::size_t i, const Vector& p, const Vector& direction, double distance) const {
  if (lamps_[i].delta) return 0;
  double pdf = 0;
  of_kind(scene_.lights[i].kind, [&](auto kind) { pdf = pdf_of_hit<kind>(lamps_[i], p, direction, distance); });
  return pdf;
}

BRDFC_VECTORISED void Lights::pdfs_of_hit(std::size_t i, const Rays& rays, const Numbers& distance, std::size_t count,
                                          Numbers& pdf) const {
  const Lamp lamp = lamps_[i];
  if (lamp.delta) return pdf.fill(0);
  of_kind(scene_.lights[i].kind, [&](auto kind) {
    for_lanes(count,
              [&](std::size_t k) { pdf[k] = pdf_of_hit<kind>(lamp, rays.origin[k], rays.direction[k], distance[k]); });
  });
}

}  // namespace brdfc::reference
