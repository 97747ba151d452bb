// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc optical: the colour and index of a metal or glass with measured n and k, in the working space.
#include <nlohmann/json.hpp>

#include "app/commands.h"
#include "app/numbers.h"
#include "core/json_text.h"
#include "model/optical.h"
#include "reference/color.h"

namespace brdfc::app {
namespace {

using Json = nlohmann::ordered_json;

/// Distances, as multiples of the thickness, at which the error of the power law is measured.
constexpr double kDistances[] = {0.1, 0.5, 2, 10};

Json absorption(const Substance& s, double thickness, const ToRgb& to_rgb) {
  const Xyz xyz = s.transmittance(thickness);
  Json off = Json::array();
  for (const double d : kDistances)
    off.push_back({{"distance", d * thickness}, {"off", power_law_error(s, thickness, d * thickness, to_rgb)}});
  return {{"thickness", thickness}, {"xyz", xyz}, {"transmittance", to_rgb(xyz)}, {"power_law", off}};
}

Json describe(const Substance& s, double thickness) {
  const reference::ColorConfig& config = reference::ColorConfig::current();
  const ToRgb to_rgb = [&](const Xyz& xyz) { return config.from_xyz(xyz); };
  const OpticalValues v = optical_values(s, to_rgb);
  Json j{{"name", s.name},    {"label", s.label}, {"source", s.source},      {"conductor", s.conductor()},
         {"n", v.n},          {"k", v.k},         {"xyz", s.reflectance(1)}, {"reflectance", v.unclipped},
         {"n_d", s.index_d()}};
  const double abbe = s.abbe();
  j["abbe"] = std::isfinite(abbe) && !s.conductor() ? Json(abbe) : Json();
  if (!s.conductor()) j["absorption"] = s.absorbs() ? absorption(s, thickness, to_rgb) : Json();
  return j;
}

/// Prints the assumptions that were made about a file.
Substance with_notes(Substance s) {
  print_notes(s.notes);
  return s;
}

std::string three(const Json& j) {
  return fmt::format("{:.4f} {:.4f} {:.4f}", j[0].get<double>(), j[1].get<double>(), j[2].get<double>());
}

void print_text(const Json& j) {
  fmt::print("{}  {}, {}\n", j["name"].get<std::string>(), j["label"].get<std::string>(),
             j["conductor"].get<bool>() ? "conductor" : "dielectric");
  if (const auto source = j["source"].get<std::string>(); !source.empty()) fmt::print("  {}\n", source);
  fmt::print("  reflects from above, r g b  {}\n", three(j["reflectance"]));
  fmt::print("  n, r g b                    {}\n  k, r g b                    {}\n", three(j["n"]), three(j["k"]));
  if (!j["conductor"].get<bool>()) {
    fmt::print("  n_d                         {:.5f}\n", j["n_d"].get<double>());
    if (!j["abbe"].is_null()) fmt::print("  Abbe's number               {:.2f}\n", j["abbe"].get<double>());
    const Json& a = j["absorption"];
    if (a.is_null()) return;
    fmt::print("  {:<27} {}\n", fmt::format("left after {:g} m, r g b", a["thickness"].get<double>()),
               three(a["transmittance"]));
    for (const Json& d : a["power_law"])
      fmt::print("  {:<27} off by {:.2g}\n", fmt::format("power of it for {:g} m", d["distance"].get<double>()),
                 d["off"].get<double>());
  }
}

}  // namespace

void add_optical_command(Command app) {
  struct Options {
    std::string name;
    bool json = false;
    double thickness = kThickness;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "optical",
      "Converts metals, glass and liquids with a measured refractive index n + i k to the working space: reflectance\n"
      "at normal incidence, and n and k by channel; for transparent substances also n_d, the Abbe number, and the\n"
      "transmittance for a thickness.\n"
      "The working space is the role scene_linear of the configuration that OCIO names, otherwise Rec.709.");
  cmd.add_option(
      "name", o->name,
      "Substance, or a file: a table NAME.csv or NAME.txt, NAME.yml of refractiveindex.info's database, or a spectrum "
      "NAME.eta.spd; all substances if omitted");
  add_number(cmd, "--thickness", o->thickness, {kThinnest, kThickest},
             "Distance in metres for which the absorption of a glass is exact; prints the error at others")
      .capture_default_str();
  cmd.add_flag("--json", o->json, "Print JSON, with X, Y, Z under D65 relative to a perfect reflector as well");
  cmd.callback([o] {
    Json all = Json::array();
    if (o->name.empty())
      for (const Substance& s : substances()) all.push_back(describe(s, o->thickness));
    else
      all.push_back(describe(with_notes(find_substance(o->name, "")), o->thickness));
    if (o->json) {
      fmt::print("{}\n", json_text(o->name.empty() ? all : all[0], 1));
      return;
    }
    for (const Json& j : all) print_text(j);
  });
}

}  // namespace brdfc::app
