// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/twin.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/parallel.h"
#include "fit/roles.h"
#include "fit/settings.h"
#include "fit/solution.h"
#include "fit/twin_search.h"
#include "measure/formula.h"

namespace brdfc::fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Vec3<double> view_at(int knot) {
  const double z = std::max(double(knot) / (kTwinKnots - 1), kTwinSettings.last_cosine);
  return {std::sqrt(1 - z * z), 0, z};
}

/// A colour from tables of three channels, or of one for all.
Rgb<double> colour(const Channels& channels, const std::vector<double>& at) {
  if (channels.size() == 1) return Rgb<double>(lookup(channels[0], at));
  return {lookup(channels[0], at), lookup(channels[1], at), lookup(channels[2], at)};
}
/// Without parameters: one term of weight 1.
std::vector<Rgb<double>> weights_of_terms(const Terms& terms, const std::map<std::string, Rgb<double>>& values) {
  return terms.parameters.empty() ? std::vector<Rgb<double>>{Rgb<double>(1.0)} : terms.weights(values);
}
/// The sum of the terms, each times its weight.
Rgb<double> colour(const std::vector<Channels>& terms, const std::vector<Rgb<double>>& weights,
                   const std::vector<double>& at) {
  Rgb<double> sum(0.0);
  for (std::size_t t = 0; t < terms.size(); ++t) sum = sum + weights[t] * colour(terms[t], at);
  return sum;
}

/// Places on the axis, evenly spaced from 0 to 1; {0} without an axis.
std::vector<double> even_places(int count) {
  std::vector<double> out;
  for (int i = 0; i < count; ++i) out.push_back(count == 1 ? 0 : double(i) / double(count - 1));
  return out;
}

}  // namespace

Twin::Twin(const Model& model, const ParamValues& given, From from) {
  const Roles& roles = roles_of(model, given);
  if (const ParamInfo* number = roles.axis()) axis_ = fit_axis(*number);
  terms_ = roles.terms();
  // The search is done without the factors, so that a material's twin is the same whether they are known or sockets.
  const auto [values, factor] = without_factors(model, roles.fitted());
  const Along along(model, values, axis_, terms_);
  if (model.has_mirror()) make_mirror(model, along);
  if (from == From::Scratch) {
    make(model, along);
  } else {
    const StoreKey key = stored_twin(model, values);
    // A twin without an axis takes only seconds, so there is no message.
    const std::string what =
        axis_ ? fmt::format("stored twin of {} over {}", model.info().name, axis_->parameter) : std::string();
    *this = kept_or_made(
        key, what, "a minute or two",
        [&](const std::filesystem::path& path) {
          Twin twin = *this;
          twin.read(key.hash(), path);
          return twin;
        },
        [&] {
          Twin twin = *this;
          twin.make(model, along);
          return twin;
        },
        [&, &v = values](const Twin& made, const std::filesystem::path& path) { made.write(model, v, path); });
  }
  multiply(factor);
}

int Twin::places() const { return axis_ ? int(kTwinSettings.places) : 1; }

std::vector<TableAxis> Twin::axes() const {
  std::vector<TableAxis> out;
  if (axis_) out.push_back(even_axis("place_on_axis", places()));
  out.push_back(even_axis("cos_theta_o", kTwinKnots));
  return out;
}

void Twin::make(const Model& model, const Along& along) {
  const std::vector<double> at = even_places(places());
  const std::size_t terms = terms_.terms.size();
  std::vector<Along::At> models;
  for (const double place : at) models.emplace_back(along, place, kTwinSettings.some);
  // The views of all places in one vector, to find out whether they have one tint.
  std::vector<View> row(at.size() * kTwinKnots);
  for_all(row.size(), [&](std::size_t i) {
    row[i] = models[i / kTwinKnots].view(view_at(int(i % kTwinKnots)), int(kTwinSettings.points));
  });
  // A mirror has its own colour.
  if (!model.has_mirror()) tint_ = make_grey(row);
  const Eigen::Index channels = row.front().f.cols() / Eigen::Index(terms);
  const auto view = [&](std::size_t place, std::size_t knot) -> const View& { return row[place * kTwinKnots + knot]; };

  // From the normal downwards, because the search at a view starts with the result of the view above.
  std::vector<std::vector<View>> few(at.size());
  for_all(at.size(), [&](std::size_t place) {
    for (int k = kTwinKnots - 1; k >= 0; k -= int(kTwinSettings.stride)) {
      View v = models[place].view(view_at(k), int(kTwinSettings.few_points), &view(place, std::size_t(k)).lobe);
      if (tint_) v.f = brightest_of_each(v.f);
      few[place].push_back(std::move(v));
    }
  });
  const TwinShapes found = find_twin_shapes(few, mixtures_of(terms_));

  // Rows are places and knots; columns are numbers of the shape, weights by term, channel and closure, and the albedo.
  const Eigen::Index closures_count = Eigen::Index(kTwinFacets + 1), columns = Eigen::Index(terms) * channels;
  MatrixXd shapes(Eigen::Index(row.size()), Eigen::Index(kTwinShape * kTwinFacets)),
      weights(Eigen::Index(row.size()), closures_count * columns), light(Eigen::Index(row.size()), columns);
  for_all(at.size(), [&](std::size_t place) {
    const std::vector<TwinShape>& sought = found.shapes[place];
    MatrixXd x = MatrixXd::Zero(closures_count, columns);
    for (int step = -int(kTwinSettings.lead); step < kTwinKnots; ++step) {
      const auto i = std::size_t(std::abs(step));
      const std::size_t k = kTwinKnots - 1 - i, above = std::min(i / kTwinSettings.stride, sought.size() - 2);
      const double t = double(i) / double(kTwinSettings.stride) - double(above);
      TwinShape shape;
      for (std::size_t j = 0; j < kTwinShape * kTwinFacets; ++j)
        shape.push_back(sought[above][j] * (1 - t) + sought[above + 1][j] * t);
      const View& v = view(place, k);
      const MatrixXd a = twin_columns(*found.dictionary, shape, v);
      const bool first = step == -int(kTwinSettings.lead);
      for (Eigen::Index c = 0; c < columns; ++c)
        x.col(c) = twin_weights(a, v, c, x.col(c), first ? kTwinSettings.slight_ridge : kTwinSettings.ridge);
      const auto index = Eigen::Index(place * kTwinKnots + k);
      shapes.row(index) = Eigen::Map<const VectorXd>(shape.data(), Eigen::Index(shape.size()));
      weights.row(index) = x.reshaped();
      light.row(index) = v.f.transpose() * weights_of(v.points);
    }
  });
  const auto table = [&](const std::string& name, const auto& column) {
    std::vector<double> numbers;
    for (const double number : column) numbers.push_back(rounded(number));
    return make_table(name, axes(), std::move(numbers));
  };
  std::vector<TwinClosure> scattering_parts;
  for (std::size_t j = 0; j <= kTwinFacets; ++j) {
    TwinClosure part{j < kTwinFacets ? found.dictionary->kinds[j] : ClosureKind::Diffuse, {}, {}, {}, {}};
    if (j < kTwinFacets) {
      const auto number = Eigen::Index(kTwinShape * j);
      part.lean = table(fmt::format("lean_of_{}", j), shapes.col(number));
      part.roughness = table(fmt::format("roughness_of_{}", j), shapes.col(number + 1));
      part.spread = table(fmt::format("spread_of_{}", j), shapes.col(number + 2));
    }
    for (Eigen::Index c = 0; c < columns; ++c) {
      if (c % channels == 0) part.weight.emplace_back();
      part.weight.back().push_back(
          table(fmt::format("weight_of_{}_{}", j, c), weights.col(c * closures_count + Eigen::Index(j))));
    }
    scattering_parts.push_back(std::move(part));
  }
  parts_.insert(parts_.begin(), scattering_parts.begin(), scattering_parts.end());
  for (Eigen::Index c = 0; c < columns; ++c) {
    if (c % channels == 0) albedo_.emplace_back();
    albedo_.back().push_back(table(fmt::format("albedo_{}", c), light.col(c)));
  }
  errors_ = along.errors(proof_places(at),
                         [&](const Vec3<double>& wo, const Varied<double>& varied) { return closures(wo, varied); });
}

void Twin::make_mirror(const Model& model, const Along& along) {
  // Each term is a product of x or 1 - x for each mixed parameter, so no weight is negative.
  const std::size_t count = terms_.parameters.size(), corners = std::size_t(1) << count;
  mirror_terms_ = {terms_.parameters, {}};
  for (std::size_t corner = 0; corner < corners; ++corner) {
    Terms::Term& term = mirror_terms_.terms.emplace_back();
    for (std::size_t i = 0; i < count; ++i)
      term.values[terms_.parameters[i]] =
          as_value(*model.info().param(terms_.parameters[i]), Rgb<double>(double(corner >> i & 1)));
    // The factors (1 - x) of the parameters that are 0 in this term, expanded.
    for (std::size_t more = 0; more < corners; ++more) {
      if (more & corner) continue;
      std::vector<int> powers(count);
      int sign = 1;
      for (std::size_t i = 0; i < count; ++i) {
        powers[i] = int((corner | more) >> i & 1);
        if (more >> i & 1) sign = -sign;
      }
      term.polynomial[powers] = sign;
    }
  }
  const std::vector<double> at = even_places(places());
  TwinClosure part{ClosureKind::Reflection, {}, {}, {}, {}};
  for (std::size_t t = 0; t < corners; ++t) {
    std::vector<std::vector<double>> numbers(3);
    for (const double place : at) {
      const measure::BoundModel corner = along.bound(place, mirror_terms_.terms[t].values);
      for (int k = 0; k < kTwinKnots; ++k) {
        const Rgb<double> m = corner.brdf->mirror(view_at(k));
        numbers[0].push_back(rounded(m.r));
        numbers[1].push_back(rounded(m.g));
        numbers[2].push_back(rounded(m.b));
      }
    }
    Channels& channels = part.weight.emplace_back();
    for (std::size_t c = 0; c < 3; ++c)
      channels.push_back(make_table(fmt::format("weight_of_mirror_{}_{}", t, c), axes(), std::move(numbers[c])));
  }
  parts_.push_back(std::move(part));
  // Tests what the nodes rely on: between the corners the mirror is this polynomial, for any values of the factors.
  const ParamValues mixed = along.mixed(0.3);
  ParamValues between = mixed;
  for (const std::string& name : roles_of(model, along.values()).proportional())
    between[name] = as_value(*model.info().param(name), Rgb<double>(0.6));
  const std::vector<Rgb<double>> weights = weights_of_terms(mirror_terms_, colours_of(mixed));
  for (const double place : at) {
    const measure::BoundModel bound = along.bound(place, between);
    for (int k = 0; k < kTwinKnots; ++k) {
      std::vector<double> x;
      if (axis_) x.push_back(place);
      x.push_back(double(k) / (kTwinKnots - 1));
      const Rgb<double> off = bound.brdf->mirror(view_at(k)) - colour(parts_.back().weight, weights, x);
      if (!(max_component(magnitude(off)) <= 1e-5))
        throw std::logic_error(model.info().name + ": a mirror that is no polynomial of the twin's colours");
    }
  }
}

void Twin::multiply(const Rgb<double>& factor) {
  if (tint_) {
    tint_ = *tint_ * factor;
    return;
  }
  if (factor.r == 1 && factor.g == 1 && factor.b == 1) return;
  const auto times = [&](std::vector<Channels>& terms) {
    const double of_channel[] = {factor.r, factor.g, factor.b};
    for (Channels& channels : terms)
      for (std::size_t c = 0; c < channels.size(); ++c) {
        std::vector<double> numbers = channels[c]->values;
        for (double& x : numbers) x *= of_channel[c];
        channels[c] = make_table(channels[c]->name, channels[c]->axes, std::move(numbers));
      }
  };
  for (TwinClosure& part : parts_)
    if (part.kind != ClosureKind::Reflection) times(part.weight);
  times(albedo_);
}

ClosureSum<double> Twin::closures(const Vec3<double>& wo, const Varied<double>& varied) const {
  std::vector<double> at;
  if (axis_) at.push_back(axis_->place(varied.number));
  at.push_back(wo.z);
  const std::vector<Rgb<double>> weights = weights_of_terms(terms_, varied.parameters),
                                 of_mirror = weights_of_terms(mirror_terms_, varied.parameters);
  ClosureSum<double> sum;
  for (const TwinClosure& part : parts_) {
    if (part.kind == ClosureKind::Reflection) {
      sum.emplace_back(part.kind, colour(part.weight, of_mirror, at));
      continue;
    }
    const Rgb<double> weight = colour(part.weight, weights, at) * tint_.value_or(Rgb<double>(1.0));
    if (!has_facets(part.kind)) {
      sum.emplace_back(part.kind, weight);
      continue;
    }
    for (const double side : {1, -1}) {
      sum.push_back(
          twin_facet(part.kind, lookup(part.lean, at), lookup(part.roughness, at), side * lookup(part.spread, at), wo));
      sum.back().weight = weight / 2.0;
    }
  }
  return sum;
}

StoreKey stored_twin(const Model& model, const ParamValues& given) {
  const Roles& roles = roles_of(model, given);
  const ParamValues values = without_factors(model, roles.fitted()).values;
  StoreKey key("twins", model.info().name);
  key.add("values", format_values(model.info(), values));
  if (const ParamInfo* number = roles.axis()) key.add("axis", text_of(fit_axis(*number)));
  key.add("formula", measure::formula_of(model, values));
  return key.add_settings(kTwinSettings).add_settings(kViewSettings);
}

const Twin& twin_of(const Model& model, const ParamValues& values) {
  return made_once<Twin>(model, roles_of(model, values).fitted());
}

}  // namespace brdfc::fit
