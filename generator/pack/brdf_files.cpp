// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/brdf_files.h"

#include <fmt/format.h>

#include <set>

#include "core/text.h"
#include "model/choices.h"
#include "pack/addon.h"
#include "pack/recorded_model.h"
#include "print/glsl.h"

namespace brdfc::pack {
namespace {

/// What a parameter is called in the file. BRDF Explorer declares it before the formula, beside variables of its own.
std::string uniform(const std::string& name) {
  static const std::set<std::string> taken = {"brightness", "drawColor", "exposure",     "gamma",        "phiD",
                                              "texCoord",   "useNDotL",  "incidentPhi",  "useLogPlot",   "heightScale",
                                              "colorMask",  "main",      "vtx_position", "incidentTheta"};
  return taken.contains(name) || print::is_glsl_word(name) ? name + "_" : name;
}

std::string declaration(const ParamInfo& p) {
  if (p.kind == ParamKind::Color)
    return fmt::format("color {} {:.9g} {:.9g} {:.9g}\n", uniform(p.name), p.value[0], p.value[1], p.value[2]);
  const ScaledRange slider = p.slider();
  return fmt::format("float {} {:.9g} {:.9g} {:.9g}\n", uniform(p.name), slider.low, slider.high, p.value[0]);
}

std::string text_of(const Model& model, const Choices& choices, const Program& eval, const std::string& library) {
  const ModelInfo& info = model.info();
  std::vector<print::GlslArgument> arguments;
  for (const char* name : {"wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"}) arguments.push_back({name, ExprType::Real});
  std::string declarations, passed;
  for (const ParamInfo& p : info.params) {
    if (p.kind == ParamKind::Choice) continue;
    arguments.push_back({p.name, p.kind == ParamKind::Color ? ExprType::Color : ExprType::Real});
    declarations += declaration(p);
    passed += ", " + uniform(p.name);
  }
  print::Tables tables;
  const std::string function = print::glsl_function(eval, "brdfc_" + info.name, arguments, {ExprType::Color}, tables);
  if (!tables.empty()) return {};
  std::string about = fmt::format("# {}: {}\n# {}\n", info.label, info.paper, info.equations);
  for (const std::string& option : options_of(info, choices)) about += fmt::format("# Choice: {}\n", option);
  return fmt::format(
      "analytic\n\n# SPDX-License-Identifier: GPL-3.0-or-later\n# Made by brdfc " BRDFC_VERSION
      "\n{}\n::begin parameters\n{}::end parameters\n\n::begin shader\n{}\n{}\n"
      "vec3 BRDF(vec3 L, vec3 V, vec3 N, vec3 X, vec3 Y)\n{{\n    return brdfc_{}(dot(L, X), dot(L, Y), dot(L, N), "
      "dot(V, X), dot(V, Y), dot(V, N){});\n}}\n::end shader\n",
      about, declarations, library, function, info.name, passed);
}

}  // namespace

BrdfFiles brdf_files(const std::vector<const Model*>& models, const std::filesystem::path& library) {
  BrdfFiles out;
  const std::string functions = read_text(library);
  for (const Model* model : models) {
    const ModelInfo& info = model->info();
    for (const Choices& choices : choice_combinations(info)) {
      const std::vector<std::string> options = options_of(info, choices);
      const std::string name = join(options, "-");
      const std::string full = name.empty() ? info.name : info.name + "-" + name;
      const RecordedModel recorded = record_model(*model, choices, Precision::Single);
      if (recorded.eval.outputs().empty()) {
        out.left_out.push_back(full + ": an ideal mirror or glass alone");
        continue;
      }
      if (std::string text = text_of(*model, choices, recorded.eval, functions); !text.empty())
        out.texts[full + ".brdf"] = std::move(text);
      else
        out.left_out.push_back(full + ": its formula reads tables");
    }
  }
  return out;
}

}  // namespace brdfc::pack
