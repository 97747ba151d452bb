// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/tabulate_albedo.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <random>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "measure/albedo.h"
#include "measure/albedo_knots.h"
#include "measure/albedo_polynomial.h"
#include "measure/formula.h"
#include "model/choices.h"
#include "tables/algebra.h"

namespace brdfc::measure {

namespace {

constexpr AlbedoOptions kProofOptions{.absolute = kTableSettings.proof_error,
                                      .max_cells = int(kTableSettings.proof_cells),
                                      .witnesses = int(kTableSettings.proof_witnesses)};

/// The combinations of choices that differ in their formula. `stands_for` has, for each combination, the index of the
/// one that equals it.
struct DistinctChoices {
  std::vector<ParamValues> combinations;
  std::vector<std::size_t> stands_for;
};
DistinctChoices distinct_choices(const Model& model) {
  DistinctChoices out;
  const std::vector<Choices> all = choice_combinations(model.info());
  std::map<std::string, std::size_t> seen;
  for (const Choices& c : all) {
    const ParamValues combination = with_choices(model.info(), c);
    // A choice may have no effect beside another one.
    const std::string text = all.size() > 1 ? formula_of(model, combination) : "";
    const auto [it, is_new] = seen.emplace(text, out.combinations.size());
    if (is_new) out.combinations.push_back(combination);
    out.stands_for.push_back(it->second);
  }
  return out;
}

class Tabulator {
 public:
  explicit Tabulator(const Model& model) : Tabulator(model, distinct_choices(model)) {}

  AlbedoTable run() {
    make_probes();
    std::vector<std::vector<AlbedoTerm>> terms;
    for (const ParamValues& combination : combinations_) terms.push_back(terms_of(combination));
    for (const std::size_t c : stands_for_) table_.terms.push_back(terms[c]);
    prove();
    if (table_.error > kTableSettings.max_error)
      throw ValueError(fmt::format("{}: the albedo interpolated in tables is wrong by {:.2g}, expected at most {:g}",
                                   model_.info().name, table_.error, kTableSettings.max_error));
    describe();
    return std::move(table_);
  }

 private:
  Tabulator(const Model& model, const DistinctChoices& choices)
      : model_(model),
        combinations_(choices.combinations),
        stands_for_(choices.stands_for),
        polynomial_(model, combinations_) {
    for (const ParamInfo& p : model.info().params) {
      if (p.kind != ParamKind::Choice) continue;
      table_.choices.push_back(p.name);
      table_.choice_sizes.push_back(int(p.choices.size()));
    }
    table_.model = model.info().name;
  }

  void make_probes() {
    std::mt19937_64 random(7);
    Position defaults{0.5};
    for (std::size_t i = 1; i < polynomial_.coordinates().size(); ++i)
      defaults.push_back(model_.info().param(polynomial_.coordinates()[i].name)->value[0]);
    probes_.push_back(defaults);
    // Probes near the ends of ranges, where peaks occur that random places miss.
    for (std::size_t i = 0; i < kTableSettings.corners; ++i) {
      Position corner;
      for (const Coordinate& c : polynomial_.coordinates()) corner.push_back(c.at(random() & 1 ? 0.97 : 0.03));
      probes_.push_back(corner);
    }
    for (int i = 0; i < 5; ++i) probes_.push_back(polynomial_.random_position(random));
    // Coefficients that are equal elsewhere may differ at grazing views, where lobes lose the light that falls below
    // the surface.
    places_ = probes_;
    for (int i = 0; i < 12; ++i) {
      places_.push_back(polynomial_.random_position(random));
      places_.back()[0] = 0.05;
    }
    for (Position& x : probes_) polynomial_.freeze_turns(x);
    for (Position& x : places_) polynomial_.freeze_turns(x);
  }

  /// A coefficient that needs a grid, and the indices of the coordinates that it depends on.
  struct NewTerm {
    Monomial monomial;
    std::vector<std::size_t> axes;
  };

  std::vector<AlbedoTerm> terms_of(const ParamValues& combination) {
    // Coefficients at the probes, and along each coordinate through each probe.
    constexpr int kSteps = 4;
    std::vector<Coefficients> at_probe(places_.size());
    for_all(places_.size(), [&](std::size_t i) {
      at_probe[i] = polynomial_.coefficients(combination, places_[i], kAllAzimuths, kTableSettings.share_samples);
    });

    std::vector<NewTerm> wanted;
    for (int mirror = 0; mirror < 2; ++mirror)
      for (std::size_t k = 0; k < polynomial_.monomials(); ++k) wanted.push_back({{mirror == 1, k}, {}});
    std::erase_if(wanted, [&](const NewTerm& t) {
      for (const Coefficients& c : at_probe)
        if (max_abs(t.monomial.in(c)) > 1e-9 + 7 * t.monomial.error_in(c)) return false;
      return true;
    });

    std::vector<AlbedoTerm> terms;
    std::vector<NewTerm> missing;
    for (const NewTerm& t : wanted) {
      const int shared = find_shared(t, at_probe, table_error(model_.info(), combination));
      if (shared >= 0)
        terms.push_back({t.monomial.mirror, polynomial_.color_names(t.monomial.index), shared});
      else
        missing.push_back(t);
    }
    if (!missing.empty()) {
      std::vector<std::vector<char>> depends(missing.size(), std::vector<char>(polynomial_.coordinates().size(), 0));
      std::mutex mutex;
      for_all(probes_.size() * polynomial_.coordinates().size() * kSteps, [&](std::size_t job) {
        const std::size_t step = job % kSteps, p = job / kSteps % polynomial_.coordinates().size(),
                          i = job / kSteps / polynomial_.coordinates().size();
        if (polynomial_.only_turns(p)) return;
        Position x = probes_[i];
        x[p] = polynomial_.coordinates()[p].at(double(step) / (kSteps - 1));
        const Coefficients c = polynomial_.coefficients(combination, x, kAllAzimuths);
        const std::lock_guard lock(mutex);
        for (std::size_t t = 0; t < missing.size(); ++t) {
          const Monomial& m = missing[t].monomial;
          const double noise = std::min(7 * (m.error_in(c) + m.error_in(at_probe[i])), kTableSettings.axis_noise);
          if (max_abs(m.in(c)-m.in(at_probe[i])) > kTableSettings.same + noise) depends[t][p] = 1;
        }
      });
      for (std::size_t t = 0; t < missing.size(); ++t)
        for (std::size_t p = 0; p < polynomial_.coordinates().size(); ++p)
          if (depends[t][p]) missing[t].axes.push_back(p);
      while (!missing.empty()) {
        std::vector<NewTerm> group, rest;
        for (const NewTerm& t : missing) (t.axes == missing[0].axes ? group : rest).push_back(t);
        const std::vector<int> grids = tabulate(combination, group, at_probe);
        for (std::size_t i = 0; i < group.size(); ++i)
          terms.push_back({group[i].monomial.mirror, polynomial_.color_names(group[i].monomial.index), grids[i]});
        missing = std::move(rest);
      }
    }
    return terms;
  }

  /// Index of a grid that has this coefficient's values at every place, or -1. A coefficient that a model computes from
  /// tables of its own albedo may be the negative of a grid, or 1 minus a grid, to within `slack`. Such a grid is
  /// derived, not integrated again.
  int find_shared(const NewTerm& t, const std::vector<Coefficients>& at_probe, double slack) {
    const auto same = [&](std::size_t g, double offset, double sign, double tolerance) {
      for (std::size_t i = 0; i < at_probe.size(); ++i) {
        const Rgb<double> wanted = Rgb<double>(offset) + signatures_[g][i] * sign;
        // What is the same coefficient of two choices is mostly computed with the same samples, and equal but for
        // rounding. So where samples are few, it need not be taken for the same because of its noise.
        const double noise = std::min(14 * t.monomial.error_in(at_probe[i]), kTableSettings.share_noise);
        if (max_abs(t.monomial.in(at_probe[i]) - wanted) > tolerance + kTableSettings.same + noise) return false;
      }
      return true;
    };
    for (std::size_t g = 0; g < signatures_.size(); ++g)
      if (same(g, 0, 1, 0)) return int(g);
    if (slack == 0) return -1;
    for (std::size_t g = 0; g < signatures_.size(); ++g)
      for (const double offset : {0., 1.}) {
        if (!same(g, offset, -1, slack)) continue;
        Table grid = table_.grids[g];
        subtract_from(offset, grid);
        return add_grid(std::move(grid), t, at_probe);
      }
    return -1;
  }

  int add_grid(Table grid, const NewTerm& t, const std::vector<Coefficients>& at_probe) {
    table_.grids.push_back(std::move(grid));
    signatures_.emplace_back();
    for (const Coefficients& c : at_probe) signatures_.back().push_back(t.monomial.in(c));
    return int(table_.grids.size()) - 1;
  }

  static std::vector<Monomial> monomials_of(const std::vector<NewTerm>& group) {
    std::vector<Monomial> out;
    for (const NewTerm& t : group) out.push_back(t.monomial);
    return out;
  }

  /// Makes one grid per term of the group, all on the same knots.
  std::vector<int> tabulate(const ParamValues& combination, const std::vector<NewTerm>& group,
                            const std::vector<Coefficients>& at_probe) {
    const std::vector<std::size_t>& axes = group[0].axes;
    const std::vector<TableAxis> knots = place_knots(polynomial_, combination, axes, monomials_of(group), probes_);
    std::size_t points = 1;
    for (const TableAxis& a : knots) points *= a.values.size();
    const std::size_t samples =
        std::clamp<std::size_t>((std::size_t(1) << 22) / points, kTableSettings.grid_samples, 1 << 14);
    std::vector<std::vector<Rgb<double>>> values(group.size(), std::vector<Rgb<double>>(points));
    for_all(points, [&](std::size_t i) {
      Position x = probes_[0];
      std::size_t rest = i;
      for (std::size_t a = axes.size(); a-- > 0;) {
        x[axes[a]] = knots[a].values[rest % knots[a].values.size()];
        rest /= knots[a].values.size();
      }
      const Coefficients c = polynomial_.coefficients(combination, x, kAllAzimuths, samples);
      for (std::size_t t = 0; t < group.size(); ++t) values[t][i] = group[t].monomial.in(c);
    });
    std::vector<int> out;
    for (std::size_t t = 0; t < group.size(); ++t) {
      Table g;
      g.axes = knots;
      double chroma = 0;
      for (const Rgb<double>& v : values[t]) chroma = std::max({chroma, std::abs(v.r - v.g), std::abs(v.r - v.b)});
      g.channels = chroma > 1e-12 ? 3 : 1;
      std::vector<double> numbers;
      for (const Rgb<double>& v : values[t]) {
        numbers.push_back(double(float(v.r)));
        if (g.channels == 3) {
          numbers.push_back(double(float(v.g)));
          numbers.push_back(double(float(v.b)));
        }
      }
      g.values = std::move(numbers);
      out.push_back(add_grid(std::move(g), group[t], at_probe));
    }
    return out;
  }

  /// Verifies the table at random points: finer samples test the interpolation and the polynomial in the colours, and
  /// albedo() tests that the samples are right.
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
      // Later combinations share most grids with the first; where nothing varies, few points suffice.
      std::size_t axes = 0;
      for (const AlbedoTerm& t : known_terms(c)) axes = std::max(axes, table_.grids[std::size_t(t.grid)].axes.size());
      const int n = axes == 0 ? 4 : c == 0 ? 64 : 16;
      for (int i = 0; i < n; ++i) {
        Position x = polynomial_.random_position(random);
        polynomial_.freeze_turns(x);
        std::vector<double> colors;
        for (std::size_t k = 0; k < 3 * polynomial_.colors().size(); ++k) colors.push_back(uniform(random));
        proofs.push_back({c, x, colors, 2 * kPi * uniform(random), i < (c == 0 ? 4 : 1)});
      }
    }
    std::mutex mutex;
    for_all(proofs.size(), [&](std::size_t i) {
      const Proof& p = proofs[i];
      const ParamValues& combination = combinations_[p.combination];
      ParamValues values = polynomial_.values_at(combination, p.x);
      for (std::size_t c = 0; c < polynomial_.colors().size(); ++c)
        values[polynomial_.colors()[c]] =
            std::array<double, 3>{p.colors[3 * c], p.colors[3 * c + 1], p.colors[3 * c + 2]};
      const auto brdf = model_.make_double(values);
      const Coefficients all =
          polynomial_.coefficients(combination, p.x, kAllAzimuths, kTableSettings.proof_samples, 1);
      const Coefficients one = polynomial_.coefficients(combination, p.x, p.phi, kTableSettings.proof_samples, 2);
      // Random colours that differ in every channel show that channels are independent and that the dependence is
      // polynomial. The random numbers are those of `one`, so that noise neither hides a difference nor looks like one.
      const MeanAlbedo direct = mean_albedos(*brdf, {brdf.get()}, p.x[0], p.phi, polynomial_.label(values),
                                             int(kTableSettings.proof_samples), 2);
      const auto require_equal = [&](const Rgb<double>& wanted, double error, const char* what) {
        const Rgb<double> got = polynomial_.combine(one, p.colors);
        if (max_abs(wanted - got) <= kTableSettings.same + error + 10 * one.error) return;
        throw ValueError(fmt::format(
            "{}: run `brdfc check {}`: albedo at cos_theta_o={:.6g}, phi_o={:.6g}: ({:.6g}, {:.6g}, {:.6g})"
            " from values at colours 0 and 1 by sample(), expected {} ({:.6g}, {:.6g}, {:.6g}) within {:.1e}",
            polynomial_.label(values), model_.info().name, p.x[0], p.phi, got.r, got.g, got.b, what, wanted.r, wanted.g,
            wanted.b, kTableSettings.same + error + 10 * one.error));
      };
      require_equal(direct.scattered[0] + direct.mirror[0], 10 * direct.error,
                    "the albedo at the colours themselves, of degree two at most in each and channel by channel,");
      double error = all.error;
      if (p.quadrature) {
        const Albedo a = albedo(*brdf, p.x[0], p.phi, polynomial_.label(values), kProofOptions);
        require_equal(a.total(), 10 * a.error, "quadrature over directions,");
        error = std::max(error, a.error);
      }
      const Rgb<double> truth = polynomial_.combine(all, p.colors),
                        interpolated = lookup(table_, model_, values, p.x[0]);
      const std::lock_guard lock(mutex);
      table_.error = std::max(table_.error, max_abs(interpolated - truth) / unit_of(truth));
      table_.quadrature = std::max(table_.quadrature, error);
      if (polynomial_.depends_on_azimuth())
        table_.anisotropy = std::max(table_.anisotropy, max_abs(polynomial_.combine(one, p.colors) - truth));
      for (const AlbedoTerm& t : known_terms(p.combination)) {
        Table& g = table_.grids[std::size_t(t.grid)];
        const Rgb<double> coefficient = Monomial{t.mirror, polynomial_.monomial_of(t.colors)}.in(all);
        g.error = std::max(g.error, max_abs(interpolate(g, position_in(g, p.x)) - coefficient) / unit_of(coefficient));
      }
    });
  }

  const std::vector<AlbedoTerm>& known_terms(std::size_t combination) const {
    return table_.terms_for(model_, combinations_[combination]);
  }

  std::vector<double> position_in(const Table& g, const Position& x) const {
    std::vector<double> out;
    for (const TableAxis& a : g.axes)
      for (std::size_t p = 0; p < polynomial_.coordinates().size(); ++p)
        if (polynomial_.coordinates()[p].name == a.name) out.push_back(x[p]);
    return out;
  }

  void describe() {
    table_.doc =
        "Directional albedo, mirror included: sum over terms of the interpolated grid times the product of the "
        "term's colours. Between knots it is linear on the axis' scale; beyond the ends it is constant.";
    if (polynomial_.depends_on_azimuth())
      table_.doc += fmt::format(
          " Mean over the azimuth of the view direction; single azimuths differ from it by up to "
          "{:.3f} at the points looked at.",
          table_.anisotropy);
  }

  const Model& model_;
  std::vector<ParamValues> combinations_;
  std::vector<std::size_t> stands_for_;
  AlbedoPolynomial polynomial_;
  std::vector<Position> probes_;                      // lines through these show what a coefficient depends on
  std::vector<Position> places_;                      // the probes and more: where equal coefficients must agree
  std::vector<std::vector<Rgb<double>>> signatures_;  // values of each grid at each place
  AlbedoTable table_;
};

}  // namespace

AlbedoTable tabulate_albedo(const Model& model) { return Tabulator(model).run(); }

}  // namespace brdfc::measure
