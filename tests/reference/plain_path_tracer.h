// SPDX-License-Identifier: GPL-3.0-or-later
// The path tracer as textbooks write it (Pharr, Jakob, Humphreys, Physically Based Rendering, 4th edition, 14.2): one
// path at a time, in scalar double precision, with the same random numbers as reference/path_tracer.h. The latter
// advances many paths together and evaluates eight at once; the light of each path must be the same up to rounding.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "model/horizon.h"
#include "model/sampling.h"
#include "reference/film.h"
#include "reference/lights.h"
#include "reference/patterns.h"
#include "reference/render.h"
#include "reference/surface.h"
#include "reference/tracer.h"

namespace brdfc::reference {

class PlainPathTracer {
  using Vector = Vec3<double>;
  using Color = Rgb<double>;

 public:
  PlainPathTracer(const Scene& scene, const RenderSettings& settings)
      : scene_(scene),
        settings_(settings),
        points_(settings.pattern, settings.spp),
        tracer_(scene),
        lights_(scene, settings.strategy == Strategy::Light) {
    surfaces_.reserve(scene.materials.size());
    for (const Material& m : scene.materials) surfaces_.emplace_back(m);
  }

  /// The light that sample number `sample` of a pixel carries to the camera.
  Color follow(int x, int y, int sample) const {
    const PathSampler random(points_, std::uint64_t(settings_.seed), std::uint64_t(y) * settings_.width + x, sample);
    const auto [dx, dy] = random.two(0);
    Ray ray;
    camera_ray(scene_.camera, settings_.width, settings_.height, x + dx, y + dy, ray.origin, ray.direction);

    Color light{0, 0, 0}, throughput{1, 1, 1};
    std::optional<Scattered> last;  // empty if light sampling could not have found this ray's direction
    for (int bounce = 0;; ++bounce) {
      Hit hit;
      const bool on_surface = tracer_.intersect(ray, bounce == 0, hit);

      // Lamps that the ray passes, and the environment.
      for (const Met& met : meet(ray, on_surface ? hit.distance : kInfinity, last, bounce == 0))
        if (!last || met.light_pdf == 0)
          light += throughput * met.radiance;
        else if (settings_.strategy != Strategy::Light)
          light += throughput * met.radiance * power_heuristic(last->pdf, met.light_pdf);
      if (!on_surface || bounce > settings_.max_bounces) return light;

      const Surface& surface = surfaces_[std::size_t(hit.material)];
      Surface::Scratch scratch = surface.make_scratch();
      const Brdf<double>& brdf = surface.at(hit.u, hit.v, scratch);
      const Frame frame(surface, hit, ray.direction);
      const Vector wo = frame.wo;
      if (surface.has_medium() && hit.inside) throughput = throughput * brdf.transmittance(hit.distance);
      const Color mirror = surface.has_mirror() ? brdf.mirror(wo) : Color(0.0);
      const Color transmit = surface.has_transmit() ? brdf.transmit(wo) : Color(0.0);
      const double delta_chance =
          surface.has_mirror() || surface.has_transmit() ? surface.delta_chance(mirror + transmit, wo.z) : 0;

      // Light sampling on the viewer's side, and on the other side if f is not 0 there.
      const int dimension = 1 + 10 * bounce;
      std::array<std::vector<double>, 2> chances;
      for (const bool far : {false, true}) {
        if (!surface.has_scatter() || lights_.empty() || (far && !surface.scatters_through())) continue;
        const Vector facing = hit.geometric * (far ? -1.0 : 1.0);
        const std::optional<Lit> lit = sample_light(hit.p, facing, random, dimension + (far ? 7 : 4), chances[far]);
        if (!lit || !(lit->pdf > 0) || (settings_.strategy == Strategy::Brdf && !lit->delta)) continue;
        const Vector wi = frame.in(lit->wi);
        if (!(dot(lit->wi, facing) > 0) || !(wi.z * wo.z * (far ? -1 : 1) > 0)) continue;
        const Color f_cos = brdf.eval(wi, wo) * std::abs(wi.z);
        const double weight = lit->delta ? 1 : power_heuristic(lit->pdf, brdf.pdf(wi, wo) * (1 - delta_chance));
        const Ray shadow{Tracer::leave(hit.p, hit.geometric, lit->wi), lit->wi, lit->distance * (1 - 0x1p-18)};
        const double crossing = far ? crossing_by(brdf.ior(), wo) : 1;
        if (max_component(f_cos * lit->radiance) > 0 && !tracer_.occluded(shadow))
          light += throughput * crossing * f_cos * lit->radiance * (weight / lit->pdf);
      }

      // The direction in which the path continues: by a delta term, or by the model's sampling.
      Vector wi;
      double index = brdf.ior();
      last.reset();
      if (const double u = delta_chance > 0 ? random.one(dimension) : 1; u < delta_chance) {
        const double reflected = luminance(mirror) / luminance(mirror + transmit);
        if (u < delta_chance * reflected) {
          wi = {-wo.x, -wo.y, wo.z};
          throughput = throughput * mirror / (delta_chance * reflected);
        } else {
          throughput = throughput * transmit / (delta_chance * (1 - reflected));
          const Bent bent = bend(brdf.channel_iors(), throughput, (u / delta_chance - reflected) / (1 - reflected));
          index = bent.ior;
          throughput = bent.throughput;
          wi = refract(wo, index);
        }
      } else {
        const auto [u1, u2] = random.two(dimension + 2);
        const Sample<double> s = brdf.sample(wo, {random.one(dimension + 1), u1, u2});
        if (!(s.pdf > 0)) return light;
        wi = s.wi;
        throughput = throughput * s.weight * (1 / (1 - delta_chance));
        const bool far = wi.z * wo.z < 0;
        if (!chances[far].empty()) last = Scattered{s.pdf * (1 - delta_chance), {}, std::move(chances[far])};
      }
      const bool crosses = wi.z * wo.z < 0;
      if (crosses) throughput = throughput * crossing_by(index, wo);

      const Vector normal = hit.geometric * (crosses ? -1.0 : 1.0), out = frame.out(wi);
      if (!(dot(out, normal) > 0) || !(max_component(throughput) > 0)) return light;
      if (last) last->normal = normal;
      // Russian roulette.
      if (const double survives = max_component(throughput); bounce + 1 >= kRouletteStart && survives < 1) {
        if (random.random(dimension + 3) >= survives) return light;
        throughput = throughput * (1 / survives);
      }
      ray = {Tracer::leave(hit.p, hit.geometric, out), out};
    }
  }

 private:
  /// What MIS needs to know about the last scattering event: the pdf of the sampled direction, the normal on its side,
  /// and the probabilities with which light sampling would have chosen each light there.
  struct Scattered {
    double pdf;
    Vector normal;
    std::vector<double> chances;
  };
  /// Light that a ray meets. light_pdf is 0 if light sampling could not have found it.
  struct Met {
    Color radiance;
    double light_pdf;
  };
  /// A direction sampled towards a light.
  struct Lit {
    Vector wi;
    double distance, pdf;
    Color radiance;
    bool delta;
  };

  /// The shading frame at a point. Normals that are seen from below, or whose mirror direction is below the surface,
  /// are corrected as in model/horizon.h. For a transmissive model, z points outwards.
  struct Frame {
    Vector tangent, bitangent, normal, wo;
    double side;

    Frame(const Surface& surface, const Hit& hit, const Vector& direction) {
      const bool bent = surface.bends_normals() && mirror_rise(hit.geometric, -direction, hit.normal) < 0;
      normal = bent ? bent_normal(hit.geometric, -direction, hit.normal) : hit.normal;
      tangent = unit(hit.tangent - normal * dot(normal, hit.tangent));
      bitangent = cross(normal, tangent);
      side = (surface.has_transmit() || surface.scatters_through()) && hit.inside ? -1 : 1;
      wo = raise_to_horizon(Vector{-dot(direction, tangent), -dot(direction, bitangent), -dot(direction, normal)});
      wo.z *= side;
    }
    Vector in(const Vector& w) const { return {dot(w, tangent), dot(w, bitangent), side * dot(w, normal)}; }
    Vector out(const Vector& w) const { return unit(tangent * w.x + bitangent * w.y + normal * (side * w.z)); }
  };

  double power_heuristic(double mine, double other) const {
    if (settings_.strategy != Strategy::Mis) return 1;
    return 1 / (1 + sqr(other / mine));
  }
  /// The factor by which radiance changes when light crosses the surface.
  double crossing_by(double index, const Vector& wo) const {
    return !settings_.scale_radiance ? 1 : wo.z > 0 ? 1 / sqr(index) : sqr(index);
  }

  // reference/lights.h samples and intersects lights in blocks; here each block has a single ray or point.
  std::vector<Met> meet(const Ray& ray, double distance, const std::optional<Scattered>& last, bool from_camera) const {
    Rays rays{};
    rays.origin.set(0, ray.origin);
    rays.direction.set(0, ray.direction);
    Numbers distances{distance};
    Vectors normal{};
    Lanes<const double*> chances{};
    if (last) normal.set(0, last->normal), chances[0] = last->chances.data();
    std::vector<Met> found;
    lights_.meet(rays, distances, 1, normal, chances, from_camera, [&](std::size_t, const Color& radiance, double pdf) {
      found.push_back({radiance, pdf});
    });
    return found;
  }
  /// A light chosen for a point, and a direction to it. Sets `chances` to the probabilities of all lights. If no light
  /// can contribute, returns nothing and leaves `chances` empty.
  std::optional<Lit> sample_light(const Vector& p, const Vector& facing, const PathSampler& random, int dimension,
                                  std::vector<double>& chances) const {
    Vectors points{}, normals{};
    points.set(0, p), normals.set(0, facing);
    std::vector<double> kept(lights_.kept());
    Lanes<double*> to{kept.data()};
    Lanes<bool> lit{};
    lights_.chances(points, normals, 1, to, lit);
    if (!lit[0]) return {};
    chances = kept;
    LightNumbers u{};
    if (lights_.choose()) u.choice[0] = random.one(std::uint64_t(dimension));
    const auto [u1, u2] = random.two(std::uint64_t(dimension) + 1);
    u.u1[0] = u1, u.u2[0] = u2;
    if (lights_.choose_more()) u.u3[0] = random.one(std::uint64_t(dimension) + 2);
    LightSamples out{};
    lights_.sample(points, normals, 1, to, lit, u, out);
    return Lit{out.wi[0], out.distance[0], out.pdf[0], out.radiance[0], out.delta[0]};
  }

  const Scene& scene_;
  const RenderSettings settings_;
  const PatternPoints points_;
  const Tracer tracer_;
  const Lights lights_;
  std::vector<Surface> surfaces_;
};

}  // namespace brdfc::reference
