// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/standalone.h"

#include <algorithm>
#include <cctype>
#include <functional>
#include <memory>
#include <set>

#include "forms/choice_switch.h"
#include "forms/form.h"
#include "measure/stored_albedo.h"
#include "model/choices.h"
#include "print/osl_library.h"
#include "print/osl_program.h"
#include "print/osl_statements.h"
#include "print/osl_text.h"
#include "print/reserved.h"
#include "trace/program.h"

namespace brdfc::pack {
namespace {

std::string arguments(const ModelInfo& info) {
  std::string out;
  for (const ParamInfo& p : info.params) {
    const char* type = p.kind == ParamKind::Number ? "float" : p.kind == ParamKind::Color ? "color" : "int";
    out += fmt::format("{}{} {}", out.empty() ? "" : ", ", type, p.name);
  }
  return out;
}

/// Records the outputs of a model with its choices bound.
using Outputs = std::function<void(const Brdf<Expr>&, Program&)>;

/// Statements that assign the outputs, for every combination of choices.
print::Statements statements(const Model& model, const Outputs& outputs) {
  const std::set<std::string>& own = print::osl_function_words();
  std::vector<std::string> taken(own.begin(), own.end());
  for (const ParamInfo& p : model.info().params) taken.push_back(p.name);
  const ParamValues none;
  forms::ChoiceSwitch by_choice(model.info(), none);
  for (const Choices& choices : choice_combinations(model.info())) {
    Recorder recorder;
    const std::unique_ptr<Brdf<Expr>> brdf = model.record(with_choices(model.info(), choices));
    Program program;
    outputs(*brdf, program);
    by_choice.add(choices, print::run_with_arrays(std::make_shared<const Program>(std::move(program)), taken));
  }
  return by_choice.statements();
}

std::string components(const std::string& name) {
  return fmt::format("    float {0}_x = {0}[0], {0}_y = {0}[1], {0}_z = {0}[2];\n", name);
}

struct Function {
  std::string doc, type, name, arguments, before;
  print::Statements body;
  std::string result;
};

std::string text_of(const Model& model, const Function& f) {
  const std::string own = arguments(model.info());
  return print::comment(f.doc) +
         fmt::format("{} brdfc_{}_{}({}{}{})\n{{\n", f.type, model.info().name, f.name, f.arguments,
                     f.arguments.empty() || own.empty() ? "" : ", ", own) +
         f.before + print::osl_statements(f.body, 1).text + fmt::format("    return {};\n}}\n", f.result);
}

std::string guarded(const std::string& name, const std::string& text) {
  std::string guard = fmt::format("BRDFC_{}_H", name);
  for (char& c : guard) c = char(std::toupper(static_cast<unsigned char>(c)));
  return fmt::format("#ifndef {0}\n#define {0}\n\n{1}\n#endif\n", guard, text);
}

std::string choices_doc(const ModelInfo& info) {
  std::string out;
  for (const ParamInfo& p : info.params) {
    if (p.kind != ParamKind::Choice) continue;
    std::string list;
    for (std::size_t i = 0; i < p.choices.size(); ++i) list += fmt::format("{}{} {}", i ? ", " : "", i, p.choices[i]);
    out += print::comment(fmt::format("{}: {}", p.name, list));
  }
  return out;
}

/// The exact closures if they equal the model for all choices, otherwise the aimed form without lamps.
std::string shader_of(const Model& model) {
  const std::vector<const forms::Form*> forms = forms::forms_of(model);
  // The preferred form that exists for all choices: an exact form for some choices only would remove the other choices.
  const auto whole = std::find_if(forms.begin(), forms.end(),
                                  [&](const forms::Form* form) { return form->values(model, {}).empty(); });
  const measure::AlbedoTable table =
      measure::has_albedo_table(model) ? measure::albedo_table_of(model) : measure::AlbedoTable();
  return (*whole)->write(model, table, {{}, {}, 0}).source;
}

std::vector<Function> functions_of(const Model& model) {
  std::vector<Function> functions;
  if (model.has_scatter()) {
    functions.push_back(
        {"The BRDF in 1/sr, without the cosine; 0 where wi or wo is below the surface unless light passes.", "color",
         "eval", "vector wi, vector wo", components("wi") + components("wo") + "    color value;\n",
         statements(model, [](const Brdf<Expr>& brdf,
                              Program& p) { p.output("value", brdf.eval(input3("wi"), input3("wo"))); }),
         "value"});
    functions.push_back({"Density of _sample per solid angle at wi.", "float", "pdf", "vector wi, vector wo",
                         components("wi") + components("wo") + "    float pdf;\n",
                         statements(model, [](const Brdf<Expr>& brdf,
                                              Program& p) { p.output("pdf", brdf.pdf(input3("wi"), input3("wo"))); }),
                         "pdf"});
    print::Statements sample = statements(model, [](const Brdf<Expr>& brdf, Program& p) {
      const Sample<Expr> s = brdf.sample(input3("wo"), {Expr::input("u_0"), Expr::input("u_1"), Expr::input("u_2")});
      p.output("wi", s.wi);
      p.output("pdf", s.pdf);
      p.output("value", s.weight);
    });
    sample.push_back(print::assign("wi", print::call("vector", {"wi_x", "wi_y", "wi_z"})));
    functions.push_back({"Draws wi by three numbers in [0, 1); returns f cos / pdf. A pdf of 0: no direction.", "color",
                         "sample", "vector wo, vector numbers, output vector wi, output float pdf",
                         components("wo") + "    float u_0 = numbers[0], u_1 = numbers[1], u_2 = numbers[2];\n"
                                            "    float wi_x, wi_y, wi_z;\n    color value;\n",
                         std::move(sample), "value"});
  }
  const auto delta = [&](const char* doc, const char* name, Rgb<Expr> (Brdf<Expr>::*member)(const Vec3<Expr>&) const) {
    functions.push_back({doc, "color", name, "vector wo", components("wo") + "    color value;\n",
                         statements(model, [&](const Brdf<Expr>& brdf,
                                               Program& p) { p.output("value", (brdf.*member)(input3("wo"))); }),
                         "value"});
  };
  if (model.has_mirror()) delta("Weight of ideal reflection.", "mirror", &Brdf<Expr>::mirror);
  if (model.has_transmit()) {
    delta("Weight of ideal refraction; 0 beyond the critical angle.", "transmit", &Brdf<Expr>::transmit);
    functions.push_back({"Refractive index inside over the one outside, by channel.", "color", "ior", "",
                         "    color value;\n",
                         statements(model,
                                    [](const Brdf<Expr>& brdf, Program& p) {
                                      const std::array<Expr, 3> n = brdf.channel_iors();
                                      p.output("value", Rgb<Expr>(n[0], n[1], n[2]));
                                    }),
                         "value"});
  }
  if (model.has_medium())
    functions.push_back(
        {"Share of the light that is left after a distance inside.", "color", "transmittance", "float distance",
         "    color value;\n",
         statements(model, [](const Brdf<Expr>& brdf,
                              Program& p) { p.output("value", brdf.transmittance(Expr::input("distance"))); }),
         "value"});
  return functions;
}

std::string header_of(const Model& model, const std::vector<Function>& functions) {
  const ModelInfo& info = model.info();
  std::string text = "#include \"brdfc_library.h\"\n";
  for (const Function& f : functions) text.append("\n").append(text_of(model, f));
  return print::comment(fmt::format("{}: {}. Generated by brdfc {}.", info.label, info.paper, BRDFC_VERSION)) +
         print::comment(fmt::format("{} {}", info.doc, info.equations)) +
         print::comment(
             "Directions are unit vectors that leave the surface, in a frame whose z axis is its normal: wi to the "
             "light, "
             "wo to the viewer.") +
         choices_doc(info) + "// SPDX-License-Identifier: GPL-3.0-or-later\n\n" + guarded(info.name, text);
}

}  // namespace

std::map<std::filesystem::path, std::string> standalone_files(const std::vector<std::string>& names) {
  std::map<std::filesystem::path, std::string> files;
  std::set<std::string> called;
  for (const auto& [name, model] : models()) {
    if (!names.empty() && std::find(names.begin(), names.end(), name) == names.end()) continue;
    files[name + ".osl"] = shader_of(*model);
    const std::vector<Function> functions = functions_of(*model);
    files[fmt::format("include/brdfc_{}.h", name)] = header_of(*model, functions);
    for (const Function& f : functions) called.merge(print::functions_in(f.body));
  }
  for (const std::string& name : names) find_model(name);  // throws for an unknown name
  files["include/brdfc_library.h"] =
      "// What the headers of brdfc's models call.\n// SPDX-License-Identifier: GPL-3.0-or-later\n\n" +
      guarded("library", print::library_for(called));
  return files;
}

}  // namespace brdfc::pack
