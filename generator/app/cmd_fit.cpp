// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc fit: how well a few Cycles closures approximate a model.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/commands.h"
#include "app/f_cos.h"
#include "core/csv.h"
#include "core/text.h"
#include "fit/fit.h"
#include "fit/terms.h"
#include "fit/twin.h"
#include "fit/view.h"
#include "forms/closure_nodes.h"
#include "forms/form.h"
#include "model/stand_in.h"
#include "tables/store.h"

namespace brdfc::app {
namespace {

/// `axis` is the number that the fit runs over, or empty.
void print_errors(const std::vector<fit::ViewError>& errors, const std::string& axis, const std::string& label) {
  std::vector<double> l1;
  for (const fit::ViewError& e : errors) l1.push_back(e.relative_l1);
  std::sort(l1.begin(), l1.end());
  // The q-quantile of the errors over views.
  const auto quantile = [&](double q) { return in_percent(l1[std::size_t(std::ceil(q * double(l1.size()))) - 1]); };
  fmt::print(stderr,
             "{}: error by view, the fraction of the light reflected in other directions: median {} %, 95th percentile "
             "{} %, at most {} %\n",
             label, quantile(0.5), quantile(0.95), quantile(1));
  CsvWriter out((axis.empty() ? "" : axis + ",") + "cos_theta_o,relative_l1,relative_l2,albedo,negative");
  for (const fit::ViewError& e : errors) {
    std::vector<double> row = {e.cos_theta_o, e.relative_l1, e.relative_l2, e.albedo, e.negative};
    if (!axis.empty()) row.insert(row.begin(), e.number);
    out.row(row);
  }
  out.flush();
}

}  // namespace

void add_fit_command(Command app) {
  struct Options {
    std::string model;
    std::vector<std::string> values;
    std::vector<std::string> any;
    std::string over, exr;
    bool pairs = false, twin = false, store = false;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "fit",
      "Error of the fitted form by view angle: Cycles closures whose sum approximates a model with these "
      "parameters.\n"
      "stdout: CSV with header cos_theta_o,relative_l1,relative_l2,albedo,negative: the integral of the\n"
      "absolute difference of f cos divided by the albedo, the same in the L2 norm, the difference of the albedo, and\n"
      "the negative part of f cos.\n"
      "stderr: the median, the 95th percentile and the maximum of relative_l1");
  cmd.add_option("model", o->model, "Model, as in `brdfc list`").required();
  cmd.add_option("values", o->values, "name=value; a colour is three numbers or one");
  cmd.add_option("--over", o->over,
                 "Fit along this Number parameter, over the whole range of its slider, instead of a value. Adds a\n"
                 "column with its value: both ends, and the middle between any two knots of the tables");
  cmd.add_option(
      "--any", o->any,
      "Parameters of which f is a polynomial (degree up to 2 for a colour, 1 for a number), or nearly so for a\n"
      "single colour, for any of their values: closures are fitted to f at a few values, and the worst error is\n"
      "printed");
  cmd.add_flag("--twin", o->twin,
               "Error of the twin instead: Blender's own nodes, whose weights, roughness and tilt depend on the view");
  cmd.add_flag("--pairs", o->pairs,
               "f cos(theta_i) of the closures instead, for pairs of directions.\n"
               "stdin:  CSV with header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z (unit vectors above the surface)\n"
               "stdout: CSV with header f_cos_r,f_cos_g,f_cos_b");
  cmd.add_flag("--store", o->store,
               "With --over: makes the fit again and replaces the stored one in data/fits.\n"
               "With --twin: does the same for the extension's twin, in data/twins")
      .excludes("--pairs");
  cmd.add_option("--exr", o->exr,
                 "Also writes the tables of the closures as a float EXR, with one row per table; the attribute\n"
                 "brdfc:table describes them")
      .excludes("--twin");
  cmd.callback([o] {
    const Model& model = find_model(o->model);
    ParamValues values = complete(model.info(), parse_values(model.info(), o->values));
    // The pairs of directions are evaluated at one value of each parameter.
    const auto superfluous = [&](const std::string& name) {
      return !o->pairs &&
             std::ranges::any_of(o->values, [&](const std::string& value) { return value.starts_with(name + "="); });
    };
    const ParamValues asked = values;
    if (o->store && o->twin) {
      if (!o->values.empty() || !o->over.empty() || !o->any.empty())
        input_error(
            "fit: --twin --store keeps the twin that the extension has: expected neither values nor --over nor --any");
      if (stand_in(model)) {
        fmt::print(stderr, "{}: its twin has no tables to store\n", o->model);
        return;
      }
      values = forms::form("twin")->values(model, {});
      if (const auto reason = fit::unfit(model, values)) input_error("{}: has no twin: {}", o->model, *reason);
      const fit::Twin twin(model, values, fit::Twin::From::Scratch);
      twin.store(model, values);
      print_errors(twin.errors(), twin.axis() ? twin.axis()->parameter : "", o->model);
      return;
    }
    if (o->twin && stand_in(model)) {
      if (!o->over.empty() || !o->any.empty())
        input_error("fit: --twin: {}: its twin follows all parameters: expected neither --over nor --any", o->model);
      if (o->pairs)
        print_f_cos([&](const Vec3<double>& wi, const Vec3<double>& wo) {
          return evaluate(stand_in(model)->bound(model.info(), values, wo), wi, wo);
        });
      else
        print_errors(forms::stand_in_errors(model, values), "", o->model + " " + format_values(model.info(), values));
      return;
    }
    if (o->store && o->over.empty()) input_error("fit: --store: expected --over or --twin beside it");
    if (!o->over.empty()) {
      const ParamInfo* p = model.info().param(o->over);
      if (!p || p->kind != ParamKind::Number)
        input_error("fit: --over {}: expected a parameter of {} that is a number", o->over, o->model);
      if (superfluous(o->over))
        input_error("fit: --over {0} runs over all values of {0}: {0}= is one too many", o->over);
      values.erase(o->over);
    }
    for (const std::string& name : o->any) {
      if (!model.info().param(name)) input_error("fit: --any {}: {} has no such parameter", name, o->model);
      if (superfluous(name)) input_error("fit: --any {0} is for any value of {0}: {0}= is one too many", name);
      values.erase(name);
    }
    if (!o->any.empty() || !o->over.empty()) {
      const fit::Roles& roles = fit::roles_of(model, values);
      for (const std::string& name : o->any)
        if (roles.of(name) != fit::Role::Mixed && roles.of(name) != fit::Role::Factor)
          input_error("fit: --any {}: expected a parameter that f of {} is a polynomial of, with at most {} terms",
                      name, o->model, fit::kMaxTerms);
      if (!o->over.empty() && roles.of(o->over) == fit::Role::Mixed)
        input_error("fit: --over {0}: f of {1} is proportional to it or a sum with it: take --any {0}", o->over,
                    o->model);
      values = roles.fitted();
    }
    // The description of the fit for its messages.
    const auto label = [&] {
      return o->model + " " +
             format_values(model.info(), o->over.empty() ? values : fit::along_axis(model, values).values);
    };
    if (const auto reason = fit::unfit(model, values)) input_error("{}: has no fitted form: {}", o->model, *reason);
    const auto print = [&](const auto& form, const auto& closures) {
      if (o->pairs)
        print_f_cos([&](const Vec3<double>& wi, const Vec3<double>& wo) { return evaluate(closures(wo), wi, wo); });
      else
        print_errors(form.errors(), o->over, label());
    };
    if (o->store) {
      values = fit::along_axis(model, values).values;
      const fit::Fit fit(model, values, fit::Fit::From::Scratch);
      replace_stored(fit::stored_fit(model, values),
                     [&](const std::filesystem::path& path) { fit.store(model, values, path); });
      print_errors(fit.errors(), o->over, label());
    } else if (o->twin) {
      const fit::Twin& twin = fit::twin_of(model, values);
      const fit::Varied<double> varied = fit::varied_of(twin.axis(), twin.terms(), asked);
      print(twin, [&](const Vec3<double>& wo) { return twin.closures(wo, varied); });
    } else {
      const fit::Fit& fit = fit::fit_of(model, values);
      const fit::Varied<double> varied = fit.varied(asked);
      if (!o->exr.empty()) fit.store(model, values, o->exr);
      print(fit, [&](const Vec3<double>& wo) { return fit.closures(wo, varied); });
    }
  });
}

}  // namespace brdfc::app
