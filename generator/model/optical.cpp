// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/optical.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "core/csv.h"
#include "core/data_dir.h"
#include "core/parse.h"

namespace brdfc::inline model {
namespace fs = std::filesystem;
namespace {

void add_row(Curve& curve, char letter, double um, double value, const std::string& where) {
  const double nm = um * 1000;
  if (!curve.nm.empty() && !(nm > curve.nm.back()))
    input_error("{}: expected wavelengths that increase, got {:g} after {:g}", where, um, curve.nm.back() / 1000);
  const bool good = letter == 'n' ? value > 0 : value >= 0;
  if (!good || !(value <= kMaxIndex))
    input_error("{}: expected {} in {}0, {:g}], got {:g}", where, letter, letter == 'n' ? '(' : '[', kMaxIndex, value);
  curve.nm.push_back(nm);
  curve.values.push_back(value);
}

void check_span(const Curve& curve, char letter, const std::string& file) {
  if (curve.nm.front() > kNeededMin || curve.nm.back() < kNeededMax)
    input_error("{}: expected {} from {:g} to {:g} \xc2\xb5m, got {:g} to {:g}", file, letter, kNeededMin / 1000,
                kNeededMax / 1000, curve.nm.front() / 1000, curve.nm.back() / 1000);
}

}  // namespace

double Curve::at(double wavelength) const {
  if (nm.empty()) return 0;
  if (nm.size() == 1) return values[0];
  const auto upper = std::clamp<std::size_t>(
      std::size_t(std::upper_bound(nm.begin(), nm.end(), wavelength) - nm.begin()), 1, nm.size() - 1);
  const double t = std::clamp((wavelength - nm[upper - 1]) / (nm[upper] - nm[upper - 1]), 0., 1.);
  return values[upper - 1] * (1 - t) + values[upper] * t;
}

bool Substance::conductor() const {
  return xyz_of([this](double nm) { return k.at(nm); })[1] >= kConductor;
}

double Substance::index_d() const { return n.at(kLineD); }

double Substance::abbe() const {
  const double spread = n.at(kLineF) - n.at(kLineC);
  return spread == 0 ? std::numeric_limits<double>::infinity() : (index_d() - 1) / spread;
}

Xyz Substance::reflectance(double cosTheta) const {
  const double sin2 = (1 - cosTheta) * (1 + cosTheta);
  return xyz_of([&](double nm) { return fresnel_conductor(cosTheta, sin2, n.at(nm), k.at(nm)); });
}

bool Substance::absorbs() const {
  return xyz_of([this](double nm) { return k.at(nm); })[1] > 0;
}

Xyz Substance::transmittance(double metres) const {
  return xyz_of([&](double nm) { return model::transmittance(nm, k.at(nm), metres); });
}

Substance read_substance(const fs::path& path) {
  const std::string file = path.string();
  std::ifstream in(path);
  std::error_code ignored;
  if (!in || fs::is_directory(path, ignored)) input_error("{}: cannot be read", file);
  Substance out{file, path.stem().string(), "", {}, {}};
  std::vector<char> block;  // the columns beside wl
  int number = 0, comments = 0;
  for (std::string text; std::getline(in, text);) {
    if (++number == 1 && text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
    const std::string line = trim(text), where = fmt::format("{} line {}", file, number);
    if (line.empty()) continue;
    if (line[0] == '#') {
      ++comments;
      if (comments == 1) out.label = trim(line.substr(1));
      if (comments == 2) out.source = trim(line.substr(1));
      continue;
    }
    const std::vector<std::string> fields = split_fields(line);
    if (fields[0] == "wl") {
      block.clear();
      for (std::size_t i = 1; i < fields.size(); ++i) {
        if (fields[i] != "n" && fields[i] != "k") break;
        const char letter = fields[i][0];
        if (!(letter == 'n' ? out.n : out.k).nm.empty() || std::count(block.begin(), block.end(), letter))
          input_error("{}: expected {} once", where, letter);
        block.push_back(letter);
      }
      if (block.empty() || block.size() + 1 != fields.size()) block.clear();
    }
    if (block.empty()) input_error("{}: expected the header wl,n or wl,k, got '{}'", where, line);
    if (fields[0] == "wl") continue;
    std::vector<double> row;
    for (const std::string& f : fields)
      if (const auto value = parse(f); value && std::isfinite(*value)) row.push_back(*value);
    if (row.size() != fields.size() || row.size() != block.size() + 1)
      input_error("{}: expected {} numbers, a wavelength in \xc2\xb5m and {}, got '{}'", where, block.size() + 1,
                  fmt::join(block, " and "), line);
    for (std::size_t i = 0; i < block.size(); ++i)
      add_row(block[i] == 'n' ? out.n : out.k, block[i], row[0], row[i + 1], where);
  }
  if (out.n.nm.empty()) input_error("{}: expected a line wl,n and rows below it, found no n", file);
  check_span(out.n, 'n', file);
  if (!out.k.nm.empty()) check_span(out.k, 'k', file);
  return out;
}

const std::vector<Substance>& substances() {
  static const auto all = [] {
    std::vector<Substance> out;
    const fs::path folder = data_dir() / "data" / "optical";
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      out.push_back(read_substance(entry.path()));
      out.back().name = entry.path().stem().string();
    }
    std::sort(out.begin(), out.end(), [](const Substance& a, const Substance& b) { return a.name < b.name; });
    return out;
  }();
  return all;
}

Substance find_substance(const std::string& name, const fs::path& folder) {
  if (name.ends_with(".csv")) return read_substance(folder / name);  // an absolute name stays what it is
  std::vector<std::string> known;
  for (const Substance& s : substances()) {
    if (s.name == name) return s;
    known.push_back(s.name);
  }
  input_error("expected a file NAME.csv or one of {}, got '{}'", fmt::join(known, ", "), name);
}

OpticalValues optical_values(const Substance& s, const ToRgb& to_rgb) {
  const auto mean = [&](const auto& of) { return xyz_of([&](double nm) { return of(s.n.at(nm), s.k.at(nm)); }); };
  const Xyz xyz = s.reflectance(1);
  const auto R0 = to_rgb(xyz), grazing = to_rgb(s.reflectance(kGrazing)),
             real = to_rgb(mean([](double n, double k) { return normal_amplitude(n, k).real; })),
             imaginary = to_rgb(mean([](double n, double k) { return normal_amplitude(n, k).imaginary; }));
  OpticalValues out{{}, {}, {}, R0, xyz[1]};
  for (std::size_t c = 0; c < 3; ++c) {
    const Index<double> i = nearest_index(R0[c], {real[c], imaginary[c]}, grazing[c]);
    out.n[c] = i.n, out.k[c] = i.k;
    out.reflectance[c] = std::clamp(R0[c], 0., 1.);
  }
  return out;
}

std::array<double, 3> attenuation(const Substance& s, double metres, const ToRgb& to_rgb) {
  std::array<double, 3> out = to_rgb(s.transmittance(metres));
  for (double& share : out) share = std::clamp(share, kDarkest, 1.);
  return out;
}

double power_law_error(const Substance& s, double thickness, double distance, const ToRgb& to_rgb) {
  const std::array<double, 3> stated = attenuation(s, thickness, to_rgb), exact = to_rgb(s.transmittance(distance));
  double most = 0;
  for (std::size_t c = 0; c < 3; ++c)
    most = std::max(most, std::abs(std::pow(stated[c], distance / thickness) - exact[c]));
  return most;
}

ParamValues parameters_of(const ModelInfo& info, const Substance& s, const ToRgb& to_rgb,
                          std::optional<double> thickness) {
  const OpticalValues v = optical_values(s, to_rgb);
  const bool conductor = s.conductor(), absorbs = !conductor && s.absorbs();
  ParamValues out;
  for (const ParamInfo& p : info.params) switch (p.optical) {
      case Optical::None:
        break;
      case Optical::IndexRed:
      case Optical::IndexGreen:
      case Optical::IndexBlue:
        out[p.name] = std::clamp(v.n[std::size_t(p.optical) - std::size_t(Optical::IndexRed)], p.min, p.max);
        break;
      case Optical::ExtinctionRed:
      case Optical::ExtinctionGreen:
      case Optical::ExtinctionBlue:
        out[p.name] = std::clamp(v.k[std::size_t(p.optical) - std::size_t(Optical::ExtinctionRed)], p.min, p.max);
        break;
      case Optical::Index:
        if (!conductor) out[p.name] = std::clamp(s.index_d(), p.min, p.max);
        break;
      case Optical::Dispersion:
        if (!conductor) out[p.name] = std::clamp(kDispersion / s.abbe(), p.min, p.max);
        break;
      case Optical::Reflectance:
        if (p.kind == ParamKind::Color)
          out[p.name] = v.reflectance;
        else if (!conductor)
          out[p.name] = std::clamp(v.luminance, p.min, p.max);
        break;
      case Optical::Tint:
        if (conductor) out[p.name] = v.reflectance;
        break;
      case Optical::Attenuation:
        if (absorbs) out[p.name] = attenuation(s, thickness.value_or(kThickness), to_rgb);
        break;
      case Optical::PerLength:
        if (absorbs) out[p.name] = std::clamp(1 / thickness.value_or(kThickness), p.min, p.max);
        break;
    }
  if (out.empty())
    input_error("{} has no parameter that says which {} it is made of", info.name,
                conductor ? "metal" : "glass or liquid");
  if (!thickness) return out;
  if (!absorbs)
    input_error("a thickness says where absorption is exact: {} has no k to absorb by, or is a metal", s.name);
  if (std::ranges::none_of(info.params, [](const ParamInfo& p) { return p.optical == Optical::Attenuation; }))
    input_error("a thickness says where absorption is exact: {} has no parameter for absorption", info.name);
  return out;
}

}  // namespace brdfc::inline model
