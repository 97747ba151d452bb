// SPDX-License-Identifier: GPL-3.0-or-later
#include "plan/plan.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/text.h"
#include "fit/fit.h"
#include "fit/roles.h"

namespace brdfc::plan {
namespace {

using forms::Form;

std::string value_text(const ModelInfo& info, const std::string& name, const ParamValue& value) {
  return format_values(info, {{name, value}});
}

using Needs = std::vector<const MaterialNeed*>;  ///< of one model's materials

/// The parameters that all materials of a model set to the same constant.
ParamValues constants(const Needs& needs) {
  ParamValues fixed;
  for (const auto& [name, value] : needs.front()->values)
    if (std::all_of(needs.begin(), needs.end(), [&, &n = name, &v = value](const MaterialNeed* need) {
          return need->values.at(n) == v && !need->textured.count(n);
        }))
      fixed[name] = value;
  return fixed;
}

/// A clause that says how a parameter differs between the materials of a model, or over one of them.
std::string how_it_varies(const std::string& name, const Needs& needs) {
  for (const MaterialNeed* need : needs) {
    if (need->textured.count(name)) return fmt::format("{} varies over {}", name, need->id);
    if (need->values.at(name) != needs.front()->values.at(name))
      return fmt::format("{} and {} have other values of {}", needs.front()->id, need->id, name);
  }
  throw std::logic_error(name + " does not vary");
}

/// Reason why the materials of a model have no common form of this kind; nullopt if they have one. In a form made of a
/// fit, parameters may vary according to their roles.
std::optional<std::string> unfit(const Needs& needs, const Form& form) {
  const Model& model = *needs.front()->model;
  const ParamValues fixed = constants(needs);
  // Reasons that hold for any values are tested before those that depend on values.
  if (!model.has_scatter() || !form.made_of_fit() || form.serves(model, fit::Role::Open))
    return form.why_not(model, fixed);
  std::optional<std::string> axis;
  const fit::Roles& roles = fit::roles_of(model, fixed);
  for (const ParamInfo& p : model.info().params) {
    const fit::Role role = roles.of(p.name);
    const bool along = p.kind == ParamKind::Number && form.serves(model, fit::Role::Axis);
    if (role == fit::Role::Constant || (form.serves(model, role) && role != fit::Role::Axis)) continue;
    const std::string how = how_it_varies(p.name, needs);
    if (!along) return how;
    if (axis) return fmt::format("{}; {}", *axis, how);
    axis = how;
    const ScaledRange range = p.slider();
    for (const MaterialNeed* need : needs) {
      const double value = std::get<double>(need->values.at(p.name));
      if (!need->textured.count(p.name) && (value < range.low || value > range.high))
        return fmt::format("{}, and is {:g} on {}, where a fit runs from {:g} to {:g}", how, value, need->id, range.low,
                           range.high);
    }
  }
  return form.why_not(model, fixed);
}

/// The cosines from which at least one of the materials can be seen.
Cosines views_of(const Needs& needs) {
  Cosines views = needs.front()->views;
  for (const MaterialNeed* need : needs) views.add(need->views);
  return views;
}

/// The error of the material with the largest error; 0 for a form that states none. The mean along an axis is not used,
/// because it says little about a material at one end of it.
double off_by(const Needs& needs, const Form& form) {
  const Model& model = *needs.front()->model;
  const forms::Setting setting{constants(needs), views_of(needs)};
  const ParamInfo* axis = fit::roles_of(model, setting.fixed).axis();
  double worst = 0;
  for (const MaterialNeed* need : needs) {
    std::optional<double> number;
    if (axis && !need->textured.count(axis->name)) number = std::get<double>(need->values.at(axis->name));
    worst = std::max(worst, form.off_by(model, setting, number).value_or(0));
  }
  return worst;
}

bool keeps_error(const Needs& needs, const Form& form, const Budget& budget) {
  return budget.error && !unfit(needs, form) && off_by(needs, form) <= *budget.error;
}

/// A form may exist for some choices only. Returns the choice that a material would need; empty if it has all of them.
std::string lacking(const MaterialNeed& need, const Form& form) {
  for (const auto& [name, value] : form.values(*need.model, {}))
    if (need.values.at(name) != value) return value_text(need.model->info(), name, value);
  return {};
}

/// All materials of a model have one cost, because the extension has one preferred form of it.
std::optional<double> cost_of(const Needs& needs, const Form& form, const Budget& budget) {
  return budget.costs.of(*needs.front()->model, form);
}

/// Reason why a form exceeds the time limit, as a clause; empty if it does not.
std::string over_time(const Needs& needs, const Form& form, const Budget& budget) {
  if (!budget.time) return {};
  const auto cost = cost_of(needs, form, budget);
  if (cost) return *cost <= *budget.time ? "" : fmt::format("costs {:.3g}x, and {:g}x is allowed", *cost, *budget.time);
  return "its cost was not measured";
}

struct Chosen {
  const Form* form;
  std::string why;
};

/// The first of these forms within the time limit; if there is none, the cheapest.
Chosen within_time(const Needs& needs, const std::vector<const Form*>& order, const Budget& budget) {
  const Form* cheapest = nullptr;
  for (const Form* form : order) {
    if (over_time(needs, *form, budget).empty()) return {form, "the form is left open"};
    const auto cost = cost_of(needs, *form, budget);
    if (cost && (!cheapest || *cost < *cost_of(needs, *cheapest, budget))) cheapest = form;
  }
  if (!cheapest) return {order.front(), "the form is left open, and no cost is known"};
  return {cheapest, fmt::format("no form is known to keep {:g}x, this is the cheapest", *budget.time)};
}

/// The forms that a budget allows in addition to those that always exist. They come before the aimed form if the budget
/// has an error, and after it if the budget has only a time.
std::vector<const Form*> allowed(const Needs& needs, const Budget& budget) {
  std::vector<const Form*> out;
  for (const Form* form : forms::forms())
    if (form->when() == Form::When::WithinBudget &&
        (keeps_error(needs, *form, budget) || (budget.time && !budget.error && !unfit(needs, *form))))
      out.push_back(form);
  return out;
}

/// The forms to consider in place of an aimed form: the aimed form, and others that the budget allows.
std::vector<const Form*> aimed_or_allowed(const Form& aimed, const Needs& needs, const Budget& budget) {
  std::vector<const Form*> out = allowed(needs, budget);
  out.insert(budget.error ? out.end() : out.begin(), &aimed);
  return out;
}

const Form& aiming_form() {
  for (const Form* form : forms::forms())
    if (form->aims()) return *form;
  throw std::logic_error("no form aims at lamps");
}

/// True if closures can be fitted that serve as the base of an aimed form.
bool has_fitted_base(const Needs& needs) {
  return std::ranges::any_of(forms::forms(), [&](const Form* f) { return f->gives_base() && !unfit(needs, *f); });
}

/// The number of lamps that an aimed form has slots for.
int lamp_slots(const Budget& budget) { return std::min(budget.lamps.value_or(forms::kMaxLamps), forms::kMaxLamps); }

/// A clause about the effect of lamps without a size on a form; empty if there is none.
std::string under_lamps(const Form& form, const Budget& budget) {
  const int lamps = std::max(budget.lamps.value_or(0), int(budget.sizeless.size()));
  const std::string shine = form.under_sizeless_lamps(lamps, lamp_slots(budget));
  if (shine.empty() || budget.sizeless.empty()) return {};
  return fmt::format("; {} without a size shines {}", join(budget.sizeless, ", "), shine);
}

/// Reason, as the end of a sentence, why a material can't have a form that it asks for; empty if it can. `needs`: all
/// materials of its model.
std::string refusal(const MaterialNeed& need, const Needs& needs, const Form& form) {
  if (form.made_of_fit()) {
    const auto reason = unfit(needs, form);
    return reason ? fmt::format("has no form '{}' here: {}", form.name(), *reason) : "";
  }
  const std::vector<const Form*> known = forms::forms_of(*need.model);
  if (std::find(known.begin(), known.end(), &form) == known.end()) return fmt::format("has no form '{}'", form.name());
  const std::string choice = lacking(need, form);
  return choice.empty() ? "" : fmt::format("has the form '{}' only for {}", form.name(), choice);
}

void require_form(const MaterialNeed& need, const Needs& needs, const std::string& place) {
  const auto asked = std::ranges::find(forms::forms(), need.representation, &Form::name);
  const std::string why = asked == forms::forms().end() ? fmt::format("has no form '{}'", need.representation)
                                                        : refusal(need, needs, **asked);
  if (why.empty()) return;
  std::vector<std::string> has{"auto"};
  for (const Form* form : forms::forms())
    if (refusal(need, needs, *form).empty()) has.push_back(form->name());
  input_error("{}: {} {}; it has {}", place, need.model->info().name, why, join(has, ", "));
}

Chosen chosen_form(const MaterialNeed& need, const Needs& needs, const Budget& budget) {
  const std::vector<const Form*> known = forms::forms_of(*need.model);
  if (need.representation == "auto") {
    std::vector<const Form*> order;
    for (const Form* form : known) {
      if (form->when() != Form::When::Always || !lacking(need, *form).empty()) continue;
      // If the first form is suitable, nothing has to be fitted for the material.
      if (!order.empty() && over_time(needs, *order.front(), budget).empty()) break;
      if (form->aims())
        for (const Form* f : aimed_or_allowed(*form, needs, budget)) order.push_back(f);
      else
        order.push_back(form);
    }
    return within_time(needs, order, budget);
  }
  require_form(need, needs, "material " + need.id);
  return {forms::form(need.representation), "asked for"};
}

/// Reason why no material uses a form that some could use. `chosen` has the forms that they use.
std::string why_not(const Form& form, const Needs& needs, const std::vector<Chosen>& chosen, const Budget& budget) {
  const bool within_budget = form.when() == Form::When::WithinBudget;
  if (form.when() == Form::When::Asked) return "only where it is asked for";
  if (within_budget && !budget.error && !budget.time) return "nothing is fitted unasked";
  // A fit is for whatever choices the materials have, so these don't exclude it.
  const auto open = std::find_if(needs.begin(), needs.end(), [&](const MaterialNeed* need) {
    return need->representation == "auto" && (within_budget || lacking(*need, form).empty());
  });
  if (open == needs.end() && !(within_budget && budget.offer)) return "the materials ask for another";
  // A form that comes after one within the budget need not be examined. The place is the index among forms(); forms
  // within the budget come just before the aimed form, or just after it.
  const auto place = [&](const Form& f) {
    const auto& all = forms::forms();
    const auto of = [&](const Form& g) { return 2 * (std::find(all.begin(), all.end(), &g) - all.begin()); };
    return f.when() == Form::When::Always ? of(f) : of(aiming_form()) + (budget.error ? -1 : 1);
  };
  const Form& first = open == needs.end() ? aiming_form() : *chosen[std::size_t(open - needs.begin())].form;
  if (place(form) < place(first) || !over_time(needs, first, budget).empty()) {
    if (within_budget && budget.error && !keeps_error(needs, form, budget))
      return fmt::format("off by {:.2g} of the light, and {:g} is allowed", off_by(needs, form), *budget.error);
    if (const std::string over = over_time(needs, form, budget); !over.empty()) return over;
  }
  if (open == needs.end()) return "the materials ask for another";
  return fmt::format("{} comes first", first.name());
}

/// All forms, with the reason why each is taken or not.
std::vector<FormChoice> choose_forms(const Needs& needs, const std::vector<Chosen>& chosen, const Budget& budget) {
  const Model& model = *needs.front()->model;
  std::vector<FormChoice> choices;
  const auto consider = [&](const Form& form, const std::optional<std::string>& missing, bool beside) {
    FormChoice choice{&form, false, true, budget.costs.of(model, form), "", {}};
    std::map<std::string, std::vector<std::string>> users;  // by their reason
    for (std::size_t i = 0; i < needs.size(); ++i)
      if (chosen[i].form == &form) users[chosen[i].why].push_back(needs[i]->id);
    for (const auto& [reason, ids] : users)
      choice.why += fmt::format("{}{}: {}", choice.why.empty() ? "" : "; ", join(ids, ", "), reason);
    choice.taken = !users.empty();
    if (!choice.taken && missing) {
      choice.exists = false;
      choice.why = *missing;
    } else if (!choice.taken && beside) {
      choice.taken = true;
      choice.why = "beside the others";
    } else if (!choice.taken) {
      choice.why = why_not(form, needs, chosen, budget);
    }
    if (form.when() == Form::When::WithinBudget && choice.exists && (choice.taken || budget.error || budget.time))
      choice.error = off_by(needs, form);
    if (choice.taken) choice.why += under_lamps(form, budget);
    choices.push_back(std::move(choice));
  };
  const std::vector<const Form*> known = forms::forms_of(model);
  const bool drawn = std::any_of(chosen.begin(), chosen.end(), [](const Chosen& c) { return c.form->draws(); });
  for (const Form* form : forms::forms()) {
    if (form->when() == Form::When::Always) {
      if (std::find(known.begin(), known.end(), form) == known.end()) continue;
      std::optional<std::string> missing;
      if (std::all_of(needs.begin(), needs.end(), [&](const auto* need) { return !lacking(*need, *form).empty(); }))
        missing = "only for " + lacking(*needs.front(), *form);
      consider(*form, missing, false);
      continue;
    }
    // A form that is not made of a fit exists for all models alike. It is taken only for materials that ask for it, and
    // for those that leave their form open, if they would have none without OSL.
    const bool without_osl = budget.nodes && form->native() && !form->made_of_fit() &&
                             std::any_of(needs.begin(), needs.end(),
                                         [&](const MaterialNeed* need) {
                                           return need->representation == "auto" && lacking(*need, *form).empty();
                                         }) &&
                             !unfit(needs, *form);
    if (form->when() == Form::When::Asked && !form->made_of_fit() && !without_osl &&
        std::none_of(chosen.begin(), chosen.end(), [&](const Chosen& c) { return c.form == form; }))
      continue;
    const bool offered = form->when() == Form::When::WithinBudget && budget.offer && drawn &&
                         within_time(needs, aimed_or_allowed(aiming_form(), needs, budget), budget).form == form;
    consider(*form, unfit(needs, *form),
             offered || without_osl || (form->native() && form->made_of_fit() && budget.twin));
  }
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
    const Form *before = chosen_form(*need, needs, {}).form, *after = chosen.back().form;
    plan.material_forms.push_back(
        {need->id, before, after, cost_of({need}, *before, budget), cost_of({need}, *after, budget)});
  }
  plan.choices = choose_forms(needs, chosen, budget);
  for (const FormChoice& choice : plan.choices)
    if (choice.taken) plan.forms.push_back(choice.form);
  // The first forms of the list are those that "auto" materials use, also in Blender.
  std::stable_partition(plan.forms.begin(), plan.forms.end(), [&](const Form* form) {
    for (std::size_t i = 0; i < needs.size(); ++i)
      if (needs[i]->representation == "auto" && chosen[i].form == form) return true;
    return false;
  });
  // If the budget has an error, the fit is made anyway, so it also serves as a base. Its cost as a base was not
  // measured, so it is not used if the budget has a time.
  const bool aimed = std::any_of(plan.forms.begin(), plan.forms.end(), [](const Form* form) { return form->aims(); });
  if (aimed && (budget.fit_bases || budget.error) && !budget.time && has_fitted_base(needs))
    plan.base = forms::AimedBase::Fitted;
  for (FormChoice& choice : plan.choices)
    if (choice.form->aims() && plan.base == forms::AimedBase::Fitted) {
      choice.why += "; closures fitted to it are its base";
      choice.cost = std::nullopt;
    }
  plan.max_lamps = lamp_slots(budget);
  if (aimed && plan.max_lamps < forms::kMaxLamps)
    plan.reasons.push_back(plan.max_lamps == 0 ? std::string("slots for lamps: the scene has none")
                                               : fmt::format("slots for more than {} lamp{}: the scene has no more",
                                                             plan.max_lamps, plan.max_lamps == 1 ? "" : "s"));
  plan.views = views_of(needs);
  std::vector<std::string> unseen;
  const auto degrees = [](double cosine) { return std::acos(cosine) * 180 / kPi; };
  if (const double first = std::floor(degrees(plan.views.high)); first > 0)
    unseen.push_back(fmt::format("below {:g}", first));
  if (const double last = std::ceil(degrees(plan.views.low)); last < 90)
    unseen.push_back(fmt::format("beyond {:g}", last));
  if (!unseen.empty()) plan.reasons.push_back(fmt::format("view angles {} degrees: never seen", join(unseen, " and ")));
  plan.fixed = constants(needs);
  for (const ParamInfo& p : info.params)
    if (const auto it = plan.fixed.find(p.name); it != plan.fixed.end())
      plan.reasons.push_back(fmt::format("parameter {}: constant, {}", p.name, value_text(info, p.name, it->second)));
  return plan;
}

}  // namespace

void require_form(const MaterialNeed& need, const std::string& place) {
  if (need.representation != "auto") require_form(need, Needs{&need}, place);
}

std::vector<PlannedModel> plan_models(const std::vector<std::string>& names) {
  std::vector<PlannedModel> plan;
  const auto add_model = [&](const Model& m) {
    PlannedModel p;
    p.model = &m;
    p.forms = forms::forms_of(m);
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
