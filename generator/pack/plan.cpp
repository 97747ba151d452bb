// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/plan.h"

#include <algorithm>
#include <map>

#include "represent/fit.h"

namespace brdfc {
namespace {

std::string value_text(const ModelInfo& info, const std::string& name, const ParamValue& value) {
  return format_values(info, {{name, value}});
}

/// What all materials of a model set to the same constant.
ParamValues constants(const std::vector<const MaterialNeed*>& needs) {
  ParamValues fixed;
  for (const auto& [name, value] : needs.front()->values)
    if (std::all_of(needs.begin(), needs.end(), [&, &n = name, &v = value](const MaterialNeed* need) {
          return need->values.at(n) == v && !need->textured.count(n);
        }))
      fixed[name] = value;
  return fixed;
}

/// How a parameter differs between the materials of a model or over one of them.
std::string how_it_varies(const std::string& name, const std::vector<const MaterialNeed*>& needs) {
  for (const MaterialNeed* need : needs) {
    if (need->textured.count(name)) return fmt::format("{} varies over {}", name, need->id);
    if (need->values.at(name) != needs.front()->values.at(name))
      return fmt::format("{} and {} have other values of {}", needs.front()->id, need->id, name);
  }
  throw std::logic_error(name + " does not vary");
}

/// Why the materials of a model have no common form made of a fit; nothing if they have one. A fit takes one number
/// that varies along its slider; a twin takes none.
std::optional<std::string> unfit(const std::vector<const MaterialNeed*>& needs, RepresentationKind kind) {
  const Model& model = *needs.front()->model;
  const ParamValues fixed = constants(needs);
  std::optional<std::string> axis;
  const std::set<std::string> may_vary = factors(model, fixed);
  for (const ParamInfo& p : model.info().params) {
    if (fixed.count(p.name) || may_vary.count(p.name)) continue;
    const std::string how = how_it_varies(p.name, needs);
    if (p.kind != ParamKind::Number || kind == RepresentationKind::Twin) return how;
    if (axis) return fmt::format("{}; {}", *axis, how);
    axis = how;
    const FitAxis range = fit_axis(p);
    for (const MaterialNeed* need : needs) {
      const double value = std::get<double>(need->values.at(p.name));
      if (!need->textured.count(p.name) && (value < range.low || value > range.high))
        return fmt::format("{}, and is {:g} on {}, where a fit runs from {:g} to {:g}", how, value, need->id, range.low,
                           range.high);
    }
  }
  return unfit(model, without_factors(model, fixed));
}

double fitted_error(const std::vector<const MaterialNeed*>& needs) {
  return *measure_error(*needs.front()->model, RepresentationKind::Fitted, constants(needs)).relative_l1;
}

bool fits(const std::vector<const MaterialNeed*>& needs, const Budget& budget) {
  return budget.error && !unfit(needs, RepresentationKind::Fitted) && fitted_error(needs) <= *budget.error;
}

RepresentationKind chosen_form(const MaterialNeed& need, const std::vector<const MaterialNeed*>& needs,
                               const Budget& budget) {
  const std::vector<RepresentationKind> known = representations(*need.model);
  // A form may exist for some choices only.
  const auto lacking = [&](RepresentationKind kind) {
    for (const auto& [name, value] : form_choices(*need.model, kind))
      if (need.values.at(name) != value) return fmt::format("{}={}", name, std::get<std::string>(value));
    return std::string();
  };
  if (need.representation == "auto")
    for (RepresentationKind kind : known) {
      if (!lacking(kind).empty()) continue;
      return kind == RepresentationKind::Sampled && fits(needs, budget) ? RepresentationKind::Fitted : kind;
    }
  const RepresentationKind kind = representation_named(need.representation);
  if (is_fit(kind)) {
    if (const auto reason = unfit(needs, kind))
      input_error("material {}: {} has no form '{}' here: {}", need.id, need.model->info().name, need.representation,
                  *reason);
    return kind;
  }
  if (std::find(known.begin(), known.end(), kind) == known.end())
    input_error("material {}: {} has no form '{}'", need.id, need.model->info().name, need.representation);
  if (const std::string choice = lacking(kind); !choice.empty())
    input_error("material {}: {} has the form '{}' only for {}", need.id, need.model->info().name, need.representation,
                choice);
  return kind;
}

PlannedModel plan_model(const Model& model, const std::vector<const MaterialNeed*>& needs, const Budget& budget) {
  const ModelInfo& info = model.info();
  PlannedModel plan;
  plan.model = &model;
  plan.max_lobes = 1;
  std::set<RepresentationKind> used;
  for (const MaterialNeed* need : needs) {
    plan.materials.push_back(need->id);
    used.insert(chosen_form(*need, needs, budget));
    plan.max_lobes = std::max(plan.max_lobes, std::min(need->lobes, kMaxLobes));
  }
  for (const RepresentationKind kind : representations(model)) {
    if (used.count(kind))
      plan.forms.push_back(kind);
    else
      plan.reasons.push_back(fmt::format("form {}: no material uses it", name_of(kind)));
  }
  const bool drawn = used.count(RepresentationKind::Sampled) > 0;
  if (used.count(RepresentationKind::Fitted) || (budget.offer && drawn && fits(needs, budget))) {
    plan.forms.push_back(RepresentationKind::Fitted);
  } else if (budget.error && drawn) {
    const auto reason = unfit(needs, RepresentationKind::Fitted);
    plan.reasons.push_back("form fitted: " + (reason ? *reason
                                              : fits(needs, budget)
                                                  ? std::string("the materials ask for another")
                                                  : fmt::format("off by {:.2g} of the light, and {:g} is allowed",
                                                                fitted_error(needs), *budget.error)));
  }
  if (used.count(RepresentationKind::Controlled)) plan.forms.push_back(RepresentationKind::Controlled);
  if (used.count(RepresentationKind::Twin) || budget.twin) {
    const auto reason = unfit(needs, RepresentationKind::Twin);
    if (reason)
      plan.reasons.push_back("form twin: " + *reason);
    else
      plan.forms.push_back(RepresentationKind::Twin);
  }
  if (used.count(RepresentationKind::Sampled) && plan.max_lobes < kMaxLobes)
    plan.reasons.push_back(fmt::format("lobes {} to {}: no material draws so many", plan.max_lobes + 1, kMaxLobes));
  plan.fixed = constants(needs);
  for (const ParamInfo& p : info.params)
    if (const auto it = plan.fixed.find(p.name); it != plan.fixed.end())
      plan.reasons.push_back(fmt::format("parameter {}: constant, {}", p.name, value_text(info, p.name, it->second)));
  return plan;
}

/// The grid at fixed coordinates: linear between two knots of the axis' scale, as lookup() does.
AlbedoGrid sliced(const AlbedoGrid& grid, const ParamValues& fixed) {
  AlbedoGrid out;
  out.channels = grid.channels;
  out.error = grid.error;
  for (const TableAxis& axis : grid.axes)
    if (!fixed.count(axis.name)) out.axes.push_back(axis);
  std::vector<std::size_t> index(out.axes.size(), 0);
  for (bool more = true; more;) {
    std::vector<double> x;
    std::size_t kept = 0;
    for (const TableAxis& axis : grid.axes) {
      const auto it = fixed.find(axis.name);
      x.push_back(it == fixed.end() ? axis.values[index[kept]] : std::get<double>(it->second));
      if (it == fixed.end()) ++kept;
    }
    const Rgb<double> v = lookup(grid, x);
    out.values.push_back(float(v.r));
    if (grid.channels == 3) {
      out.values.push_back(float(v.g));
      out.values.push_back(float(v.b));
    }
    more = false;
    for (std::size_t a = out.axes.size(); a-- > 0 && !more;) {
      more = ++index[a] < out.axes[a].values.size();
      if (!more) index[a] = 0;
    }
  }
  return out;
}

void multiply(AlbedoGrid& grid, const std::array<double, 3>& color) {
  if (grid.channels == 1 && color[0] == color[1] && color[1] == color[2]) {
    for (float& v : grid.values) v = float(v * color[0]);
    return;
  }
  std::vector<float> values;
  const std::size_t step = std::size_t(grid.channels);
  for (std::size_t i = 0; i < grid.values.size(); i += step)
    for (std::size_t c = 0; c < 3; ++c) values.push_back(float(grid.values[i + (step == 1 ? 0 : c)] * color[c]));
  grid.channels = 3;
  grid.values = std::move(values);
}

bool same_axes(const AlbedoGrid& a, const AlbedoGrid& b) {
  return std::equal(a.axes.begin(), a.axes.end(), b.axes.begin(), b.axes.end(),
                    [](const TableAxis& p, const TableAxis& q) {
                      return p.name == q.name && p.scale == q.scale && p.values == q.values;
                    });
}

void add(AlbedoGrid& sum, AlbedoGrid other) {
  if (sum.channels != other.channels) {
    AlbedoGrid& grey = sum.channels == 1 ? sum : other;
    std::vector<float> values;
    for (const float v : grey.values) values.insert(values.end(), 3, v);
    grey.channels = 3;
    grey.values = std::move(values);
  }
  for (std::size_t i = 0; i < sum.values.size(); ++i) sum.values[i] += other.values[i];
  sum.error += other.error;
}

}  // namespace

std::vector<PlannedModel> plan_models(const std::vector<std::string>& names) {
  std::vector<PlannedModel> plan;
  const auto add_model = [&](const Model& m) {
    PlannedModel p;
    p.model = &m;
    p.forms = representations(m);
    plan.push_back(p);
  };
  if (names.empty())
    for (const auto& [name, model] : models()) add_model(*model);
  for (const std::string& name : names) add_model(find_model(name));
  return plan;
}

std::vector<PlannedModel> plan_scene(const std::vector<MaterialNeed>& needs, const Budget& budget) {
  std::map<std::string, std::vector<const MaterialNeed*>> by_model;
  for (const MaterialNeed& need : needs) by_model[need.model->info().name].push_back(&need);
  std::vector<PlannedModel> plan;
  for (const auto& [name, list] : by_model) plan.push_back(plan_model(*list.front()->model, list, budget));
  return plan;
}

AlbedoTable fold(const AlbedoTable& table, const Model& model, const ParamValues& fixed) {
  if (fixed.empty()) return table;
  AlbedoTable out = table;
  out.grids.clear();
  const std::vector<Choices> combinations = choice_combinations(model.info());
  for (std::size_t i = 0; i < combinations.size(); ++i) {
    std::vector<AlbedoTerm> terms;
    if (admits(model.info(), combinations[i], fixed)) {
      // Terms with the same free colours over the same axes are one.
      std::vector<std::pair<AlbedoTerm, AlbedoGrid>> parts;
      for (const AlbedoTerm& t : table.terms.at(i)) {
        AlbedoTerm term = t;
        AlbedoGrid grid = sliced(table.grids.at(std::size_t(t.grid)), fixed);
        term.colors.clear();
        for (const std::string& c : t.colors) {
          const auto it = fixed.find(c);
          if (it == fixed.end())
            term.colors.push_back(c);
          else
            multiply(grid, std::get<std::array<double, 3>>(it->second));
        }
        const auto like = std::find_if(parts.begin(), parts.end(), [&](const auto& p) {
          return p.first.colors == term.colors && p.first.mirror == term.mirror && same_axes(p.second, grid);
        });
        if (like == parts.end())
          parts.emplace_back(term, std::move(grid));
        else
          add(like->second, std::move(grid));
      }
      for (auto& [term, grid] : parts) {
        if (std::all_of(grid.values.begin(), grid.values.end(), [](float v) { return v == 0; })) continue;
        const auto known = std::find_if(out.grids.begin(), out.grids.end(), [&, &g = grid](const AlbedoGrid& k) {
          return k.channels == g.channels && k.values == g.values && same_axes(k, g);
        });
        term.grid = int(known - out.grids.begin());
        if (known == out.grids.end()) out.grids.push_back(std::move(grid));
        terms.push_back(term);
      }
    }
    out.terms[i] = std::move(terms);
  }
  return out;
}

}  // namespace brdfc
