// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/fit_models.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "core/sequence.h"
#include "core/text.h"
#include "fit/view.h"
#include "measure/read_parameters.h"
#include "measured/fit_factors.h"
#include "measured/fit_problem.h"
#include "measured/pairs.h"
#include "model/choices.h"

namespace brdfc::measured {
namespace {

constexpr std::size_t kCoarse = 256, kFine = 1024, kFinal = 8192;  ///< pairs of directions
constexpr std::size_t kCurves = 4096;                              ///< pairs for curves, which have more parameters
constexpr int kTries = 24;               ///< places where numbers are tried before a search, for each choice
constexpr std::size_t kModelStarts = 4;  ///< searches begin at the best of them
/// A model that misplaces less than this needs no matte light.
constexpr double kGood = 1e-3;
/// Matte light is taken if it makes the error at least so many times smaller.
constexpr double kWorthMatte = 0.95;
/// Errors that differ by no more than this share, or by this part of the light, are alike.
constexpr double kModelsAlike = 0.05, kNegligible = 5e-4;
constexpr int kTriesBeyond = 4;  ///< places where narrower highlights than those of the sliders are tried
/// A search begins there if they are so many times better than those on the sliders.
constexpr double kWorthBeyond = 0.9;
/// Where it ends beyond, so many other choices are searched from there.
constexpr std::size_t kOtherChoices = 3;
/// A search that ends as near to the end of a slider, as a share of it, goes on beyond.
constexpr double kAtEnd = 0.03;
/// Turned data are worth a word if the error is so many times smaller, and if it is larger than this without.
constexpr double kWorthTurn = 0.9, kTurnFrom = 0.01;
/// Turns by more than 45 degrees are told if the error is so many times smaller, and by kTurnFrom more, than with less.
constexpr double kWorthFarther = 0.8;
/// Axes that differ by less than this are the same, in radians: the estimate is not as exact.
constexpr double kSameAxes = 0.02;

struct Candidate {
  std::size_t problem;
  std::vector<double> t;  ///< places of the searched numbers
  double error;
};

/// A place of each number, the k-th of a sequence that fills the sliders: an additive recurrence with powers of a root,
/// as in core/sequence.h, for any number of dimensions.
std::vector<double> place_of_try(std::size_t numbers, int k) {
  std::vector<double> t(numbers);
  for (std::size_t d = 0; d < numbers; ++d) t[d] = wrap(0.5 + double(k) * std::pow(1.22, -double(d + 1)) * 0.7548);
  return t;
}

/// Places with highlights that are narrower than those of the sliders: of each number, and of all of them, with the
/// others as they are at `t`.
std::vector<std::vector<double>> narrower_places(const std::vector<Searched>& searched, const std::vector<double>& t) {
  std::vector<std::vector<double>> out;
  for (int k = 1; k <= kTriesBeyond; ++k) {
    std::vector<double> all = t;
    std::size_t some = 0;
    for (std::size_t d = 0; d < t.size(); ++d) {
      const auto place = searched[d].range.narrower(double(k) / kTriesBeyond);
      if (!place) continue;
      out.push_back(t);
      out.back()[d] = all[d] = *place;
      ++some;
    }
    if (some > 1) out.push_back(std::move(all));
  }
  return out;
}

/// Searches from a place, on the sliders, and beyond those of whose ends the place is beyond or near.
std::vector<double> search(Problem& problem, std::vector<double> t, bool from_ends,
                           const std::function<double()>& error) {
  const std::vector<Searched>& searched = problem.searched();
  const double near = from_ends ? kAtEnd : 0;
  std::vector<double> low(t.size(), 0), high(t.size(), 1);
  for (std::size_t d = 0; d < t.size(); ++d) {
    if (t[d] < near) low[d] = searched[d].range.first();
    if (t[d] > 1 - near) high[d] = searched[d].range.last();
  }
  for (const double step : {0.08, 0.01}) {
    if (t.empty()) break;
    std::vector<fit::Variable> variables;
    for (std::size_t d = 0; d < t.size(); ++d) variables.push_back({t[d], low[d], high[d], step});
    t = fit::argmin(variables, [&](const std::vector<double>& x) {
      problem.set_numbers(x);
      return std::min(error(), 1e6);
    });
  }
  return t;
}

bool goes_on_beyond(const std::vector<Searched>& searched, const std::vector<double>& t) {
  for (std::size_t d = 0; d < t.size(); ++d) {
    const bool at_low = t[d] >= 0 && t[d] < kAtEnd, at_high = t[d] <= 1 && t[d] > 1 - kAtEnd;
    if ((at_low && searched[d].range.first() < 0) || (at_high && searched[d].range.last() > 1)) return true;
  }
  return false;
}

bool is_beyond(const std::vector<double>& t) {
  return std::ranges::any_of(t, [](double place) { return place < 0 || place > 1; });
}

bool same_numbers(const std::vector<Searched>& a, const std::vector<Searched>& b) {
  return std::ranges::equal(a, b, {}, &Searched::info, &Searched::info);
}

/// The pairs as a BRDF whose tangent is turned by an angle sees them.
Pairs seen_turned(Pairs p, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  for (auto* directions : {&p.wi, &p.wo})
    for (Vec3<double>& w : *directions) w = rotate_z(w, c, s);
  return p;
}

/// The direction in which the data's highlights are widest: the main axis of the half vectors, by the light.
double axis_of(const Pairs& p) {
  double cos2 = 0, sin2 = 0;
  for (std::size_t k = 0; k < p.wi.size(); ++k) {
    const Vec3<double> h = normalize(p.wi[k] + p.wo[k]);
    const double light = p.weight[Eigen::Index(k)] * luminance(p.data[k]);
    cos2 += light * (h.x * h.x - h.y * h.y);
    sin2 += light * 2 * h.x * h.y;
  }
  return std::atan2(sin2, cos2) / 2;
}

/// What is compared: few pairs for tries, more for searches, most for the error that is told.
struct Compared {
  Pairs coarse, fine, last;
  Axes axes;
  double axis;  ///< see axis_of()
};

/// How close a problem comes if the data are turned about the normal, where the tangent is near an angle.
ModelFit::Turned turned_near(Problem& problem, const Compared& data, bool matte, double angle) {
  std::optional<Rgb<double>> added;
  if (matte) added = Rgb<double>(0);
  const auto error = [&](const std::vector<double>& t, const Pairs& pairs) {
    problem.set_numbers(t);
    return problem.solve(pairs, added);
  };
  const std::size_t n = problem.searched().size();
  std::vector<double> best;
  double least = std::numeric_limits<double>::infinity();
  const Pairs coarse = seen_turned(data.coarse, angle);
  for (int k = 1; k <= kTries * int(n); ++k) {
    std::vector<double> t = place_of_try(n, k);
    if (const double e = error(t, coarse); best.empty() || e < least) best = std::move(t), least = e;
  }
  best.push_back(angle);
  for (const double step : {0.08, 0.01}) {
    std::vector<fit::Variable> variables;
    for (std::size_t d = 0; d < n; ++d) variables.push_back({best[d], 0, 1, step});
    variables.push_back({best[n], best[n] - kPi / 4, best[n] + kPi / 4, 2 * step});
    best = fit::argmin(variables, [&](const std::vector<double>& x) {
      return std::min(error({x.begin(), x.end() - 1}, seen_turned(data.fine, x.back())), 1e6);
    });
  }
  angle = best[n];
  best.pop_back();
  // The data have to be turned the other way. Half a turn changes nothing.
  const double last = error(best, seen_turned(data.last, angle));
  return {-std::remainder(angle, kPi), last, problem.values(), added};
}

/// The same for the data's axes. A model may be wide along either of its own.
ModelFit::Turned turned_fit(Problem& problem, const Compared& data, bool matte) {
  const double flat = std::remainder(data.axis, kPi / 2);
  const ModelFit::Turned near = turned_near(problem, data, matte, flat);
  const ModelFit::Turned far = turned_near(problem, data, matte, flat > 0 ? flat - kPi / 2 : flat + kPi / 2);
  return far.error < kWorthFarther * near.error - kTurnFrom ? far : near;
}

/// Sets the parameters that no formula reads under these choices to their defaults.
void reset_unread(const Model& model, ParamValues& values) {
  ParamValues choices;
  for (const ParamInfo& p : model.info().params)
    if (p.kind == ParamKind::Choice) choices[p.name] = values.at(p.name);
  if (choices.empty()) return;
  const std::set<std::string> read = measure::read_parameters(model, choices);
  for (const auto& [name, value] : complete(model.info(), {}))
    if (!choices.count(name) && !read.count(name)) values[name] = value;
}

std::optional<ModelFit> fit_model(const Model& model, const Compared& data, Matte allowed) {
  const auto start = std::chrono::steady_clock::now();
  const ModelInfo& info = model.info();
  std::vector<Problem> problems;
  for (const Choices& choices : choice_combinations(info)) {
    Problem p(model, with_choices(info, choices), data.axes, data.coarse);
    if (!p.through()) problems.push_back(std::move(p));
  }
  std::optional<ModelFit> best;
  std::size_t best_problem = 0;
  for (const bool matte : {false, true}) {
    if (matte && (allowed == Matte::None || info.look == Look::Matte || best->error < kGood)) break;
    const auto extra = [&] { return matte ? std::optional(Rgb<double>(0)) : std::nullopt; };
    std::vector<Candidate> candidates, narrower;
    for (std::size_t i = 0; i < problems.size(); ++i) {
      Problem& problem = problems[i];
      const std::size_t n = problem.searched().size(), first = candidates.size();
      const auto tried = [&](std::vector<double> t) {
        problem.set_numbers(t);
        auto added = extra();
        const double error = problem.solve(data.coarse, added);
        return Candidate{i, std::move(t), error};
      };
      std::vector<double> defaults;
      for (const Searched& r : problem.searched()) defaults.push_back(r.default_place());
      candidates.push_back(tried(std::move(defaults)));
      for (int k = 1; k <= kTries * int(n); ++k) candidates.push_back(tried(place_of_try(n, k)));
      const auto nearest =
          std::ranges::min_element(candidates.begin() + long(first), candidates.end(), {}, &Candidate::error);
      for (std::vector<double>& t : narrower_places(problem.searched(), nearest->t))
        narrower.push_back(tried(std::move(t)));
    }
    std::ranges::stable_sort(candidates, {}, &Candidate::error);
    if (candidates.size() > kModelStarts) candidates.resize(kModelStarts);
    // One more, which takes no other's place: those beyond are near one another.
    const auto narrow = std::ranges::min_element(narrower, {}, &Candidate::error);
    if (narrow != narrower.end() && narrow->error < kWorthBeyond * candidates.front().error)
      candidates.push_back(*narrow);
    const auto finish = [&](Candidate& c) {
      Problem& problem = problems[c.problem];
      problem.set_numbers(c.t);
      auto added = extra();
      c.error = problem.solve(data.last, added);
      if (best && !(c.error < best->error * (matte && !best->matte ? kWorthMatte : 1 - 1e-3))) return;
      best = ModelFit{&model, problem.values(), added, c.error, problem.mirror(), problem.free() + int(matte), 0};
      for (std::size_t d = 0; d < c.t.size(); ++d)
        if (problem.searched()[d].stopped(c.t[d])) best->stopped.push_back(problem.searched()[d].info->name);
      best_problem = c.problem;
    };
    const auto searched_from = [&](const Candidate& c, bool from_ends) {
      Problem& problem = problems[c.problem];
      return search(problem, c.t, from_ends, [&] {
        auto added = extra();
        return problem.solve(data.fine, added);
      });
    };
    for (Candidate& c : candidates) {
      c.t = searched_from(c, false);
      finish(c);
    }
    if (!best) return std::nullopt;
    Candidate nearest = *std::ranges::min_element(candidates, {}, &Candidate::error);
    if (goes_on_beyond(problems[nearest.problem].searched(), nearest.t)) {
      nearest.t = searched_from(nearest, true);
      finish(nearest);
    }
    if (!is_beyond(nearest.t)) continue;
    // The choices were made on the sliders, or at few places beyond.
    std::vector<Candidate> others;
    for (std::size_t i = 0; i < problems.size(); ++i) {
      if (i == nearest.problem || !same_numbers(problems[i].searched(), problems[nearest.problem].searched())) continue;
      problems[i].set_numbers(nearest.t);
      auto added = extra();
      others.push_back({i, nearest.t, problems[i].solve(data.fine, added)});
    }
    std::ranges::stable_sort(others, {}, &Candidate::error);
    if (others.size() > kOtherChoices) others.resize(kOtherChoices);
    for (Candidate& c : others) {
      c.t = searched_from(c, true);
      finish(c);
    }
  }
  Problem& problem = problems[best_problem];
  const bool turns = std::ranges::any_of(problem.searched(), [](const Searched& r) { return is_circle(*r.info); });
  if (data.axes == Axes::Turned && !info.properties.isotropic && !turns && best->error > kTurnFrom &&
      !problem.searched().empty()) {
    const ModelFit::Turned turned = turned_fit(problem, data, best->matte.has_value());
    if (turned.error < kWorthTurn * best->error) best->turned = turned;
  }
  reset_unread(model, best->values);
  best->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return best;
}

/// What the ranking goes by: no data show the model's ideal mirror, so its light is misplaced as well.
double distance(const ModelFit& f) { return f.error + f.mirror; }

}  // namespace

ParamValues rounded(ParamValues values) {
  const auto digits = [](double& v) { v = std::stod(fmt::format("{:.4g}", v)); };
  for (auto& [name, value] : values) {
    if (auto* number = std::get_if<double>(&value)) digits(*number);
    if (auto* color = std::get_if<std::array<double, 3>>(&value)) std::ranges::for_each(*color, digits);
  }
  return values;
}

std::optional<std::string> order_of_fits(const std::vector<ModelFit>& fits) {
  // Errors as they are printed.
  const auto percent = [](double share) { return std::lround(share * 1e4); };
  bool mirrors = false, parameters = false;
  for (std::size_t i = 0; i < fits.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (percent(fits[i].error) < percent(fits[k].error))
        (has_mirror(fits[i]) && distance(fits[i]) > distance(fits[k]) ? mirrors : parameters) = true;
  std::vector<const char*> why;
  if (mirrors) why.push_back("the order counts the light of a mirror as an error, which the column does not");
  if (parameters) why.push_back("of models that come about as close, those with fewer parameters stand first");
  if (why.empty()) return std::nullopt;
  return join(why, "; ");
}

std::string remarks(const ModelFit& f) {
  std::string out;
  if (!f.stopped.empty()) out += fmt::format("; stopped at the end of the range of {}", join(f.stopped, ", "));
  if (f.turned)
    out += fmt::format("; {} % if the data were turned by {:.1f} degrees about the normal", in_percent(f.turned->error),
                       f.turned->angle * 180 / kPi);
  return out;
}

std::vector<ModelFit> fit_models(const Measurement& m, const MeasuredModel& data,
                                 const std::vector<const Model*>& models, Matte matte,
                                 const std::function<void(const Model&, std::size_t done)>& progress) {
  if (models.empty()) return {};
  require_enough_to_fit(m);
  Compared all{make_pairs(data, kCoarse, 1), make_pairs(data, kFine, 2), make_pairs(data, kFinal, 3), Axes::None, 0};
  if (!m.isotropic) {
    all.axis = axis_of(all.last);
    all.axes = std::abs(std::remainder(all.axis, kPi / 2)) < kSameAxes ? Axes::Aligned : Axes::Turned;
  }
  std::vector<std::optional<ModelFit>> found(models.size());
  std::atomic<std::size_t> done{0};
  for_all(models.size(), [&](std::size_t i) {
    if (const auto curves = curve_roles(*models[i]))
      found[i] = fit_factors(*models[i], *curves, m.isotropic, all.fine, make_pairs(data, kCurves, 4), all.last);
    else if (models[i]->has_scatter())
      found[i] = fit_model(*models[i], all, matte);
    if (progress) progress(*models[i], ++done);
  });
  std::vector<ModelFit> out;
  for (auto& f : found)
    if (f) out.push_back(std::move(*f));
  std::ranges::stable_sort(out, {}, distance);
  // A model that contains another one comes as close, whatever it is: the simpler one says more.
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto begin = out.begin() + long(i);
    const auto end = std::find_if(begin, out.end(), [&](const ModelFit& f) {
      return distance(f) > distance(*begin) * (1 + kModelsAlike) + kNegligible;
    });
    const auto simplest = std::ranges::min_element(begin, end, {}, &ModelFit::found);
    std::rotate(begin, simplest, simplest + 1);
  }
  return out;
}

}  // namespace brdfc::measured
