// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/path_tracer.h"

#include <algorithm>
#include <cmath>

#include "model/horizon.h"
#include "model/sampling.h"
#include "reference/cone.h"
#include "reference/film.h"

namespace brdfc::reference {
namespace {

using Vector = Vec3<double>;
using Color = Rgb<double>;

/// Sample dimensions of a bounce: the term (delta or lobe), the lobe, its direction, Russian roulette; and for each
/// side of the surface three for light samples: the light, the place on it, and one more for an environment image.
constexpr std::uint64_t kDimensions = 10;
constexpr std::uint64_t dimension_of(int bounce) { return 1 + kDimensions * std::uint64_t(bounce); }
constexpr std::uint64_t light_dimension(int bounce, bool far) {
  return dimension_of(bounce) + 4 + 3 * std::uint64_t(far);
}

}  // namespace

PathTracer::PathTracer(const Scene& scene, const RenderOptions& options)
    : scene_(scene),
      settings_(options.settings),
      strategy_(options.settings.strategy),
      points_(options.settings.pattern, options.settings.spp),
      tracer_(scene, options.most_copies),
      lights_(scene, strategy_ == Strategy::Light, options.most_weighed) {
  surfaces_.reserve(scene.materials.size());
  for (const Material& m : scene.materials) surfaces_.emplace_back(m);
}

PathTracer::Wave PathTracer::make_wave() const { return Wave(surfaces_); }

void PathTracer::follow(std::span<const Start> starts, Wave& wave, std::span<Color> light) const {
  wave.paths.clear();
  wave.paths.reserve(starts.size());
  wave.active.clear();
  wave.rays.clear();
  wave.chances.resize(2 * lights_.kept() * starts.size());
  Block& b = *wave.block;
  for (std::size_t from = 0; from < starts.size(); from += kBlock) {
    b.count = std::min(kBlock, starts.size() - from);
    for (std::size_t k = 0; k < b.count; ++k) {
      const auto& [x, y, sample] = starts[from + k];
      b.paths[k] = &wave.paths.emplace_back(
          PathSampler(points_, std::uint64_t(settings_.seed), std::uint64_t(y) * settings_.width + x, sample));
      b.keys[k] = b.paths[k]->random.random_key();
    }
    Numbers film_x, film_y;
    draw(b, 0, film_x, film_y);
    for (std::size_t k = 0; k < b.count; ++k) film_x[k] += starts[from + k].x, film_y[k] += starts[from + k].y;
    begin(film_x, film_y, b);
    for (std::size_t k = 0; k < b.count; ++k) {
      wave.active.push_back(b.paths[k]);
      wave.rays.push_back({b.rays.origin[k], b.rays.direction[k]});
    }
  }

  for (int bounce = 0; !wave.active.empty(); ++bounce) {
    wave.meetings.resize(wave.active.size());
    tracer_.intersect(wave.rays, bounce == 0, wave.meetings);
    sort_by_material(wave);
    wave.shadows.clear();
    wave.shadow_rays.clear();
    wave.next.clear();
    wave.next_rays.clear();
    // Prefetches for the first blocks; scatter() does it for later ones.
    if (lights_.choose_more() && bounce <= settings_.max_bounces) {
      const std::size_t first = std::size_t(wave.places[0]);
      for (std::size_t k = 0; k < 2 * kBlock; ++k) fetch(wave, first + k, bounce, &Lights::fetch_slot);
      for (std::size_t k = 0; k < kBlock; ++k) fetch(wave, first + k, bounce, &Lights::fetch_cell);
    }
    for (int material = -1, from = 0; material < int(surfaces_.size()); ++material)
      for (const int end = wave.places[std::size_t(material + 1)]; from < end; from += int(b.count)) {
        gather(from, end, wave);
        if (material < 0)
          b.hits.distance.fill(kInfinity);
        else
          tracer_.at(b.rays, b.meetings, b.count, b.hits);
        collect(b, bounce == 0);
        if (material >= 0 && bounce <= settings_.max_bounces) scatter(material, from, bounce, wave);
      }
    wave.hidden.resize(wave.shadows.size());
    tracer_.occluded(wave.shadow_rays, wave.hidden);
    for (std::size_t i = 0; i < wave.shadows.size(); ++i)
      if (!wave.hidden[i]) wave.shadows[i].path->light += wave.shadows[i].light;
    std::swap(wave.active, wave.next);
    std::swap(wave.rays, wave.next_rays);
  }
  for (std::size_t i = 0; i < starts.size(); ++i) light[i] = wave.paths[i].light;
}

void PathTracer::sort_by_material(Wave& wave) const {
  wave.places.assign(surfaces_.size() + 2, 0);
  for (const Meeting& m : wave.meetings) ++wave.places[std::size_t(tracer_.material(m) + 2)];
  for (std::size_t m = 2; m < wave.places.size(); ++m) wave.places[m] += wave.places[m - 1];
  wave.order.resize(wave.meetings.size());
  for (std::size_t i = 0; i < wave.meetings.size(); ++i)
    wave.order[std::size_t(wave.places[std::size_t(tracer_.material(wave.meetings[i]) + 1)]++)] = int(i);
}

BRDFC_VECTORISED void PathTracer::gather(int from, int end, Wave& wave) const {
  Block& b = *wave.block;
  b.count = std::min(kBlock, std::size_t(end - from));
  // Copies of the last path fill the rest of the vector.
  for (std::size_t k = 0; k < lanes_for(b.count); ++k) {
    const std::size_t i = std::size_t(wave.order[std::size_t(from) + std::min(k, b.count - 1)]);
    const Path& path = *(b.paths[k] = wave.active[i]);
    b.keys[k] = path.random.random_key();
    b.sampled[k] = path.sampled;
    b.normal.set(k, path.normal);
    b.rays.origin.set(k, wave.rays[i].origin);
    b.rays.direction.set(k, wave.rays[i].direction);
    b.meetings[k] = wave.meetings[i];
  }
}

void PathTracer::draw(const Block& b, std::uint64_t dimension, Numbers& out) const {
  if (points_.pattern() == Pattern::Random) return random(b, PathSampler::first(dimension), out);
  for (std::size_t k = 0; k < b.count; ++k) out[k] = b.paths[k]->random.one(dimension);
}

void PathTracer::draw(const Block& b, std::uint64_t dimension, Numbers& first, Numbers& second) const {
  if (points_.pattern() == Pattern::Random) {
    random(b, PathSampler::first(dimension), first);
    random(b, PathSampler::first(dimension) + 1, second);
    return;
  }
  for (std::size_t k = 0; k < b.count; ++k) {
    const auto point = b.paths[k]->random.two(dimension);
    first[k] = point[0], second[k] = point[1];
  }
}

BRDFC_VECTORISED void PathTracer::random(const Block& b, std::uint64_t index, Numbers& out) {
  for_lanes(b.count, [&](std::size_t k) { out[k] = Random::at(b.keys[k], index); });
}

BRDFC_VECTORISED void PathTracer::begin(const Numbers& x, const Numbers& y, Block& b) const {
  const Camera camera = scene_.camera;
  for_lanes(b.count, [&](std::size_t k) {
    Vector origin, direction;
    camera_ray(camera, settings_.width, settings_.height, x[k], y[k], origin, direction);
    b.rays.origin.set(k, origin);
    b.rays.direction.set(k, direction);
  });
}

void PathTracer::collect(const Block& b, bool from_camera) const {
  lights_.meet(b.rays, b.hits.distance, b.count, b.normal, b.sampled, from_camera,
               [&](std::size_t k, const Color& radiance, double light_pdf) {
                 Path& path = *b.paths[k];
                 if (!path.sampled || light_pdf == 0)
                   path.light += path.throughput * radiance;
                 else if (strategy_ != Strategy::Light)
                   path.light += path.throughput * radiance * power_heuristic(path.scattered_pdf, light_pdf);
               });
}

void PathTracer::fetch(const Wave& wave, std::size_t place, int bounce, void (Lights::*what)(double) const) const {
  if (place >= wave.order.size()) return;
  const std::size_t i = std::size_t(wave.order[place]);
  const Surface& surface = surfaces_[std::size_t(tracer_.material(wave.meetings[i]))];
  if (!surface.has_scatter()) return;
  for (int far = 0; far <= int(surface.scatters_through()); ++far)
    (lights_.*what)(wave.active[i]->random.two(light_dimension(bounce, far) + 1)[0]);
}

void PathTracer::scatter(int material, int place, int bounce, Wave& wave) const {
  const Surface& surface = surfaces_[std::size_t(material)];
  Surface::Scratch& scratch = wave.scratch.of(material);
  Block& b = *wave.block;
  const std::uint64_t dimension = dimension_of(bounce);
  if (surface.bends_normals()) bend_normals(b);
  make_frames(surface.has_transmit() || surface.scatters_through(), b);
  for (int far = 0; far < 2; ++far)
    if (surface.has_scatter() && !lights_.empty() && (!far || surface.scatters_through()))
      aim(far, bounce, wave);
    else
      b.sides[std::size_t(far)].lit.fill(false);
  if (surface.has_scatter()) {
    draw(b, dimension + 1, b.lobe);
    draw(b, dimension + 2, b.u, b.v);
  }
  Lanes<bool> on;
  on.fill(true);
  for (std::size_t first = 0; first < b.count; first += kLanes) {
    if (lights_.choose_more())
      for (std::size_t k = first; k < first + kLanes; ++k) {
        fetch(wave, std::size_t(place) + k + 2 * kBlock, bounce, &Lights::fetch_slot);
        fetch(wave, std::size_t(place) + k + kBlock, bounce, &Lights::fetch_cell);
      }
    const auto texture_place = [&](std::size_t k) { return tracer_.texture_place(b.meetings[first + k]); };
    choose(surface, surface.at(texture_place, scratch), first, bounce, wave, on);
  }
  turn_to_world(b);
  for (std::size_t k = 0; k < b.count; ++k) {
    if (!on[k] || !(b.rises[k] > 0)) continue;
    Path& path = *b.paths[k];
    const double brightest = max_component(path.throughput);
    if (!(brightest > 0)) continue;
    if (bounce + 1 >= kRouletteStart && brightest < 1) {
      if (path.random.random(dimension + 3) >= brightest) continue;
      path.throughput = path.throughput * (1 / brightest);
    }
    path.normal = b.normal[k];
    wave.next.push_back(&path);
    wave.next_rays.push_back({b.from[k], b.out[k]});
  }
}

BRDFC_VECTORISED void PathTracer::bend_normals(Block& b) {
  Numbers rise;
  for_lanes(b.count,
            [&](std::size_t k) { rise[k] = mirror_rise(b.hits.geometric[k], -b.rays.direction[k], b.hits.normal[k]); });
  // In most blocks no normal has to be bent.
  if (!std::any_of(rise.begin(), rise.begin() + std::ptrdiff_t(b.count), [](double r) { return r < 0; })) return;
  for_lanes(b.count, [&](std::size_t k) {
    const Vector shading = b.hits.normal[k];
    b.hits.normal.set(k, select(rise[k] < 0, bent_normal(b.hits.geometric[k], -b.rays.direction[k], shading), shading));
  });
}

BRDFC_VECTORISED void PathTracer::make_frames(bool two_sided, Block& b) {
  // Before the loop, which GCC does not turn into vector instructions if it decides this for each lane.
  if (two_sided)
    b.side = b.hits.side;
  else
    b.side.fill(1);
  for_lanes(b.count, [&](std::size_t k) {
    const Vector direction = b.rays.direction[k], normal = b.hits.normal[k];
    const Vector tangent = unit(b.hits.tangent[k] - normal * dot(normal, b.hits.tangent[k]));
    const Vector bitangent = cross(normal, tangent);
    b.hits.tangent.set(k, tangent);
    Vector wo = raise_to_horizon(Vector{-dot(direction, tangent), -dot(direction, bitangent), -dot(direction, normal)});
    wo.z *= b.side[k];
    b.bitangent.set(k, bitangent);
    b.wo.set(k, wo);
  });
}

void PathTracer::aim(bool far, int bounce, Wave& wave) const {
  Block& b = *wave.block;
  Block::Side& side = b.sides[far];
  for (std::size_t k = 0; k < b.count; ++k) {
    side.chances[k] = wave.chances.data() + (2 * std::size_t(b.paths[k] - wave.paths.data()) + far) * lights_.kept();
    side.facing.set(k, b.hits.geometric[k] * (far ? -1.0 : 1.0));
  }
  lights_.chances(b.hits.p, side.facing, b.count, side.chances, side.lit);
  LightNumbers numbers;
  const std::uint64_t dimension = light_dimension(bounce, far);
  if (lights_.choose()) draw(b, dimension, numbers.choice);
  draw(b, dimension + 1, numbers.u1, numbers.u2);
  if (lights_.choose_more()) draw(b, dimension + 2, numbers.u3);
  lights_.sample(b.hits.p, side.facing, b.count, side.chances, side.lit, numbers, side.lights);
  turn_to_lights(far, b);
}

BRDFC_VECTORISED void PathTracer::turn_to_lights(bool far, Block& b) {
  Block::Side& side = b.sides[far];
  const double sign = far ? -1 : 1;
  for_lanes(b.count, [&](std::size_t k) {
    const Vector w = side.lights.wi[k];
    const Vector wi{dot(w, b.hits.tangent[k]), dot(w, b.bitangent[k]), b.side[k] * dot(w, b.hits.normal[k])};
    const double height = dot(w, side.facing[k]), way = sign * wi.z * b.wo.z[k];
    const bool reaches = (height > 0) & (way > 0);
    side.wi.set(k, wi);
    side.from.set(k, Tracer::leave(b.hits.p[k], b.hits.geometric[k], w));
    side.lights.pdf[k] = reaches ? side.lights.pdf[k] : 0;
  });
}

BRDFC_VECTORISED void PathTracer::turn_to_world(Block& b) {
  for_lanes(b.count, [&](std::size_t k) {
    const Vector wi = b.wi[k], geometric = b.hits.geometric[k];
    const Vector out = unit(b.hits.tangent[k] * wi.x + b.bitangent[k] * wi.y + b.hits.normal[k] * (b.side[k] * wi.z));
    const Vector normal = geometric * (wi.z * b.wo.z[k] < 0 ? -1.0 : 1.0);
    b.rises[k] = dot(out, normal);
    b.normal.set(k, normal);
    b.out.set(k, out);
    b.from.set(k, Tracer::leave(b.hits.p[k], geometric, out));
  });
}

BRDFC_VECTORISED void PathTracer::choose(const Surface& surface, const PackedBrdf& brdf, std::size_t first, int bounce,
                                         Wave& wave, Lanes<bool>& on) const {
  Block& b = *wave.block;
  const std::size_t lanes = std::min(kLanes, b.count - first);
  const Vec3<Pack> wo = b.wo.pack(first);
  if (surface.has_medium()) {
    const Rgb<Pack> left = brdf.transmittance(Pack::from(&b.hits.distance[first]));
    for (std::size_t k = 0; k < lanes; ++k) {
      if (!(b.hits.side[first + k] < 0)) continue;
      surface.check("transmittance", -lane(wo, k), lane(wo, k), lane(left, k));
      Color& throughput = b.paths[first + k]->throughput;
      throughput = throughput * lane(left, k);
    }
  }
  const bool has_mirror = surface.has_mirror(), has_transmit = surface.has_transmit();
  const bool crosses = has_transmit || surface.scatters_through();
  const Pack ior = crosses ? brdf.ior() : Pack(1);
  const std::array<Pack, 3> iors = has_transmit ? brdf.channel_iors() : std::array<Pack, 3>{};
  Rgb<Pack> mirror(Pack(0)), transmit(Pack(0));
  if (has_mirror) mirror = brdf.mirror(wo);
  if (has_transmit) transmit = brdf.transmit(wo);
  std::array<double, kLanes> delta_chances{};
  if (has_mirror || has_transmit)
    for (std::size_t k = 0; k < lanes; ++k) {
      const Vector w = lane(wo, k);
      surface.check("mirror", {-w.x, -w.y, w.z}, w, lane(mirror, k));
      if (has_transmit) surface.check("transmit", refract(w, ior[k]), w, lane(transmit, k));
      delta_chances[k] = surface.delta_chance(lane(mirror, k) + lane(transmit, k), w.z);
    }
  // The factor by which radiance changes when light crosses the surface.
  const auto crossing_by = [&](double index, std::size_t k) {
    return !settings_.scale_radiance ? 1 : wo.z[k] > 0 ? 1 / sqr(index) : sqr(index);
  };

  for (std::size_t far = 0; far < 2; ++far) {
    const Block::Side& side = b.sides[far];
    const auto counts = [&](std::size_t k) {
      return side.lit[first + k] && side.lights.pdf[first + k] > 0 &&
             (strategy_ != Strategy::Brdf || side.lights.delta[first + k]);
    };
    bool any = false;
    for (std::size_t k = 0; k < lanes; ++k) any |= counts(k);
    if (!any) continue;
    const auto [f, pdf] = brdf.evaluate(side.wi.pack(first), wo);
    for (std::size_t k = 0; k < lanes; ++k) {
      if (!counts(k)) continue;
      const std::size_t at = first + k;
      const Vector wi = side.wi[at];
      surface.check("f", wi, lane(wo, k), lane(f, k));
      const Color value = lane(f, k) * side.lights.radiance[at] * std::abs(wi.z);
      if (!(max_component(value) > 0)) continue;
      const double light_pdf = side.lights.pdf[at];
      const double weight = side.lights.delta[at] ? 1 : power_heuristic(light_pdf, pdf[k] * (1 - delta_chances[k]));
      Path& path = *b.paths[at];
      wave.shadows.push_back(
          {&path, path.throughput * (far ? crossing_by(ior[k], k) : 1) * (value * (weight / light_pdf))});
      // The shadow ray ends a little before the lamp, which may lie in a surface.
      wave.shadow_rays.push_back({side.from[at], side.lights.wi[at], side.lights.distance[at] * (1 - 0x1p-18)});
    }
  }

  const Sample<Pack> samples =
      brdf.sample(wo, {Pack::from(&b.lobe[first]), Pack::from(&b.u[first]), Pack::from(&b.v[first])});
  for (std::size_t k = 0; k < lanes; ++k) {
    const std::size_t at = first + k;
    Path& path = *b.paths[at];
    Color& throughput = path.throughput;
    const Vector out = lane(wo, k);
    const double delta_chance = delta_chances[k];
    double crossing = crosses ? crossing_by(ior[k], k) : 1;
    Vector wi;
    path.sampled = nullptr;
    if (const double u = delta_chance > 0 ? path.random.one(dimension_of(bounce)) : 1; u < delta_chance) {
      const Color reflected = lane(mirror, k), refracted = lane(transmit, k);
      const double all = luminance(reflected + refracted);
      if (!(all > 0)) {  // of black glass
        on[at] = false;
        continue;
      }
      const double share = luminance(reflected) / all;
      if (u < delta_chance * share) {
        wi = {-out.x, -out.y, out.z};
        throughput = throughput * reflected / (delta_chance * share);
      } else {
        throughput = throughput * refracted / (delta_chance * (1 - share));
        const Bent bent =
            bend({iors[0][k], iors[1][k], iors[2][k]}, throughput, (u / delta_chance - share) / (1 - share));
        wi = refract(out, bent.ior);
        crossing = crossing_by(bent.ior, k);
        throughput = bent.throughput;
      }
    } else {
      const Color weight = lane(samples.weight, k);
      const double pdf = samples.pdf[k];
      wi = lane(samples.wi, k);
      surface.check("sample weight", wi, out, weight);
      if (!(pdf > 0)) {
        if (pdf != 0) surface.bad_value("sample pdf", wi, out, Color(pdf));
        on[at] = false;
        continue;
      }
      throughput = throughput * weight * (1 / (1 - delta_chance));
      path.scattered_pdf = pdf * (1 - delta_chance);
      const Block::Side& side = b.sides[wi.z * out.z < 0];
      if (side.lit[at]) path.sampled = side.chances[at];
    }
    if (wi.z * out.z < 0) throughput = throughput * crossing;
    b.wi.set(at, wi);
  }
}

}  // namespace brdfc::reference
