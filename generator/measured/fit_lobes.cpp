// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/fit_lobes.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/parallel.h"
#include "core/sequence.h"
#include "fit/view.h"
#include "measured/least_deviations.h"
#include "measured/pairs.h"

namespace brdfc::measured {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kScoringPairs = 1024, kSearchPairs = 2048, kLastPairs = 8192;  ///< pairs of directions
constexpr int kNarrowAtoms = 3;    ///< places where highlights that are narrower than those of the ranges are tried
constexpr std::size_t kTried = 6;  ///< kinds of lobes whose numbers are searched before one is taken
/// Searches begin anew, with smaller steps, where the one before ended, until that helps little.
constexpr int kLeastSearches = 2, kMostSearches = 8;
constexpr double kFirstStep = 0.06, kStepFalls = 0.5, kSearchOn = 0.97;
/// Another lobe must make the error at least so many times smaller; so must one that takes a lobe's place.
constexpr double kWorthLobe = 0.995, kWorthExchange = 0.99;
/// Where the error is larger, lobes are searched for anew, without the model of the strongest highlight: an early lobe
/// may approximate two others so well that no single exchange improves the sum.
constexpr double kSearchAnew = 0.005;
/// A lobe that not every device renders must be so much better than others.
constexpr double kEverywhere = 0.95;
/// Of lobes with which the error differs by no more than this share and this part of the light, the one with fewer
/// numbers is taken.
constexpr double kAlikeLobes = 0.05, kNegligibly = 5e-4;
/// Less is not searched for: tables are not as exact.
constexpr double kNothing = 1e-4;
/// Lobes with less of the sum's light are dropped.
constexpr double kNoLight = 1e-4;
/// Keeping within the light that comes may make the error so much larger, and by this part of the light.
constexpr double kWorthBound = 1.1, kCheap = 1e-3;

/// Pairs as matrices, a column for each channel.
struct Target {
  Pairs pairs;
  MatrixXd data;
  double mean = 0;

  explicit Target(Pairs p) : pairs(std::move(p)), data(Index(pairs.data.size()), 3) {
    for (Index k = 0; k < data.rows(); ++k)
      for (std::size_t c = 0; c < 3; ++c) data(k, Index(c)) = channel(pairs.data[std::size_t(k)], c);
    mean = data.size() ? data.mean() : 0;
  }
};

MatrixXd values_of(const Brdf<double>& brdf, const Pairs& p) {
  MatrixXd out(Index(p.wi.size()), 3);
  for (std::size_t k = 0; k < p.wi.size(); ++k) {
    const Rgb<double> f = brdf.eval(p.wi[k], p.wo[k]);
    out.row(Index(k)) << f.r, f.g, f.b;
  }
  return out;
}

/// A lobe without its colour: the kind, and a place in the range of each of its numbers.
struct Place {
  const LobeKind* kind;
  std::vector<double> t;
};

ParamValues values_at(const Place& place) {
  ParamValues out = place.kind->values;
  for (std::size_t i = 0; i < place.t.size(); ++i)
    for (const std::string& name : place.kind->numbers[i].names)
      out[name] = place.kind->numbers[i].search.at(place.t[i]);
  return out;
}

/// f of a lobe is base + color * slope in each channel.
struct Response {
  MatrixXd base, slope;
};

/// The response of anything that depends on a model and its parameters. Most models are linear in their colour, some
/// have light of their own, and of those with multiple scattering this is the secant to `near`.
template <class Values> Response response(const Place& place, const Rgb<double>& near, const Values& values) {
  const auto brdf = place.kind->model->make_double(values_at(place));
  const auto at = [&](const Rgb<double>& color) {
    brdf->assign(place.kind->color, {color.r, color.g, color.b});
    return MatrixXd(values(*brdf));
  };
  Response out{at(Rgb<double>(0)), at(near)};
  out.slope -= out.base;
  for (std::size_t c = 0; c < 3; ++c) out.slope.col(Index(c)) /= channel(near, c);
  return out;
}
Response response(const Place& place, const Rgb<double>& near, const Pairs& pairs) {
  return response(place, near, [&](const Brdf<double>& brdf) { return values_of(brdf, pairs); });
}

/// Whether the response depends on the colour to which it is the secant.
bool is_curved(const LobeKind& kind, const Pairs& pairs) {
  const Place place{&kind, std::vector<double>(kind.numbers.size(), 0.5)};
  const Response low = response(place, Rgb<double>(0.3), pairs), high = response(place, Rgb<double>(1), pairs);
  return (low.slope - high.slope).cwiseAbs().maxCoeff() > 1e-6 * high.slope.cwiseAbs().maxCoeff();
}

/// Colours of lobes, a row each.
struct Solution {
  MatrixXd colors;
  double error = std::numeric_limits<double>::infinity();
};

/// Sums that a view must not exceed, and the colours' part in them; see bounded().
struct Limits {
  MatrixXd base, slope[3];  ///< base: a row for each view; slope: by channel, rows views, columns lobes
};

class Fitter {
 public:
  Fitter(const Measurement& m, const MeasuredModel& data, const std::vector<LobeKind>& kinds)
      : isotropic_(m.isotropic),
        coarse_(make_pairs(data, kScoringPairs, 1)),
        fine_(make_pairs(data, kSearchPairs, 2)),
        last_(make_pairs(data, kLastPairs, 3)) {
    for (const LobeKind& kind : kinds) {
      if (is_curved(kind, coarse_.pairs)) curved_.push_back(&kind);
      std::vector<double> t(kind.numbers.size());
      add_atoms(kind, t, 0);
      add_narrow_atoms(kind);
    }
    responses_.resize(atoms_.size());
    for_all(atoms_.size(),
            [&](std::size_t i) { responses_[i] = response(atoms_[i], Rgb<double>(0.5), coarse_.pairs); });
    const auto brdf = data.make_double({});
    bounded_ = true;
    for (const double degrees : kAlbedoViews) bounded_ &= albedo(*brdf, degrees).maxCoeff() <= 1.01;
  }

  bool black() const { return !(last_.pairs.light > 0); }

  /// The sum with one more lobe, on the fine pairs; none of the lobes is of the model that is left out, if any.
  std::vector<Place> extended(const std::vector<Place>& places, const Model* without) const {
    std::vector<Place> out = searched(with_best(places, without));
    // Lobes that came first may have stood for several.
    for (std::size_t i = 0; out.size() > 1 && i < out.size(); ++i) {
      std::vector<Place> rest = out;
      rest.erase(rest.begin() + long(i));
      std::vector<Place> other = searched(with_best(rest, without));
      const double now = error(out), then = error(other);
      const bool simpler = numbers(other) < numbers(out) && then < now * (1 + kAlikeLobes) + kNegligibly;
      if (simpler || then < kWorthExchange * now) out = std::move(other);
    }
    return out;
  }

  /// The lobes with their colours, by the final pairs; those without light are left out of `places`.
  LobeSum finished(std::vector<Place>& places) const {
    std::vector<Response> responses;
    Solution s = solved(places, last_, kDeviationRounds, responses);
    if (bounded_) bound(places, responses, s);
    LobeSum out;
    out.error = s.error;
    std::vector<double> light(places.size());
    for (std::size_t i = 0; i < places.size(); ++i)
      for (Index c = 0; c < 3; ++c)
        light[i] +=
            last_.pairs.weight.dot(responses[i].base.col(c) + s.colors(Index(i), c) * responses[i].slope.col(c));
    const double all = std::accumulate(light.begin(), light.end(), 0.);
    std::vector<std::size_t> order(places.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return light[a] > light[b]; });
    std::vector<Place> kept;
    for (const std::size_t i : order) {
      if (!(light[i] > kNoLight * all)) continue;
      kept.push_back(places[i]);
      ParamValues values = values_at(places[i]);
      values[places[i].kind->color] =
          std::array<double, 3>{s.colors(Index(i), 0), s.colors(Index(i), 1), s.colors(Index(i), 2)};
      out.lobes.push_back({places[i].kind->model, std::move(values)});
      out.share.push_back(light[i] / all);
    }
    places = std::move(kept);
    if (out.lobes.empty()) return out;
    out.brightest = brightest_view(*SumModel(out.lobes).make_double({}), isotropic_);
    return out;
  }

 private:
  void add_atoms(const LobeKind& kind, std::vector<double>& t, std::size_t first) {
    if (first == t.size()) {
      atoms_.push_back({&kind, t});
      return;
    }
    const int places = kind.numbers[first].places;
    for (int k = 0; k < places; ++k) {
      t[first] = (k + 0.5) / places;
      add_atoms(kind, t, first + 1);
    }
  }

  /// Beyond the ranges the numbers that have more are tried together.
  void add_narrow_atoms(const LobeKind& kind) {
    if (std::ranges::none_of(kind.numbers, [](const LobeKind::Number& n) { return n.search.narrower(1).has_value(); }))
      return;
    for (int k = 0; k < kNarrowAtoms; ++k) {
      std::vector<double> t;
      for (const LobeKind::Number& n : kind.numbers)
        t.push_back(n.search.narrower((k + 0.5) / kNarrowAtoms).value_or(0.5));
      atoms_.push_back({&kind, std::move(t)});
    }
  }

  static Solution solved(const std::vector<const Response*>& responses, const Target& target, int rounds) {
    const Index count = target.data.rows(), n = Index(responses.size());
    Solution out{MatrixXd(n, 3), 0};
    MatrixXd columns(count, n);
    for (Index c = 0; c < 3; ++c) {
      VectorXd rest = target.data.col(c);
      for (Index j = 0; j < n; ++j) {
        columns.col(j) = responses[std::size_t(j)]->slope.col(c);
        rest -= responses[std::size_t(j)]->base.col(c);
      }
      const VectorXd x = least_deviations(columns, rest, target.pairs.weight, target.mean, VectorXd::Ones(n), rounds);
      out.colors.col(c) = x;
      out.error += target.pairs.weight.dot((rest - columns * x).cwiseAbs());
    }
    out.error /= target.pairs.light;
    return out;
  }

  bool curved(const Place& p) const { return std::ranges::find(curved_, p.kind) != curved_.end(); }

  /// The colours of lobes at places, and the responses that were used.
  Solution solved(const std::vector<Place>& places, const Target& target, int rounds,
                  std::vector<Response>& responses) const {
    std::vector<const Response*> all;
    responses.clear();
    for (const Place& p : places) responses.push_back(response(p, Rgb<double>(0.5), target.pairs));
    for (const Response& r : responses) all.push_back(&r);
    Solution out = solved(all, target, rounds);
    if (std::ranges::none_of(places, [&](const Place& p) { return curved(p); })) return out;
    for (int round = 0; round < 2; ++round) {
      for (std::size_t i = 0; i < places.size(); ++i)
        if (curved(places[i])) responses[i] = response(places[i], near(out.colors.row(Index(i))), target.pairs);
      out = solved(all, target, rounds);
    }
    return out;
  }
  static Rgb<double> near(const Eigen::RowVector3d& color) {
    const auto some = [](double c) { return std::max(c, 0.01); };
    return {some(color[0]), some(color[1]), some(color[2])};
  }

  static std::size_t numbers(const std::vector<Place>& places) {
    std::size_t count = 0;
    for (const Place& p : places) count += p.t.size();
    return count;
  }

  double error(const std::vector<Place>& places) const {
    std::vector<Response> responses;
    return solved(places, fine_, kFewRounds, responses).error;
  }

  /// Searches the numbers of the lobes from `first` on.
  std::vector<Place> searched(std::vector<Place> places, std::size_t first = 0) const {
    std::vector<Response> fixed;
    for (std::size_t i = 0; i < first; ++i) fixed.push_back(response(places[i], Rgb<double>(0.5), fine_.pairs));
    double step = kFirstStep;
    for (int search = 0; search < kMostSearches; ++search, step *= kStepFalls) {
      std::vector<fit::Variable> variables;
      for (std::size_t i = first; i < places.size(); ++i)
        for (std::size_t d = 0; d < places[i].t.size(); ++d) {
          const SearchRange& range = places[i].kind->numbers[d].search;
          variables.push_back({places[i].t[d], range.first(), range.last(), step});
        }
      if (variables.empty()) break;
      const auto set = [&](const std::vector<double>& x) {
        std::size_t k = 0;
        for (std::size_t i = first; i < places.size(); ++i)
          for (double& t : places[i].t) t = x[k++];
      };
      const double before = error(places);
      const std::vector<Place> old = places;
      set(fit::argmin(variables, [&](const std::vector<double>& x) {
        set(x);
        return std::min(error(places), 1e6);
      }));
      const double after = error(places);
      if (!(after < before)) places = old;
      if (first > 0) break;  // these are searched again
      if (search + 1 >= kLeastSearches && !(after < kSearchOn * before)) break;
    }
    return places;
  }

  /// The places with the lobe that helps most.
  std::vector<Place> with_best(const std::vector<Place>& places, const Model* without) const {
    std::vector<Response> present;
    std::vector<double> scores(atoms_.size(), std::numeric_limits<double>::infinity());
    const auto left_out = [&](std::size_t i) { return atoms_[i].kind->model == without; };
    if (!places.empty()) solved(places, coarse_, kFewRounds, present);
    for_all(atoms_.size(), [&](std::size_t i) {
      if (left_out(i)) return;
      std::vector<const Response*> all;
      for (const Response& r : present) all.push_back(&r);
      all.push_back(&responses_[i]);
      scores[i] = solved(all, coarse_, kFewRounds).error / (atoms_[i].kind->everywhere ? 1 : kEverywhere);
    });
    std::vector<std::size_t> order(atoms_.size());
    std::iota(order.begin(), order.end(), 0);
    std::erase_if(order, left_out);
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return scores[i]; });
    struct Candidate {
      std::vector<Place> places;
      double error;
    };
    std::vector<Candidate> candidates;
    for (const std::size_t i : order) {
      const LobeKind* kind = atoms_[i].kind;
      if (candidates.size() >= kTried && !kind->numbers.empty()) continue;
      if (std::ranges::any_of(candidates, [&](const Candidate& c) { return c.places.back().kind == kind; })) continue;
      std::vector<Place> more = places;
      more.push_back(atoms_[i]);
      more = searched(std::move(more), places.size());
      const double e = error(more) / (kind->everywhere ? 1 : kEverywhere);
      candidates.push_back({std::move(more), e});
    }
    // At an end of its range a lobe may be what another one is everywhere: the simpler one says more.
    const double least = std::ranges::min_element(candidates, {}, &Candidate::error)->error;
    std::erase_if(candidates, [&](const Candidate& c) { return c.error > least * (1 + kAlikeLobes) + kNegligibly; });
    return std::ranges::min_element(candidates, {},
                                    [](const Candidate& c) { return std::pair(c.places.back().t.size(), c.error); })
        ->places;
  }

  Eigen::RowVector3d albedo(const Brdf<double>& brdf, double degrees) const {
    const Rgb<double> a = view_albedo(brdf, isotropic_, degrees);
    return {a.r, a.g, a.b};
  }

  /// Finds colours with which no view reflects more light than comes, if that costs little.
  void bound(const std::vector<Place>& places, const std::vector<Response>& responses, Solution& s) const {
    const Index n = Index(places.size()), views = Index(kAlbedoViews.size());
    std::vector<Response> of_views;
    for (std::size_t i = 0; i < places.size(); ++i)
      of_views.push_back(response(places[i], near(s.colors.row(Index(i))), [&](const Brdf<double>& brdf) {
        MatrixXd out(views, 3);
        for (Index v = 0; v < views; ++v) out.row(v) = albedo(brdf, kAlbedoViews[std::size_t(v)]);
        return out;
      }));
    Solution found{s.colors, 0};
    for (Index c = 0; c < 3; ++c) {
      VectorXd left = VectorXd::Ones(views), rest = last_.data.col(c);
      MatrixXd reflected(views, n), columns(rest.size(), n);
      for (Index j = 0; j < n; ++j) {
        left -= of_views[std::size_t(j)].base.col(c), reflected.col(j) = of_views[std::size_t(j)].slope.col(c);
        rest -= responses[std::size_t(j)].base.col(c), columns.col(j) = responses[std::size_t(j)].slope.col(c);
      }
      left = left.cwiseMax(0);
      VectorXd x = found.colors.col(c);
      // Views that are too bright become equations, which outweigh the data.
      std::vector<Index> held;
      for (int round = 0; round < int(kAlbedoViews.size()); ++round) {
        const std::size_t before = held.size();
        for (Index v = 0; v < views; ++v)
          if (reflected.row(v).dot(x) > left[v] + 1e-3 && std::ranges::find(held, v) == held.end()) held.push_back(v);
        if (held.size() == before) break;
        const Index more = Index(held.size());
        MatrixXd a(columns.rows() + more, n);
        VectorXd b(a.rows()), w(a.rows());
        a.topRows(columns.rows()) = columns, b.head(rest.size()) = rest, w.head(rest.size()) = last_.pairs.weight;
        for (Index k = 0; k < more; ++k) {
          a.row(columns.rows() + k) = reflected.row(held[std::size_t(k)]);
          b[rest.size() + k] = left[held[std::size_t(k)]];
          w[rest.size() + k] = 100 * last_.pairs.weight.sum();
        }
        x = least_deviations(a, b, w, last_.mean, VectorXd::Ones(n));
      }
      if (!held.empty()) {
        double scale = 1;
        for (Index v = 0; v < views; ++v)
          if (const double r = reflected.row(v).dot(x); r > left[v]) scale = std::min(scale, left[v] / r);
        x *= scale;
      }
      found.colors.col(c) = x;
      found.error += last_.pairs.weight.dot((rest - columns * x).cwiseAbs());
    }
    found.error /= last_.pairs.light;
    if (found.error <= std::max(kWorthBound * s.error, s.error + kCheap)) s = found;
  }

  bool isotropic_, bounded_ = false;
  Target coarse_, fine_, last_;
  std::vector<const LobeKind*> curved_;
  std::vector<Place> atoms_;
  std::vector<Response> responses_;  ///< of the atoms, for the coarse pairs
};

/// One orthogonal matching pursuit; `found` is called after each lobe.
std::vector<LobeSum> pursued(const Fitter& fitter, const Model* without, std::size_t most,
                             const std::function<void(LobeSum&)>& found) {
  std::vector<LobeSum> out;
  std::vector<Place> places;
  while (out.size() < most && (out.empty() || out.back().error > kNothing)) {
    std::vector<Place> more = fitter.extended(places, without);
    LobeSum sum = fitter.finished(more);
    found(sum);
    // A lobe may have taken the place of two.
    while (!out.empty() && out.size() >= sum.lobes.size() && sum.error < kWorthLobe * out.back().error) out.pop_back();
    if (sum.lobes.empty() || sum.lobes.size() != out.size() + 1) break;
    if (!out.empty() && !(sum.error < kWorthLobe * out.back().error)) break;
    places = std::move(more);
    out.push_back(std::move(sum));
  }
  return out;
}

/// The better sum for each number of lobes, while another lobe helps.
std::vector<LobeSum> better(std::vector<LobeSum> a, std::vector<LobeSum> b) {
  std::vector<LobeSum> out;
  for (std::size_t k = 0; k < std::max(a.size(), b.size()); ++k) {
    const bool second = k >= a.size() || (k < b.size() && b[k].error < a[k].error);
    LobeSum& sum = second ? b[k] : a[k];
    if (k > 0 && !(sum.error < kWorthLobe * out.back().error)) break;
    out.push_back(std::move(sum));
  }
  return out;
}

/// Whether a lobe has the choices of a kind.
bool is_of(const Lobe& lobe, const LobeKind& kind) {
  return lobe.model == kind.model && std::ranges::all_of(kind.values, [&](const auto& v) {
           return !std::holds_alternative<std::string>(v.second) || lobe.values.at(v.first) == v.second;
         });
}

/// The model of the lobe that reflects most of a sum's light among those that are not matte.
const Model* strongest_highlight(const LobeSum& sum, const std::vector<LobeKind>& kinds) {
  for (const Lobe& lobe : sum.lobes)
    for (const LobeKind& kind : kinds)
      if (is_of(lobe, kind) && !kind.numbers.empty() && lobe.model->info().look != Look::Matte) return lobe.model;
  return nullptr;
}

}  // namespace

std::vector<LobeSum> fit_lobes(const Measurement& m, const MeasuredModel& data, const std::vector<LobeKind>& kinds,
                               std::size_t most, const std::function<void(std::size_t)>& progress) {
  require_enough_to_fit(m);
  const auto start = std::chrono::steady_clock::now();
  const Fitter fitter(m, data, kinds);
  std::vector<LobeSum> out;
  if (fitter.black()) return out;
  const std::size_t steps = lobe_steps(most);
  std::size_t done = 0;
  const auto pursue = [&](const Model* without) {
    return pursued(fitter, without, most, [&](LobeSum& sum) {
      sum.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (progress && done < steps) progress(++done);
    });
  };
  out = pursue(nullptr);
  if (!out.empty() && out.back().error > kSearchAnew) {
    const Model* strongest = strongest_highlight(out.back(), kinds);
    const auto remains = [&](const LobeKind& kind) { return kind.model != strongest; };
    done = std::max(done, most);
    if (strongest && std::ranges::any_of(kinds, remains)) out = better(std::move(out), pursue(strongest));
  }
  if (progress) progress(steps);
  return out;
}

}  // namespace brdfc::measured
