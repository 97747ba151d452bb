// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/optical.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/data_dir.h"
#include "core/text.h"
#include "model/optical_file.h"

namespace brdfc::inline model {
namespace fs = std::filesystem;
namespace {

using Row = OpticalRow;

/// Checks and cleans the rows of a file before they become a curve, and collects notes about that.
class Cleaner {
 public:
  Cleaner(std::string file, std::vector<std::string>& notes) : file_(std::move(file)), notes_(notes) {}

  /// True if wavelengths whose unit nobody states are in nanometres.
  bool in_nanometres(const std::vector<Row>& n, const std::vector<Row>& k, bool in_um) {
    bool large = !in_um;
    for (const auto* rows : {&n, &k})
      for (const Row& r : *rows) {
        if (!(r.wavelength > 0))
          input_error("{} line {}: expected a wavelength above 0, got {:g}", file_, r.line, r.wavelength);
        large = large && r.wavelength >= kNanometres;
      }
    if (large) note("wavelengths of 100 and more are taken for nanometres");
    return large;
  }

  Curve curve(std::vector<Row> rows, char letter, bool nanometres) {
    const double unit = nanometres ? 1 : 1000;
    for (Row& r : rows) r.wavelength *= unit;
    drop_bad(rows, letter);
    std::ranges::stable_sort(rows, {}, &Row::wavelength);
    Curve out;
    std::size_t twice = 0;
    double first = 0;
    for (std::size_t i = 0; i < rows.size();) {
      std::size_t end = i;
      double sum = 0;
      for (; end < rows.size() && rows[end].wavelength == rows[i].wavelength; ++end) sum += rows[end].value;
      if (end - i > 1 && twice++ == 0) first = rows[i].wavelength;
      out.nm.push_back(rows[i].wavelength);
      out.values.push_back(sum / double(end - i));
      i = end;
    }
    if (twice)
      note("{} of {} stand{} twice, the first {:g} \xc2\xb5m: the mean is taken",
           twice == 1 ? "1 wavelength" : fmt::format("{} wavelengths", twice), letter, twice == 1 ? "s" : "",
           first / 1000);
    check_span(out, letter);
    return out;
  }

 private:
  template <class... Args> void note(fmt::format_string<Args...> format, Args&&... args) {
    notes_.push_back(file_ + ": " + fmt::format(format, std::forward<Args>(args)...));
  }

  void drop_bad(std::vector<Row>& rows, char letter) {
    std::size_t dropped = 0, negative = 0;
    double least = 0;
    std::erase_if(rows, [&](Row& r) {
      if (letter == 'k' && r.value < 0 && r.value >= -kNoiseOfK) {
        ++negative;
        least = std::min(least, r.value);
        r.value = 0;
      }
      if ((letter == 'n' ? r.value > 0 : r.value >= 0) && r.value <= kMaxIndex) return false;
      if (r.wavelength >= kSeenMin && r.wavelength <= kSeenMax)
        input_error("{} line {}: expected {} in {}0, {:g}], got {:g}", file_, r.line, letter, letter == 'n' ? '(' : '[',
                    kMaxIndex, r.value);
      ++dropped;
      return true;
    });
    if (negative)
      note("{} below 0, the least {:g}: taken for 0",
           negative == 1 ? "1 value of k is" : fmt::format("{} values of k are", negative), least);
    if (dropped)
      note("{} of {} outside of {}0, {:g}] and of the visible: left out",
           dropped == 1 ? "1 value" : fmt::format("{} values", dropped), letter, letter == 'n' ? '(' : '[', kMaxIndex);
  }

  void check_span(Curve& curve, char letter) {
    if (curve.nm.empty()) return;
    const double front = curve.nm.front(), back = curve.nm.back();
    if (letter == 'k' && (front > kSeenMax || back < kSeenMin)) {
      note("k from {:g} to {:g} \xc2\xb5m, outside of the visible: left out", front / 1000, back / 1000);
      curve = {};
      return;
    }
    if (front > kNeededMin || back < kNeededMax)
      input_error("{}: expected {} from {:g} to {:g} \xc2\xb5m, got {:g} to {:g}", file_, letter, kNeededMin / 1000,
                  kNeededMax / 1000, front / 1000, back / 1000);
    if (front > kExpectedMin || back < kExpectedMax)
      note("{} from {:g} to {:g} \xc2\xb5m: taken for constant beyond", letter, front / 1000, back / 1000);
  }

  std::string file_;
  std::vector<std::string>& notes_;
};

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
  OpticalFile found = read_optical_file(path);
  Substance out{file, found.label.empty() ? path.stem().string() : found.label, found.source, {}, {}, {}};
  Cleaner cleaner(file, out.notes);
  const bool nanometres = cleaner.in_nanometres(found.n, found.k, found.in_um);
  out.n = cleaner.curve(std::move(found.n), 'n', nanometres);
  if (out.n.nm.empty()) input_error("{}: expected n in the visible, found none", file);
  out.k = cleaner.curve(std::move(found.k), 'k', nanometres);
  return out;
}

const std::vector<Substance>& substances() {
  static const auto all = [] {
    std::vector<Substance> out;
    const fs::path folder = data_path("data/optical");
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
  if (is_optical_file(name)) return read_substance(folder / name);  // an absolute path is not changed
  std::vector<std::string> known;
  for (const Substance& s : substances()) {
    if (s.name == name) return s;
    known.push_back(s.name);
  }
  input_error("expected a file NAME.csv, NAME.txt, NAME.yml or NAME.eta.spd, or one of {}, got '{}'", join(known, ", "),
              name);
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

ParamValues clear_inside(const ModelInfo& info) {
  ParamValues out;
  for (const ParamInfo& p : info.params)
    if (p.optical == Optical::Attenuation) out[p.name] = std::array<double, 3>{1, 1, 1};
  return out;
}

}  // namespace brdfc::inline model
