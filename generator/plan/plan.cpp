// SPDX-License-Identifier: GPL-3.0-or-later
#include "plan/plan.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "fit/fit.h"
#include "fit/roles.h"

namespace brdfc::plan {
namespace {

using forms::RepresentationKind;

std::string value_text(const ModelInfo& info, const std::string& name, const ParamValue& value) {
  return format_values(info, {{name, value}});
}

using Needs = std::vector<const MaterialNeed*>;  ///< of one model

/// What all materials of a model set to the same constant.
ParamValues constants(const Needs& needs) {
  ParamValues fixed;
  for (const auto& [name, value] : needs.front()->values)
    if (std::all_of(needs.begin(), needs.end(), [&, &n = name, &v = value](const MaterialNeed* need) {
          return need->values.at(n) == v && !need->textured.count(n);
        }))
      fixed[name] = value;
  return fixed;
}

/// How a parameter differs between the materials of a model or over one of them.
std::string how_it_varies(const std::string& name, const Needs& needs) {
  for (const MaterialNeed* need : needs) {
    if (need->textured.count(name)) return fmt::format("{} varies over {}", name, need->id);
    if (need->values.at(name) != needs.front()->values.at(name))
      return fmt::format("{} and {} have other values of {}", needs.front()->id, need->id, name);
  }
  throw std::logic_error(name + " does not vary");
}

/// Why the materials of a model have no common form made of a fit; nothing if they have one. A fit takes one number
/// that varies along its slider and what it has terms by; a twin takes neither.
std::optional<std::string> unfit(const Needs& needs, RepresentationKind kind) {
  const Model& model = *needs.front()->model;
  const ParamValues fixed = constants(needs);
  // What it lacks at any values comes before what the values are.
  if (!model.has_scatter()) return fit::unfit(model, fixed);
  std::optional<std::string> axis;
  const fit::Roles& roles = fit::roles_of(model, fixed);
  for (const ParamInfo& p : model.info().params) {
    const fit::Role role = roles.of(p.name);
    if (role == fit::Role::Constant || role == fit::Role::Factor) continue;
    if (role == fit::Role::Mixed && kind != RepresentationKind::Twin) continue;
    const std::string how = how_it_varies(p.name, needs);
    if (p.kind != ParamKind::Number || kind == RepresentationKind::Twin) return how;
    if (axis) return fmt::format("{}; {}", *axis, how);
    axis = how;
    const fit::FitAxis range = fit::fit_axis(p);
    for (const MaterialNeed* need : needs) {
      const double value = std::get<double>(need->values.at(p.name));
      if (!need->textured.count(p.name) && (value < range.low || value > range.high))
        return fmt::format("{}, and is {:g} on {}, where a fit runs from {:g} to {:g}", how, value, need->id, range.low,
                           range.high);
    }
  }
  return fit::unfit(model, fixed);
}

/// What one of the materials can be seen from.
Cosines views_of(const Needs& needs) {
  Cosines views = needs.front()->views;
  for (const MaterialNeed* need : needs) views.add(need->views);
  return views;
}

/// Of the material that is off by most. The mean along an axis says little of a material at one end of it.
double fitted_error(const Needs& needs) {
  const Model& model = *needs.front()->model;
  const fit::Fit fit = fit::fit_of(model, constants(needs), views_of(needs));
  double worst = 0;
  for (const MaterialNeed* need : needs) {
    std::optional<double> number;
    if (fit.axis() && !need->textured.count(fit.axis()->parameter))
      number = std::get<double>(need->values.at(fit.axis()->parameter));
    worst = std::max(worst, fit.mean_l1(number));
  }
  return worst;
}

bool fits(const Needs& needs, const Budget& budget) {
  return budget.error && !unfit(needs, RepresentationKind::Fitted) && fitted_error(needs) <= *budget.error;
}

/// A form may exist for some choices only: the one that a material would need; empty if it has all.
std::string lacking(const MaterialNeed& need, RepresentationKind kind) {
  for (const auto& [name, value] : forms::form_values(*need.model, kind))
    if (need.values.at(name) != value) return value_text(need.model->info(), name, value);
  return {};
}

/// One cost for all materials of a model: the extension has one preferred form of it.
std::optional<double> cost_of(const Needs& needs, RepresentationKind kind, const Budget& budget) {
  return budget.costs.of(*needs.front()->model, kind);
}

/// What keeps a form from a time that it may take; empty if it keeps it.
std::string over_time(const Needs& needs, RepresentationKind kind, const Budget& budget) {
  if (!budget.time) return {};
  const auto cost = cost_of(needs, kind, budget);
  if (cost) return *cost <= *budget.time ? "" : fmt::format("costs {:.3g}x, and {:g}x is allowed", *cost, *budget.time);
  return "its cost was not measured";
}

struct Chosen {
  RepresentationKind form;
  std::string why;
};

/// The first of these forms that keeps the time, else the cheapest.
Chosen within_time(const Needs& needs, const std::vector<RepresentationKind>& order, const Budget& budget) {
  std::optional<RepresentationKind> cheapest;
  for (const RepresentationKind kind : order) {
    if (over_time(needs, kind, budget).empty()) return {kind, "the form is left open"};
    const auto cost = cost_of(needs, kind, budget);
    if (cost && (!cheapest || *cost < *cost_of(needs, *cheapest, budget))) cheapest = kind;
  }
  if (!cheapest) return {order.front(), "the form is left open, and no cost is known"};
  return {*cheapest, fmt::format("no form is known to keep {:g}x, this is the cheapest", *budget.time)};
}

/// In place of an aimed form: that one, and where the budget allows it the fitted one.
std::vector<RepresentationKind> aimed_or_fitted(const Needs& needs, const Budget& budget) {
  const bool allowed =
      fits(needs, budget) || (budget.time && !budget.error && !unfit(needs, RepresentationKind::Fitted));
  if (!allowed) return {RepresentationKind::Aimed};
  if (budget.error) return {RepresentationKind::Fitted, RepresentationKind::Aimed};
  return {RepresentationKind::Aimed, RepresentationKind::Fitted};
}

/// That an aimed form has for the lamps there are.
int lamp_slots(const Budget& budget) { return std::min(budget.lamps.value_or(forms::kMaxLamps), forms::kMaxLamps); }

/// What lamps without a size make of an aimed form.
std::string under_aimed(const Budget& budget) {
  const int lamps = std::max(budget.lamps.value_or(0), int(budget.sizeless.size())), slots = lamp_slots(budget);
  if (lamps <= slots) return "as on Blender's own nodes";
  const char* left_out = "as rare bright dots";
  if (slots == 0) return left_out;
  return fmt::format("as on Blender's own nodes while among the {} of up to {} lamps that are aimed at, else {}", slots,
                     lamps, left_out);
}

/// What lamps without a size make of a form, as script/conditions measured it; empty where they do nothing to it.
std::string under_lamps(RepresentationKind kind, const Budget& budget) {
  const std::string shine = kind == RepresentationKind::Aimed     ? under_aimed(budget)
                            : kind == RepresentationKind::Sampled ? "as rare bright dots"
                            : kind == RepresentationKind::Fitted
                                ? "as on Blender's own nodes, on drawn directions as rare bright dots"
                                : "";
  if (shine.empty() || budget.sizeless.empty()) return {};
  return fmt::format("; {} without a size shines {}", fmt::join(budget.sizeless, ", "), shine);
}

Chosen chosen_form(const MaterialNeed& need, const Needs& needs, const Budget& budget) {
  const std::vector<RepresentationKind> known = forms::representations(*need.model);
  if (need.representation == "auto") {
    std::vector<RepresentationKind> order;
    for (RepresentationKind kind : known) {
      if (forms::is_fit(kind) || !lacking(need, kind).empty()) continue;
      // Nothing has to be fitted for a material that has what comes first.
      if (!order.empty() && over_time(needs, order.front(), budget).empty()) break;
      if (kind == RepresentationKind::Aimed)
        for (const RepresentationKind k : aimed_or_fitted(needs, budget)) order.push_back(k);
      else
        order.push_back(kind);
    }
    return within_time(needs, order, budget);
  }
  const RepresentationKind kind = forms::representation_named(need.representation);
  if (forms::is_fit(kind)) {
    if (const auto reason = unfit(needs, kind))
      input_error("material {}: {} has no form '{}' here: {}", need.id, need.model->info().name, need.representation,
                  *reason);
    return {kind, "asked for"};
  }
  if (std::find(known.begin(), known.end(), kind) == known.end())
    input_error("material {}: {} has no form '{}'", need.id, need.model->info().name, need.representation);
  if (const std::string choice = lacking(need, kind); !choice.empty())
    input_error("material {}: {} has the form '{}' only for {}", need.id, need.model->info().name, need.representation,
                choice);
  return {kind, "asked for"};
}

/// Why no material has a form that exists for some: `chosen` by the others.
std::string why_not(RepresentationKind kind, const Needs& needs, const std::vector<Chosen>& chosen,
                    const Budget& budget) {
  const bool fitted = kind == RepresentationKind::Fitted;
  if (forms::is_fit(kind) && !fitted) return "only where it is asked for";
  if (fitted && !budget.error && !budget.time) return "nothing is fitted unasked";
  // A fit is of whatever choices the materials have.
  const auto open = std::find_if(needs.begin(), needs.end(), [&](const MaterialNeed* need) {
    return need->representation == "auto" && (fitted || lacking(*need, kind).empty());
  });
  if (open == needs.end() && !(fitted && budget.offer)) return "the materials ask for another";
  // Of what comes after a form that keeps the budget nothing has to be known.
  const auto rank = [&](RepresentationKind k) {
    switch (k) {
      case RepresentationKind::Exact:
        return 0;
      case RepresentationKind::Aimed:
        return 2;
      case RepresentationKind::Sampled:
        return 4;
      default:
        return budget.error ? 1 : 3;
    }
  };
  const RepresentationKind first =
      open == needs.end() ? RepresentationKind::Aimed : chosen[std::size_t(open - needs.begin())].form;
  if (rank(kind) < rank(first) || !over_time(needs, first, budget).empty()) {
    if (fitted && budget.error && !fits(needs, budget))
      return fmt::format("off by {:.2g} of the light, and {:g} is allowed", fitted_error(needs), *budget.error);
    if (const std::string over = over_time(needs, kind, budget); !over.empty()) return over;
  }
  if (open == needs.end()) return "the materials ask for another";
  return fmt::format("{} comes first", name_of(first));
}

/// Every form, and why it is taken or not.
std::vector<FormChoice> choose_forms(const Needs& needs, const std::vector<Chosen>& chosen, const Budget& budget) {
  const Model& model = *needs.front()->model;
  std::vector<FormChoice> choices;
  const auto consider = [&](RepresentationKind kind, const std::optional<std::string>& missing, bool beside) {
    FormChoice choice{kind, false, true, budget.costs.of(model, kind), "", {}};
    std::map<std::string, std::vector<std::string>> users;  // by their reason
    for (std::size_t i = 0; i < needs.size(); ++i)
      if (chosen[i].form == kind) users[chosen[i].why].push_back(needs[i]->id);
    for (const auto& [reason, ids] : users)
      choice.why += fmt::format("{}{}: {}", choice.why.empty() ? "" : "; ", fmt::join(ids, ", "), reason);
    choice.taken = !users.empty();
    if (!choice.taken && missing) {
      choice.exists = false;
      choice.why = *missing;
    } else if (!choice.taken && beside) {
      choice.taken = true;
      choice.why = "beside the others";
    } else if (!choice.taken) {
      choice.why = why_not(kind, needs, chosen, budget);
    }
    if (kind == RepresentationKind::Fitted && choice.exists && (choice.taken || budget.error || budget.time))
      choice.error = fitted_error(needs);
    if (choice.taken) choice.why += under_lamps(kind, budget);
    choices.push_back(std::move(choice));
  };
  for (const RepresentationKind kind : forms::representations(model)) {
    if (forms::is_fit(kind)) continue;
    std::optional<std::string> missing;
    if (std::all_of(needs.begin(), needs.end(), [&](const auto* need) { return !lacking(*need, kind).empty(); }))
      missing = "only for " + lacking(*needs.front(), kind);
    consider(kind, missing, false);
  }
  const std::optional<std::string> missing = unfit(needs, RepresentationKind::Fitted);
  const bool drawn = std::any_of(chosen.begin(), chosen.end(), [](const Chosen& c) {
    return c.form == RepresentationKind::Aimed || c.form == RepresentationKind::Sampled;
  });
  consider(RepresentationKind::Fitted, missing,
           budget.offer && drawn &&
               within_time(needs, aimed_or_fitted(needs, budget), budget).form == RepresentationKind::Fitted);
  consider(RepresentationKind::Twin, unfit(needs, RepresentationKind::Twin), budget.twin);
  return choices;
}

PlannedModel plan_model(const Model& model, const Needs& needs, const Budget& budget) {
  const ModelInfo& info = model.info();
  PlannedModel plan;
  plan.model = &model;
  std::vector<Chosen> chosen;
  for (const MaterialNeed* need : needs) {
    plan.materials.push_back(need->id);
    chosen.push_back(chosen_form(*need, needs, budget));
    const RepresentationKind before = chosen_form(*need, needs, {}).form, after = chosen.back().form;
    plan.material_forms.push_back(
        {need->id, before, after, cost_of({need}, before, budget), cost_of({need}, after, budget)});
  }
  plan.choices = choose_forms(needs, chosen, budget);
  for (const FormChoice& choice : plan.choices)
    if (choice.taken) plan.forms.push_back(choice.form);
  // What "auto" is in Blender, too.
  std::stable_partition(plan.forms.begin(), plan.forms.end(), [&](RepresentationKind kind) {
    for (std::size_t i = 0; i < needs.size(); ++i)
      if (needs[i]->representation == "auto" && chosen[i].form == kind) return true;
    return false;
  });
  // A fit that an error was asked about is there anyway. Its costs were not measured, so that a time leaves it out.
  const bool aimed = std::find(plan.forms.begin(), plan.forms.end(), RepresentationKind::Aimed) != plan.forms.end();
  if (aimed && (budget.fit_bases || budget.error) && !budget.time && !unfit(needs, RepresentationKind::Fitted))
    plan.base = forms::AimedBase::Fitted;
  for (FormChoice& choice : plan.choices)
    if (choice.form == RepresentationKind::Aimed && plan.base == forms::AimedBase::Fitted) {
      choice.why += "; closures fitted to it are its base";
      choice.cost = std::nullopt;
    }
  plan.max_lamps = lamp_slots(budget);
  if (aimed && plan.max_lamps < forms::kMaxLamps)
    plan.reasons.push_back(plan.max_lamps == 0
                               ? std::string("slots for lamps: the scene has none")
                               : fmt::format("slots for lamps beyond {}: the scene has no more", plan.max_lamps));
  plan.views = views_of(needs);
  std::vector<std::string> unseen;
  const auto degrees = [](double cosine) { return std::acos(cosine) * 180 / kPi; };
  if (const double first = std::floor(degrees(plan.views.high)); first > 0)
    unseen.push_back(fmt::format("below {:g}", first));
  if (const double last = std::ceil(degrees(plan.views.low)); last < 90)
    unseen.push_back(fmt::format("beyond {:g}", last));
  if (!unseen.empty())
    plan.reasons.push_back(fmt::format("view angles {} degrees: never seen", fmt::join(unseen, " and ")));
  plan.fixed = constants(needs);
  for (const ParamInfo& p : info.params)
    if (const auto it = plan.fixed.find(p.name); it != plan.fixed.end())
      plan.reasons.push_back(fmt::format("parameter {}: constant, {}", p.name, value_text(info, p.name, it->second)));
  return plan;
}

}  // namespace

std::vector<PlannedModel> plan_models(const std::vector<std::string>& names) {
  std::vector<PlannedModel> plan;
  const auto add_model = [&](const Model& m) {
    PlannedModel p;
    p.model = &m;
    p.forms = forms::representations(m);
    plan.push_back(p);
  };
  if (names.empty())
    for (const auto& [name, model] : models()) add_model(*model);
  std::set<std::string> named;
  for (const std::string& name : names) {
    add_model(find_model(name));
    if (!named.insert(name).second) input_error("build: --model {}: given twice", name);
  }
  return plan;
}

std::vector<PlannedModel> plan_scene(const std::vector<MaterialNeed>& needs, const Budget& budget) {
  std::map<std::string, std::vector<const MaterialNeed*>> by_model;
  for (const MaterialNeed& need : needs) by_model[need.model->info().name].push_back(&need);
  std::vector<PlannedModel> plan;
  for (const auto& [name, list] : by_model) plan.push_back(plan_model(*list.front()->model, list, budget));
  return plan;
}

}  // namespace brdfc::plan
