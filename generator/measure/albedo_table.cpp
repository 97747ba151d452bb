// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/albedo_table.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <utility>

#include "core/data_dir.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/sequence.h"
#include "measure/albedo.h"
#include "model/choices.h"
#include "print/osl_program.h"
#include "tables/table_file.h"
#include "trace/program.h"

namespace brdfc::measure {
namespace {

// Below this cosine the end of the axis serves: a view direction within 0.06 degrees of the horizon.
constexpr double kMinCos = 1e-3;
// Interpolation is refined until its estimated error is below this, or the grid holds kMaxPoints.
constexpr double kAimError = 3e-4;
constexpr std::size_t kMaxPoints = 6000, kMaxPoints4 = 14000;  // of up to three axes, of four
// Two albedos that differ by less, and by less than seven times their own error, count as equal while axes are sought.
constexpr double kSame = 1e-4;

// Samples a lobe: of a knot, and where a table is proved. Measured on the models here, errors are about 2e-4 and 2e-5.
constexpr int kGridSamples = 1024;
constexpr int kProofSamples = 1 << 13;
// Neighbouring knots use the same samples, so that their errors go together: this share of them does not.
constexpr double kProfileNoise = 0.05;
constexpr AlbedoOptions kProofOptions{.absolute = 1e-6, .max_cells = 2000, .witnesses = 1 << 15};
// Probes near the ends of all ranges at once; they follow the one at the defaults.
constexpr std::size_t kCorners = 4;
/// Averaged over the azimuth of the view direction.
constexpr std::nullopt_t kAllAzimuths = std::nullopt;

/// The text of all that the model computes with these values fixed: equal texts are equal models.
std::string formula(const Model& model, const ParamValues& fixed) {
  Recorder recorder;
  const Vec3<Expr> wi = input3("wi"), wo = input3("wo");
  const auto brdf = model.record(fixed);
  const Sample<Expr> sample = brdf->sample(wo, input3("u"));
  Program program;
  program.output("f", brdf->eval(wi, wo));
  program.output("pdf", brdf->pdf(wi, wo));
  program.output("sample", sample.wi);
  program.output("sample_weight", sample.weight);
  program.output("sample_pdf", sample.pdf);
  program.output("mirror", brdf->mirror(wo));
  program.output("transmit", brdf->transmit(wo));
  program.output("ior", brdf->ior());
  return print::osl_program(program, 0, {});
}

/// A coordinate of the albedo: the view cosine or a Number parameter.
struct Coordinate {
  std::string name;
  ScaledRange range;

  /// t in [0, 1] to a value, uniform on the scale; the cosine crowds towards grazing, where albedos bend most.
  double at(double t) const {
    return name == "cos_theta_o" ? range.low + (range.high - range.low) * t * t : range.at(t);
  }
};

Coordinate coordinate(const ParamInfo& p) { return {p.name, p.accepted()}; }

/// Coefficients of the polynomial in the colours, by monomial: index = powers of the colours as digits, the first
/// colour's the lowest, each running to the colour's degree.
struct Coefficients {
  std::vector<Rgb<double>> scattered, mirror;
  double error = 0;  // of each coefficient, one standard error
};

double max_abs(const Rgb<double>& c) { return max_component(magnitude(c)); }

/// In units of what counts: of 1, or of the value itself where a model without bounds gives off more than it gets.
double unit_of(const Rgb<double>& albedo) { return std::max(1.0, max_abs(albedo)); }

class Tabulator {
 public:
  explicit Tabulator(const Model& model) : model_(model) {
    coordinates_.push_back({"cos_theta_o", {AxisScale::Linear, kMinCos, 1}});
    for (const ParamInfo& p : model.info().params) {
      if (p.kind == ParamKind::Number) coordinates_.push_back(coordinate(p));
      if (p.kind == ParamKind::Color) colors_.push_back(p.name);
      if (p.kind != ParamKind::Choice) continue;
      table_.choices.push_back(p.name);
      table_.choice_sizes.push_back(int(p.choices.size()));
    }
    if (colors_.size() > 5)
      throw ValueError(
          fmt::format("{}: expected at most 5 colours in an albedo table, got {}", model.info().name, colors_.size()));
    table_.model = model.info().name;
    const std::vector<Choices> all = choice_combinations(model.info());
    std::map<std::string, std::size_t> known;
    for (const Choices& c : all) {
      const ParamValues combination = with_choices(model.info(), c);
      // A choice may say nothing beside another one.
      const std::string text = all.size() > 1 ? formula(model, combination) : "";
      const auto [it, is_new] = known.emplace(text, combinations_.size());
      if (is_new) combinations_.push_back(combination);
      stands_for_.push_back(it->second);
    }
  }

  AlbedoTable run() {
    study_degrees();
    study_channels();
    study_azimuth();
    make_probes();
    std::vector<std::vector<AlbedoTerm>> terms;
    for (const ParamValues& combination : combinations_) terms.push_back(terms_of(combination));
    for (const std::size_t c : stands_for_) table_.terms.push_back(terms[c]);
    prove();
    describe();
    return std::move(table_);
  }

 private:
  using Position = std::vector<double>;  // values of coordinates_

  ParamValues values_at(const ParamValues& combination, const Position& x) const {
    ParamValues v = combination;
    for (std::size_t i = 1; i < coordinates_.size(); ++i) v[coordinates_[i].name] = x[i];
    return v;
  }

  std::string label(const ParamValues& v) const {
    return fmt::format("{} {}", model_.info().name, format_values(model_.info(), complete(model_.info(), v)));
  }

  Coefficients coefficients(const ParamValues& combination, const Position& x, std::optional<double> phi,
                            int samples = kGridSamples, std::uint64_t seed = 0) const {
    return coefficients(combination, x, phi, samples, seed, share_channels_);
  }

  /// With share_channels three nodes of the polynomial are red, green and blue of one model: a third of the work.
  Coefficients coefficients(const ParamValues& combination, const Position& x, std::optional<double> phi, int samples,
                            std::uint64_t seed, bool share_channels) const {
    ParamValues values = values_at(combination, x);
    for (const std::string& c : colors_) values[c] = 0.5;
    const auto guide = model_.make_double(values);
    const std::size_t nodes = monomials(), channels = share_channels ? 3 : 1;
    std::vector<std::unique_ptr<Brdf<double>>> models;
    std::vector<const Brdf<double>*> pointers;
    for (std::size_t first = 0; first < nodes; first += channels) {
      for (std::size_t c = 0; c < colors_.size(); ++c) {
        std::array<double, 3> color;
        for (std::size_t i = 0; i < 3; ++i)
          color[i] = double(power(std::min(first + i % channels, nodes - 1), c)) / degrees_[c];
        values[colors_[c]] = color;
      }
      models.push_back(model_.make_double(values));
      pointers.push_back(models.back().get());
    }
    const std::string name = label(values_at(combination, x)) + " (colours 0, 0.5 or 1)";
    if (!depends_on_azimuth_ && !phi) phi = 0;
    const MeanAlbedo mean = mean_albedos(*guide, pointers, x[0], phi, name, samples, seed);
    Coefficients out{mean.scattered, mean.mirror, mean.error * double(nodes)};
    if (share_channels)
      for (std::vector<Rgb<double>>* v : {&out.scattered, &out.mirror}) {
        const std::vector<Rgb<double>> shared = std::exchange(*v, std::vector<Rgb<double>>(nodes));
        for (std::size_t k = 0; k < nodes; ++k) {
          const Rgb<double>& c = shared[k / 3];
          (*v)[k] = Rgb<double>(k % 3 == 0 ? c.r : k % 3 == 1 ? c.g : c.b);
        }
      }
    // From values at the colours 0, 1 or 0, 1/2, 1 to coefficients of the monomials.
    for (std::size_t c = 0; c < colors_.size(); ++c)
      for (std::size_t k = 0; k < nodes; ++k) {
        if (power(k, c) != 0) continue;
        for (std::vector<Rgb<double>>* v : {&out.scattered, &out.mirror}) {
          const Rgb<double> f0 = (*v)[k], f1 = (*v)[k + stride(c)];
          if (degrees_[c] == 1) {
            (*v)[k + stride(c)] = f1 - f0;
          } else {
            const Rgb<double> f2 = (*v)[k + 2 * stride(c)];
            (*v)[k + stride(c)] = f1 * 4. - f2 - f0 * 3.;
            (*v)[k + 2 * stride(c)] = (f2 + f0 - f1 * 2.) * 2.;
          }
        }
      }
    return out;
  }

  /// How many powers the colours before c take up in an index of monomials.
  std::size_t stride(std::size_t c) const {
    std::size_t n = 1;
    for (std::size_t i = 0; i < c; ++i) n *= std::size_t(degrees_[i] + 1);
    return n;
  }
  std::size_t monomials() const { return stride(colors_.size()); }
  int power(std::size_t monomial, std::size_t c) const {
    return int(monomial / stride(c) % std::size_t(degrees_[c] + 1));
  }

  /// Colours whose half does not give the mean of 0 and 1 enter squared; prove() finds what is no polynomial at all.
  /// A quotient whose integral is linear leaves noise.
  void study_degrees() {
    degrees_.assign(colors_.size(), 1);
    std::mt19937_64 random(5);
    for (const ParamValues& combination : combinations_)
      for (int i = 0; i < 2; ++i) {
        const Position x = random_position(random);
        ParamValues values = values_at(combination, x);
        for (const std::string& name : colors_) values[name] = 0.5;
        const auto guide = model_.make_double(values);
        for (std::size_t c = 0; c < colors_.size(); ++c) {
          std::vector<std::unique_ptr<Brdf<double>>> models;
          std::vector<const Brdf<double>*> pointers;
          for (const double level : {0., 0.5, 1.}) {
            ParamValues v = values;
            v[colors_[c]] = level;
            models.push_back(model_.make_double(v));
            pointers.push_back(models.back().get());
          }
          const MeanAlbedo m = mean_albedos(*guide, pointers, x[0], 0, label(values), kGridSamples);
          // The same samples for all three: what a straight line leaves is no noise, unless tables stand in a quotient.
          const double noise = table_error(model_.info(), values) > 0 ? kSame + 7 * m.error : 0;
          for (const std::vector<Rgb<double>>& v : {m.scattered, m.mirror})
            if (max_abs(v[0] + v[2] - v[1] * 2.) > noise + 1e-9 * max_abs(v[0] + v[2])) degrees_[c] = 2;
        }
      }
  }

  /// Do channels know nothing of each other, and are they alike? Then sharing gives the same numbers to the last bit.
  /// prove() holds the polynomial that follows against the model at random colours, which differ in every channel.
  void study_channels() {
    if (monomials() == 1) return;
    std::mt19937_64 random(29);
    for (const ParamValues& combination : combinations_)
      for (int i = 0; i < 4; ++i) {
        const Position x = random_position(random);
        const double phi = 2 * kPi * double(i) / 4 + 0.3;
        const Coefficients apart = coefficients(combination, x, phi, kGridSamples, 0, false),
                           shared = coefficients(combination, x, phi, kGridSamples, 0, true);
        if (distance(apart, shared) != 0 || apart.error != shared.error) return;
      }
    share_channels_ = true;
  }

  static double distance(const Coefficients& a, const Coefficients& b) {
    double d = 0;
    for (std::size_t k = 0; k < a.scattered.size(); ++k)
      d = std::max({d, max_abs(a.scattered[k] - b.scattered[k]), max_abs(a.mirror[k] - b.mirror[k])});
    return d;
  }
  static bool differ(const Coefficients& a, const Coefficients& b) {
    return distance(a, b) > kSame + 7 * (a.error + b.error);
  }

  Position random_position(std::mt19937_64& random) const {
    std::uniform_real_distribution<double> uniform;
    Position x;
    for (const Coordinate& c : coordinates_) x.push_back(c.at(uniform(random)));
    return x;
  }

  /// Finds out whether the albedo depends on the azimuth, and which numbers do nothing but turn it.
  void study_azimuth() {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> angle(0, 2 * kPi);
    struct Case {
      ParamValues combination;
      Position x;
      double phi, turn;
    };
    std::vector<Case> cases;
    for (const ParamValues& c : combinations_)
      for (int i = 0; i < 6; ++i) {
        const Position x = random_position(random);
        const double phi = angle(random);
        cases.push_back({c, x, phi, 0.1 + angle(random) / 8});
      }
    std::vector<Coefficients> base(cases.size());
    depends_on_azimuth_ = true;
    for_all(cases.size(),
            [&](std::size_t i) { base[i] = coefficients(cases[i].combination, cases[i].x, cases[i].phi); });
    const auto all_equal = [&](const std::function<Coefficients(const Case&)>& variant) {
      std::vector<char> same(cases.size());
      for_all(cases.size(), [&](std::size_t i) { same[i] = !differ(base[i], variant(cases[i])); });
      return std::all_of(same.begin(), same.end(), [](char s) { return s; });
    };
    if (all_equal([&](const Case& c) { return coefficients(c.combination, c.x, c.phi + c.turn); })) {
      depends_on_azimuth_ = false;
      return;
    }
    turns_.assign(coordinates_.size(), false);
    for (std::size_t p = 1; p < coordinates_.size(); ++p) {
      if (coordinates_[p].range.high - coordinates_[p].range.low < 1) continue;
      // The same samples in the turned frame: equal up to rounding, if it is a turn.
      turns_[p] = all_equal([&](const Case& c) {
        Position x = c.x;
        const double sign = x[p] + c.turn <= coordinates_[p].range.high ? 1 : -1;
        x[p] += sign * c.turn;
        return coefficients(c.combination, x, c.phi + sign * c.turn);
      });
    }
  }

  void freeze_turns(Position& x) const {
    if (turns_.empty()) return;
    for (std::size_t p = 1; p < coordinates_.size(); ++p)
      if (turns_[p]) x[p] = model_.info().param(coordinates_[p].name)->value[0];
  }

  void make_probes() {
    std::mt19937_64 random(7);
    Position defaults{0.5};
    for (std::size_t i = 1; i < coordinates_.size(); ++i)
      defaults.push_back(model_.info().param(coordinates_[i].name)->value[0]);
    probes_.push_back(defaults);
    // Near the ends of ranges, where peaks stand that random places miss.
    for (std::size_t i = 0; i < kCorners; ++i) {
      Position corner;
      for (const Coordinate& c : coordinates_) corner.push_back(c.at(random() & 1 ? 0.97 : 0.03));
      probes_.push_back(corner);
    }
    for (int i = 0; i < 5; ++i) probes_.push_back(random_position(random));
    // Coefficients that agree elsewhere may part at grazing views, where lobes lose what falls below the surface.
    places_ = probes_;
    for (int i = 0; i < 12; ++i) {
      places_.push_back(random_position(random));
      places_.back()[0] = 0.05;
    }
    for (Position& x : probes_) freeze_turns(x);
    for (Position& x : places_) freeze_turns(x);
  }

  struct NewTerm {
    bool mirror;
    std::size_t monomial;
    std::vector<std::size_t> axes;
  };

  /// A mirror's weight is no mean of samples.
  static double noise(const Coefficients& c, const NewTerm& t) { return t.mirror ? 0 : c.error; }

  Rgb<double> pick(const Coefficients& c, const NewTerm& t) const {
    return t.mirror ? c.mirror[t.monomial] : c.scattered[t.monomial];
  }

  std::vector<AlbedoTerm> terms_of(const ParamValues& combination) {
    // Coefficients at the probes, and along each coordinate through each of them.
    constexpr int kSteps = 4;
    std::vector<Coefficients> at_probe(places_.size());
    for_all(places_.size(), [&](std::size_t i) { at_probe[i] = coefficients(combination, places_[i], kAllAzimuths); });

    std::vector<NewTerm> wanted;
    for (int mirror = 0; mirror < 2; ++mirror)
      for (std::size_t k = 0; k < monomials(); ++k) wanted.push_back({mirror == 1, k, {}});
    std::erase_if(wanted, [&](const NewTerm& t) {
      for (const Coefficients& c : at_probe)
        if (max_abs(pick(c, t)) > 1e-9 + 7 * noise(c, t)) return false;
      return true;
    });

    std::vector<AlbedoTerm> terms;
    std::vector<NewTerm> missing;
    for (const NewTerm& t : wanted) {
      const int shared = find_shared(t, at_probe, table_error(model_.info(), combination));
      if (shared >= 0)
        terms.push_back({t.mirror, color_names(t.monomial), shared});
      else
        missing.push_back(t);
    }
    if (!missing.empty()) {
      std::vector<std::vector<char>> depends(missing.size(), std::vector<char>(coordinates_.size(), 0));
      std::mutex mutex;
      for_all(probes_.size() * coordinates_.size() * kSteps, [&](std::size_t job) {
        const std::size_t step = job % kSteps, p = job / kSteps % coordinates_.size(),
                          i = job / kSteps / coordinates_.size();
        if (!turns_.empty() && turns_[p]) return;
        Position x = probes_[i];
        x[p] = coordinates_[p].at(double(step) / (kSteps - 1));
        const Coefficients c = coefficients(combination, x, kAllAzimuths);
        const std::lock_guard lock(mutex);
        for (std::size_t t = 0; t < missing.size(); ++t)
          if (max_abs(pick(c, missing[t]) - pick(at_probe[i], missing[t])) >
              kSame + 7 * (noise(c, missing[t]) + noise(at_probe[i], missing[t])))
            depends[t][p] = 1;
      });
      for (std::size_t t = 0; t < missing.size(); ++t)
        for (std::size_t p = 0; p < coordinates_.size(); ++p)
          if (depends[t][p]) missing[t].axes.push_back(p);
      while (!missing.empty()) {
        std::vector<NewTerm> group, rest;
        for (const NewTerm& t : missing) (t.axes == missing[0].axes ? group : rest).push_back(t);
        const std::vector<int> grids = tabulate(combination, group, at_probe);
        for (std::size_t i = 0; i < group.size(); ++i)
          terms.push_back({group[i].mirror, color_names(group[i].monomial), grids[i]});
        missing = std::move(rest);
      }
    }
    return terms;
  }

  std::vector<std::string> color_names(std::size_t monomial) const {
    std::vector<std::string> names;
    for (std::size_t c = 0; c < colors_.size(); ++c)
      for (int k = 0; k < power(monomial, c); ++k) names.push_back(colors_[c]);
    return names;
  }

  /// A grid that has this coefficient's values at every place, or -1. What a model takes from tables of its own albedo
  /// is `slack` from a grid, its negative or the rest that it leaves of 1: no need to integrate all of it again.
  int find_shared(const NewTerm& t, const std::vector<Coefficients>& at_probe, double slack) {
    const auto same = [&](std::size_t g, double offset, double sign, double tolerance) {
      for (std::size_t i = 0; i < at_probe.size(); ++i) {
        const Rgb<double> wanted = Rgb<double>(offset) + signatures_[g][i] * sign;
        if (max_abs(pick(at_probe[i], t) - wanted) > tolerance + kSame + 14 * noise(at_probe[i], t)) return false;
      }
      return true;
    };
    for (std::size_t g = 0; g < signatures_.size(); ++g)
      if (same(g, 0, 1, 0)) return int(g);
    if (slack == 0) return -1;
    for (std::size_t g = 0; g < signatures_.size(); ++g)
      for (const double offset : {0., 1.}) {
        if (!same(g, offset, -1, slack)) continue;
        AlbedoGrid grid = table_.grids[g];
        for (float& v : grid.values) v = float(offset) - v;
        return add_grid(std::move(grid), t, at_probe);
      }
    return -1;
  }

  int add_grid(AlbedoGrid grid, const NewTerm& t, const std::vector<Coefficients>& at_probe) {
    table_.grids.push_back(std::move(grid));
    signatures_.emplace_back();
    for (const Coefficients& c : at_probe) signatures_.back().push_back(pick(c, t));
    return int(table_.grids.size()) - 1;
  }

  /// One grid per term of the group, all on the same knots.
  std::vector<int> tabulate(const ParamValues& combination, const std::vector<NewTerm>& group,
                            const std::vector<Coefficients>& at_probe) {
    const std::vector<std::size_t>& axes = group[0].axes;
    const std::vector<TableAxis> knots = place_knots(combination, group);
    std::size_t points = 1;
    for (const TableAxis& a : knots) points *= a.values.size();
    const int samples = int(std::clamp<std::size_t>((std::size_t(1) << 22) / points, kGridSamples, 1 << 14));
    std::vector<std::vector<Rgb<double>>> values(group.size(), std::vector<Rgb<double>>(points));
    for_all(points, [&](std::size_t i) {
      Position x = probes_[0];
      std::size_t rest = i;
      for (std::size_t a = axes.size(); a-- > 0;) {
        x[axes[a]] = knots[a].values[rest % knots[a].values.size()];
        rest /= knots[a].values.size();
      }
      const Coefficients c = coefficients(combination, x, kAllAzimuths, samples);
      for (std::size_t t = 0; t < group.size(); ++t) values[t][i] = pick(c, group[t]);
    });
    std::vector<int> out;
    for (std::size_t t = 0; t < group.size(); ++t) {
      AlbedoGrid g;
      g.axes = knots;
      double chroma = 0;
      for (const Rgb<double>& v : values[t]) chroma = std::max({chroma, std::abs(v.r - v.g), std::abs(v.r - v.b)});
      g.channels = chroma > 1e-12 ? 3 : 1;
      for (const Rgb<double>& v : values[t]) {
        g.values.push_back(float(v.r));
        if (g.channels == 3) {
          g.values.push_back(float(v.g));
          g.values.push_back(float(v.b));
        }
      }
      out.push_back(add_grid(std::move(g), group[t], at_probe));
    }
    return out;
  }

  /// Knots so that linear interpolation errs about equally everywhere: their density follows the square root of the
  /// second derivative met on lines through the probes.
  std::vector<TableAxis> place_knots(const ParamValues& combination, const std::vector<NewTerm>& group) const {
    constexpr int kProfile = 33;
    const std::vector<std::size_t>& axes = group[0].axes;
    const std::size_t lines = std::min<std::size_t>(probes_.size(), axes.size() > 1 ? 8 : 1);
    std::vector<std::vector<double>> density(axes.size(), std::vector<double>(kProfile, 0.));
    std::vector<std::vector<double>> s(axes.size(), std::vector<double>(kProfile));
    std::vector<double> bend(axes.size(), 0.);  // error = bend / knots^2
    for (std::size_t a = 0; a < axes.size(); ++a) {
      const Coordinate& c = coordinates_[axes[a]];
      for (int j = 0; j < kProfile; ++j)
        s[a][std::size_t(j)] = to_scale(c.range.scale, c.at(double(j) / (kProfile - 1)));
      std::vector<Coefficients> profile(lines * kProfile);
      for_all(profile.size(), [&](std::size_t i) {
        Position x = probes_[i / kProfile];
        x[axes[a]] = c.at(double(i % kProfile) / (kProfile - 1));
        profile[i] = coefficients(combination, x, kAllAzimuths, axes.size() > 1 ? kGridSamples : 4 * kProofSamples);
      });
      for (std::size_t line = 0; line < lines; ++line) {
        // Of few axes the random places see the peaks as well, and the ends would take more knots than they need.
        const double weight = line > 0 && line <= kCorners && axes.size() <= 2 ? 0.5 : 1;
        for (int j = 1; j + 1 < kProfile; ++j) {
          const Coefficients* f = &profile[line * kProfile + std::size_t(j)];
          const double h0 = s[a][std::size_t(j)] - s[a][std::size_t(j) - 1],
                       h1 = s[a][std::size_t(j) + 1] - s[a][std::size_t(j)];
          const double noise = kProfileNoise * (f[-1].error + f[0].error + f[1].error) / (h0 * h1);
          for (const NewTerm& t : group) {
            const Rgb<double> f0 = pick(f[-1], t), f1 = pick(f[0], t), f2 = pick(f[1], t);
            const double second = max_abs((f2 - f1) / h1 - (f1 - f0) / h0) * 2 / (h0 + h1);
            if (second > noise)
              density[a][std::size_t(j)] =
                  std::max(density[a][std::size_t(j)], weight * std::sqrt(second / unit_of(f1)));
          }
        }
      }
      density[a].front() = density[a][1];
      density[a].back() = density[a][kProfile - 2];
      double total = 0;
      for (int j = 0; j + 1 < kProfile; ++j)
        total += 0.5 * (density[a][std::size_t(j)] + density[a][std::size_t(j) + 1]) *
                 (s[a][std::size_t(j) + 1] - s[a][std::size_t(j)]);
      bend[a] = total * total / 8;
      // A little density everywhere: the lines did not see all there is.
      const double floor = 0.3 * total / (s[a].back() - s[a].front()) + 1e-9;
      for (double& d : density[a]) d += floor;
    }
    // One knot more where it helps most against what it costs, until the aim is reached or the grid is full.
    std::vector<int> count(axes.size(), 2);
    for (;;) {
      double error = 0, best = 0;
      std::size_t points = 1, choice = 0;
      for (std::size_t a = 0; a < axes.size(); ++a) {
        const auto e = [&](int n) { return bend[a] / double((n - 1) * (n - 1)); };
        error += e(count[a]);
        points *= std::size_t(count[a]);
        const double gain = (e(count[a]) - e(count[a] + 1)) / std::log1p(1. / count[a]);
        if (gain > best) best = gain, choice = a;
      }
      if (axes.empty() || error <= kAimError || best <= 0) break;
      if (points / std::size_t(count[choice]) * std::size_t(count[choice] + 1) >
              (axes.size() > 3 ? kMaxPoints4 : kMaxPoints) ||
          count[choice] >= 128)
        break;
      ++count[choice];
    }
    std::vector<TableAxis> out;
    for (std::size_t a = 0; a < axes.size(); ++a) {
      const Coordinate& c = coordinates_[axes[a]];
      TableAxis axis{c.name, c.range.scale, {}};
      std::vector<double> sum{0};
      for (int j = 0; j + 1 < kProfile; ++j)
        sum.push_back(sum.back() + 0.5 * (density[a][std::size_t(j)] + density[a][std::size_t(j) + 1]) *
                                       (s[a][std::size_t(j) + 1] - s[a][std::size_t(j)]));
      for (int i = 0; i < count[a]; ++i) {
        if (i == 0) {
          axis.values.push_back(c.range.low);
          continue;
        }
        if (i + 1 == count[a]) {
          axis.values.push_back(c.range.high);
          continue;
        }
        const double target = sum.back() * i / (count[a] - 1);
        const std::size_t j = std::min<std::size_t>(
            std::size_t(std::upper_bound(sum.begin(), sum.end(), target) - sum.begin()) - 1, kProfile - 2);
        const double t = (target - sum[j]) / (sum[j + 1] - sum[j]);
        axis.values.push_back(
            std::clamp(from_scale(c.range.scale, s[a][j] + t * (s[a][j + 1] - s[a][j])), c.range.low, c.range.high));
      }
      out.push_back(std::move(axis));
    }
    return out;
  }

  /// Compares at random points: with finer samples the interpolation and the polynomial in the colours, and with
  /// albedo() that the samples tell the truth.
  void prove() {
    struct Proof {
      std::size_t combination;
      Position x;
      std::vector<double> colors;  // 3 each
      double phi;
      bool quadrature;
    };
    std::mt19937_64 random(23);
    std::uniform_real_distribution<double> uniform;
    std::vector<Proof> proofs;
    for (std::size_t c = 0; c < combinations_.size(); ++c) {
      // Later combinations share most grids with the first; what depends on nothing needs no search.
      std::size_t axes = 0;
      for (const AlbedoTerm& t : known_terms(c)) axes = std::max(axes, table_.grids[std::size_t(t.grid)].axes.size());
      const int n = axes == 0 ? 4 : c == 0 ? 64 : 16;
      for (int i = 0; i < n; ++i) {
        Position x = random_position(random);
        freeze_turns(x);
        std::vector<double> colors;
        for (std::size_t k = 0; k < 3 * colors_.size(); ++k) colors.push_back(uniform(random));
        proofs.push_back({c, x, colors, 2 * kPi * uniform(random), i < (c == 0 ? 4 : 1)});
      }
    }
    std::mutex mutex;
    for_all(proofs.size(), [&](std::size_t i) {
      const Proof& p = proofs[i];
      const ParamValues& combination = combinations_[p.combination];
      ParamValues values = values_at(combination, p.x);
      for (std::size_t c = 0; c < colors_.size(); ++c)
        values[colors_[c]] = std::array<double, 3>{p.colors[3 * c], p.colors[3 * c + 1], p.colors[3 * c + 2]};
      const auto brdf = model_.make_double(values);
      const Coefficients all = coefficients(combination, p.x, kAllAzimuths, kProofSamples, 1);
      const Coefficients one = coefficients(combination, p.x, p.phi, kProofSamples, 2);
      // Random colours, different in every channel: proves that channels are apart and the polynomial is one. With the
      // numbers that `one` used, so that noise hides nothing and looks like nothing.
      const MeanAlbedo direct = mean_albedos(*brdf, {brdf.get()}, p.x[0], p.phi, label(values), kProofSamples, 2);
      const auto require_equal = [&](const Rgb<double>& wanted, double error, const char* what) {
        const Rgb<double> got = combine(one, p.colors);
        if (max_abs(wanted - got) <= kSame + error + 10 * one.error) return;
        throw ValueError(
            fmt::format("{}: albedo at cos_theta_o={}, phi_o={}: ({}, {}, {}) from values at colours 0 and 1"
                        " by sample(), expected {} ({}, {}, {}) within {:.1e}",
                        label(values), p.x[0], p.phi, got.r, got.g, got.b, what, wanted.r, wanted.g, wanted.b,
                        kSame + error + 10 * one.error));
      };
      require_equal(direct.scattered[0] + direct.mirror[0], 10 * direct.error,
                    "the albedo at the colours themselves, of degree two at most in each and channel by channel,");
      double error = all.error;
      if (p.quadrature) {
        const Albedo a = albedo(*brdf, p.x[0], p.phi, label(values), kProofOptions);
        require_equal(a.total(), 10 * a.error, "quadrature over directions,");
        error = std::max(error, a.error);
      }
      const Rgb<double> truth = combine(all, p.colors), interpolated = lookup(table_, model_, values, p.x[0]);
      const std::lock_guard lock(mutex);
      table_.error = std::max(table_.error, max_abs(interpolated - truth) / unit_of(truth));
      table_.quadrature = std::max(table_.quadrature, error);
      if (depends_on_azimuth_) table_.anisotropy = std::max(table_.anisotropy, max_abs(combine(one, p.colors) - truth));
      for (const AlbedoTerm& t : known_terms(p.combination)) {
        AlbedoGrid& g = table_.grids[std::size_t(t.grid)];
        const Rgb<double> coefficient = pick(all, {t.mirror, monomial_of(t.colors), {}});
        g.error = std::max(g.error, max_abs(lookup(g, position_in(g, p.x)) - coefficient) / unit_of(coefficient));
      }
    });
  }

  const std::vector<AlbedoTerm>& known_terms(std::size_t combination) const {
    return table_.terms_for(model_, combinations_[combination]);
  }

  std::size_t monomial_of(const std::vector<std::string>& names) const {
    std::size_t monomial = 0;
    for (std::size_t c = 0; c < colors_.size(); ++c)
      monomial += stride(c) * std::size_t(std::count(names.begin(), names.end(), colors_[c]));
    return monomial;
  }

  std::vector<double> position_in(const AlbedoGrid& g, const Position& x) const {
    std::vector<double> out;
    for (const TableAxis& a : g.axes)
      for (std::size_t p = 0; p < coordinates_.size(); ++p)
        if (coordinates_[p].name == a.name) out.push_back(x[p]);
    return out;
  }

  Rgb<double> combine(const Coefficients& c, const std::vector<double>& colors) const {
    Rgb<double> sum(0);
    for (std::size_t k = 0; k < c.scattered.size(); ++k) {
      Rgb<double> product(1);
      for (std::size_t i = 0; i < colors_.size(); ++i)
        for (int j = 0; j < power(k, i); ++j)
          product = product * Rgb<double>(colors[3 * i], colors[3 * i + 1], colors[3 * i + 2]);
      sum += product * (c.scattered[k] + c.mirror[k]);
    }
    return sum;
  }

  void describe() {
    table_.doc =
        "Directional albedo, mirror included: sum over terms of the interpolated grid times the product of the "
        "term's colours. Between knots it is linear on the axis' scale; beyond the ends it is constant.";
    if (depends_on_azimuth_)
      table_.doc += fmt::format(
          " Mean over the azimuth of the view direction; single azimuths differ from it by up to "
          "{:.3f} at the points looked at.",
          table_.anisotropy);
  }

  const Model& model_;
  std::vector<Coordinate> coordinates_;  // the view cosine first
  std::vector<std::string> colors_;
  std::vector<int> degrees_;               // of the polynomial in each colour
  std::vector<ParamValues> combinations_;  // that differ
  std::vector<std::size_t> stands_for_;    // of each combination of choices, the one that is the same
  bool share_channels_ = false;            // channels are alike and apart
  bool depends_on_azimuth_ = false;
  std::vector<char> turns_;       // per coordinate: does nothing but turn the model; empty if nothing does
  std::vector<Position> probes_;  // lines through these tell what a coefficient depends on
  std::vector<Position> places_;  // the probes and more: where equal coefficients must agree
  std::vector<std::vector<Rgb<double>>> signatures_;  // of each grid at each place
  AlbedoTable table_;
};

/// All that a table depends on but the code; a change of the code that changes tables changes the first number.
std::string settings() {
  return fmt::format("1 {} {} {} {} {} {} {} {}", kMinCos, kAimError, kMaxPoints, kMaxPoints4, kSame, kGridSamples,
                     kProofSamples, kProfileNoise);
}

/// What a model computes, to five digits, at random values of all its parameters. The text of its formula would not do:
/// the order of statements in it is that in which a compiler evaluates arguments. Not near the upper ends of ranges,
/// where exponents of a million leave what a library rounds in the fifth digit.
std::string samples_of(const Model& model) {
  constexpr int kPlaces = 64, kPairs = 4;
  constexpr double kUpTo = 0.7;
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> uniform;
  Sequence3 points(1);
  std::string text;
  const auto add = [&](const Rgb<double>& c) { text += fmt::format("{:.5g} {:.5g} {:.5g}\n", c.r, c.g, c.b); };
  for (const Choices& choices : choice_combinations(model.info()))
    for (int place = 0; place < kPlaces; ++place) {
      ParamValues values = with_choices(model.info(), choices);
      for (const ParamInfo& p : model.info().params) {
        if (p.kind == ParamKind::Number) values[p.name] = coordinate(p).at(kUpTo * uniform(random));
        if (p.kind != ParamKind::Color) continue;
        std::array<double, 3> color;
        for (double& c : color) c = uniform(random);
        values[p.name] = color;
      }
      const auto brdf = model.make_double(values);
      for (int i = 0; i < kPairs; ++i) {
        const Vec3<double> a = points.next(), b = points.next();
        const Vec3<double> wo = direction(0.02 + 0.98 * a.x, 2 * kPi * a.y), drawn = brdf->sample(wo, b).wi;
        add(brdf->eval(i % 2 == 0 && drawn.z > 0 ? drawn : direction(b.x, 2 * kPi * b.y), wo));
        add(brdf->mirror(wo));
        add(brdf->transmit(wo));
      }
    }
  return text;
}

std::string hash_of(const Model& model) {
  std::string params;
  for (const ParamInfo& p : model.info().params)
    params += fmt::format("{} {} {} {} {}\n", p.name, int(p.kind), p.min, p.max, fmt::join(p.choices, " "));
  return sha256(fmt::format("{}\n{}\n{}\n{}{}", model.info().name,
                            format_values(model.info(), complete(model.info(), {})), settings(), params,
                            samples_of(model)));
}

std::optional<AxisScale> scale_named(const std::string& name) {
  for (const AxisScale s : {AxisScale::Linear, AxisScale::Log, AxisScale::Log1p})
    if (name == name_of(s)) return s;
  return std::nullopt;
}

}  // namespace

std::size_t AlbedoTable::size() const {
  std::size_t n = 0;
  for (const AlbedoGrid& g : grids) n += g.values.size();
  return n;
}

const std::vector<AlbedoTerm>& AlbedoTable::terms_for(const Model& m, const ParamValues& given) const {
  const ParamValues values = complete(m.info(), given);
  std::size_t index = 0;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const ParamInfo& p = *m.info().param(choices[i]);
    const auto at = std::find(p.choices.begin(), p.choices.end(), std::get<std::string>(values.at(p.name)));
    index = index * std::size_t(choice_sizes[i]) + std::size_t(at - p.choices.begin());
  }
  return terms.at(index);
}

AlbedoTable tabulate_albedo(const Model& model) { return Tabulator(model).run(); }

bool has_albedo_table(const Model& model) {
  const std::vector<ParamInfo>& params = model.info().params;
  return model.has_scatter() ||
         std::count_if(params.begin(), params.end(), [](const auto& p) { return p.kind == ParamKind::Number; }) < 3;
}

std::filesystem::path stored_albedo(const Model& model) {
  return data_dir() / "data" / "albedos" / fmt::format("{}_{}.exr", model.info().name, hash_of(model).substr(0, 16));
}

AlbedoTable albedo_table_of(const Model& model) {
  const std::filesystem::path path = stored_albedo(model);
  if (!std::filesystem::exists(path)) {
    note_missing("stored albedo of " + model.info().name, path.parent_path(), "up to a minute");
    return tabulate_albedo(model);
  }
  AlbedoTable table = read_albedo_exr(path);
  if (table.model != model.info().name)
    input_error("{}: model: expected {}, got {}", path.string(), model.info().name, table.model);
  return table;
}

Rgb<double> lookup(const AlbedoGrid& g, const std::vector<double>& x) {
  // Weights of the two knots on every axis, then the sum over the corners of the cell.
  std::vector<std::size_t> cell;
  std::vector<double> weight;
  for (std::size_t a = 0; a < g.axes.size(); ++a) {
    const TableAxis& axis = g.axes[a];
    const auto above = std::upper_bound(axis.values.begin() + 1, axis.values.end() - 1, x.at(a));
    const std::size_t i = std::size_t(above - axis.values.begin()) - 1;
    const double lo = to_scale(axis.scale, axis.values[i]), hi = to_scale(axis.scale, axis.values[i + 1]);
    const double clamped = std::clamp(x[a], axis.values.front(), axis.values.back());
    cell.push_back(i);
    weight.push_back((to_scale(axis.scale, clamped) - lo) / (hi - lo));
  }
  Rgb<double> sum(0);
  for (std::size_t corner = 0; corner < (std::size_t(1) << cell.size()); ++corner) {
    std::size_t index = 0;
    double w = 1;
    for (std::size_t a = 0; a < cell.size(); ++a) {
      const bool upper = corner >> a & 1;
      index = index * g.axes[a].values.size() + cell[a] + (upper ? 1 : 0);
      w *= upper ? weight[a] : 1 - weight[a];
    }
    const float* v = &g.values[index * std::size_t(g.channels)];
    sum += g.channels == 1 ? Rgb<double>(w * v[0]) : Rgb<double>(w * v[0], w * v[1], w * v[2]);
  }
  return sum;
}

Rgb<double> lookup(const AlbedoTable& table, const Model& m, const ParamValues& given, double cos_theta_o) {
  const ParamValues values = complete(m.info(), given);
  Rgb<double> sum(0);
  for (const AlbedoTerm& t : table.terms_for(m, values)) {
    const AlbedoGrid& g = table.grids.at(std::size_t(t.grid));
    std::vector<double> x;
    for (const TableAxis& a : g.axes)
      x.push_back(a.name == "cos_theta_o" ? cos_theta_o : std::get<double>(values.at(a.name)));
    Rgb<double> product = lookup(g, x);
    for (const std::string& c : t.colors) {
      const auto& v = std::get<std::array<double, 3>>(values.at(c));
      product = product * Rgb<double>(v[0], v[1], v[2]);
    }
    sum += product;
  }
  return sum;
}

void write_albedo_exr(const AlbedoTable& table, const std::filesystem::path& path) {
  using Json = nlohmann::ordered_json;
  std::size_t width = 1;
  int channels = 1;
  for (const AlbedoGrid& g : table.grids) {
    width = std::max(width, g.values.size() / std::size_t(g.channels));
    channels = std::max(channels, g.channels);
  }
  const std::size_t height = std::max<std::size_t>(1, table.grids.size());
  std::vector<float> pixels(width * height * std::size_t(channels), 0.f);
  Json grids = Json::array(), terms = Json::array();
  for (std::size_t row = 0; row < table.grids.size(); ++row) {
    const AlbedoGrid& g = table.grids[row];
    const std::size_t n = g.values.size() / std::size_t(g.channels);
    for (std::size_t i = 0; i < n; ++i)
      for (int c = 0; c < channels; ++c)
        pixels[(row * width + i) * std::size_t(channels) + std::size_t(c)] =
            g.values[i * std::size_t(g.channels) + std::size_t(g.channels == 1 ? 0 : c)];
    Json axes = Json::array();
    for (const TableAxis& a : g.axes)
      axes.push_back({{"name", a.name}, {"scale", name_of(a.scale)}, {"values", a.values}});
    grids.push_back({{"row", row}, {"points", n}, {"channels", g.channels}, {"error", g.error}, {"axes", axes}});
  }
  for (const auto& combination : table.terms) {
    Json list = Json::array();
    for (const AlbedoTerm& t : combination)
      list.push_back({{"mirror", t.mirror}, {"colors", t.colors}, {"grid", t.grid}});
    terms.push_back(list);
  }
  const Json meta{{"model", table.model},
                  {"quantity", "directional albedo"},
                  {"layout", "a row a grid: row-major, first axis slowest, padded with zeros"},
                  {"doc", table.doc},
                  {"error", table.error},
                  {"quadrature_error", table.quadrature},
                  {"anisotropy", table.anisotropy},
                  {"choices", table.choices},
                  {"choice_sizes", table.choice_sizes},
                  {"terms", terms},
                  {"grids", grids}};
  write_table_image({int(width), int(height), channels, std::move(pixels), meta.dump()}, path);
}

AlbedoTable read_albedo_exr(const std::filesystem::path& path) {
  const TableImage image = read_table_image(path);
  AlbedoTable table;
  try {
    const auto meta = nlohmann::json::parse(image.meta);
    table.model = meta.at("model");
    table.doc = meta.at("doc");
    table.error = meta.at("error");
    table.quadrature = meta.at("quadrature_error");
    table.anisotropy = meta.at("anisotropy");
    table.choices = meta.at("choices").get<std::vector<std::string>>();
    table.choice_sizes = meta.at("choice_sizes").get<std::vector<int>>();
    for (const auto& g : meta.at("grids")) {
      AlbedoGrid grid;
      grid.channels = g.at("channels");
      grid.error = g.at("error");
      std::size_t size = 1;
      for (const auto& a : g.at("axes")) {
        const std::string name = a.at("name"), scale = a.at("scale");
        TableAxis axis{name, AxisScale::Linear, a.at("values").get<std::vector<double>>()};
        if (const auto known = scale_named(scale))
          axis.scale = *known;
        else
          input_error("{}: scale of {}: expected linear, log or log1p, got {}", path.string(), name, scale);
        size *= axis.values.size();
        grid.axes.push_back(std::move(axis));
      }
      const std::size_t row = table.grids.size(), all = std::size_t(image.channels);
      if (row >= std::size_t(image.height) || size > std::size_t(image.width) || g.at("points") != size ||
          grid.channels < 1 || grid.channels > image.channels)
        input_error("{}: grids: {} has other numbers than its axes", path.string(), row);
      for (std::size_t i = 0; i < size; ++i)
        for (std::size_t c = 0; c < std::size_t(grid.channels); ++c)
          grid.values.push_back(image.pixels[(row * std::size_t(image.width) + i) * all + c]);
      table.grids.push_back(std::move(grid));
    }
    for (const auto& combination : meta.at("terms")) {
      std::vector<AlbedoTerm> terms;
      for (const auto& t : combination) {
        terms.push_back({t.at("mirror"), t.at("colors").get<std::vector<std::string>>(), t.at("grid")});
        if (terms.back().grid < 0 || std::size_t(terms.back().grid) >= table.grids.size())
          input_error("{}: terms: there is no grid {}", path.string(), terms.back().grid);
      }
      table.terms.push_back(std::move(terms));
    }
  } catch (const nlohmann::json::exception& e) {
    input_error("{}: expected a table of albedos: {}", path.string(), e.what());
  }
  return table;
}

}  // namespace brdfc::measure
