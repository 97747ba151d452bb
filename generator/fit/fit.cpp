// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "fit/file.h"
#include "fit/make.h"

namespace brdfc::fit {

Fit::Fit(const Model& model, const ParamValues& given, From from) {
  const Roles& roles = roles_of(model, given);
  const ParamInfo* number = roles.axis();
  // Along a number, the same fit serves known and open factors and mixed parameters.
  const auto [values, factor] = number ? along_axis(model, roles.fitted()) : Split{roles.fitted(), Rgb<double>(1.0)};
  const auto make = [&, &v = values] { return make_fit(model, v); };
  if (from == From::Scratch) {
    tables_ = make();
  } else {
    const StoreKey key = stored_fit(model, values);
    // A fit without an axis takes only seconds, so there is no message.
    const std::string what = number ? fmt::format("stored fit of {} {} over {}", model.info().name,
                                                  format_values(model.info(), values), number->name)
                                    : std::string();
    tables_ = kept_or_made(
        key, what, "about a minute",
        [&, &v = values](const std::filesystem::path& path) {
          return read_fit(number ? std::optional(fit_axis(*number)) : std::nullopt, roles_of(model, v).terms(),
                          key.hash(), path);
        },
        make,
        [&, &v = values](const FitTables& made, const std::filesystem::path& path) {
          write_fit(made, model, v, key.hash(), path);
        });
  }
  tables_.multiply(factor);
}

Varied<double> Fit::varied(const ParamValues& values) const { return varied_of(tables_.axis, tables_.terms, values); }

void Fit::store(const Model& model, const ParamValues& values, const std::filesystem::path& path) const {
  write_fit(tables_, model, values, axis() ? stored_fit(model, values).hash() : "", path);
}

Fit Fit::knot(const Model& model, const ParamValues& values, double place) const {
  return Fit(make_knot(tables_, model, values, place));
}

std::size_t Fit::size() const {
  std::size_t sum = 0;
  for (const auto& table : tables_.all()) sum += table->values.size();
  return sum;
}

double Fit::mean_l1(const std::optional<double>& number) const {
  std::map<double, std::pair<double, double>> sums;  // by place: the sum of L1, the number of views
  for (const ViewError& e : tables_.errors) {
    sums[e.number].first += e.relative_l1;
    sums[e.number].second += 1;
  }
  auto first = sums.begin(), last = sums.end();
  if (tables_.axis && number) {
    last = sums.lower_bound(*number);
    first = last == sums.begin() ? last : std::prev(last);
    if (last != sums.end()) ++last;
  }
  double worst = 0;
  for (auto it = first; it != last; ++it) worst = std::max(worst, it->second.first / it->second.second);
  return worst;
}

const Fit& fit_of(const Model& model, const ParamValues& values) {
  return made_once<Fit>(model, roles_of(model, values).fitted());
}

Fit fit_of(const Model& model, const ParamValues& values, const Cosines& views) {
  const Fit& whole = fit_of(model, values);
  return views.all() ? whole : whole.cut_to(views);
}

}  // namespace brdfc::fit
