// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/python_package.h"

#include <fmt/format.h>

#include <array>
#include <cctype>

#include "closures/closure.h"
#include "core/error.h"
#include "core/text.h"
#include "model/optical.h"
#include "pack/addon.h"
#include "pack/recorded_model.h"
#include "pack/target.h"
#include "print/numpy.h"

namespace brdfc::pack {
namespace {

namespace fs = std::filesystem;

using print::python_number;
using print::python_string;

constexpr const char* kPythonMadeBy = "# Made by brdfc ";
const std::string kHead = std::string("# SPDX-License-Identifier: GPL-3.0-or-later\n") + kPythonMadeBy +
                          BRDFC_VERSION " of the formulas in C++: changes belong there.\n";

std::string color(const std::array<double, 3>& c) {
  return fmt::format("({}, {}, {})", python_number(c[0]), python_number(c[1]), python_number(c[2]));
}

/// A parameter as a constructor call.
std::string parameter(const ParamInfo& p) {
  const std::string name = python_string(p.name), label = python_string(p.label), doc = python_string(p.doc);
  switch (p.kind) {
    case ParamKind::Number:
      return fmt::format("Number({}, {}, {}, {}, {}, {}, {}, {}, {})", name, label, python_string(p.unit), doc,
                         python_number(p.value[0]), python_number(p.min), python_number(p.max),
                         python_number(p.soft_min), python_number(p.soft_max));
    case ParamKind::Color:
      return fmt::format("Color({}, {}, {}, {})", name, label, doc, color(p.value));
    default: {
      std::string choices;
      for (const std::string& c : p.choices) choices += python_string(c) + ", ";
      return fmt::format("Choice({}, {}, {}, {}, ({}))", name, label, doc,
                         python_string(p.choices[std::size_t(p.value[0])]), choices);
    }
  }
}

/// A line of documentation.
std::string described(const ParamInfo& p) {
  switch (p.kind) {
    case ParamKind::Number:
      return fmt::format("{}: {}. In [{:g}, {:g}]{}{}, default {:g}.", p.name, p.doc, p.min, p.max,
                         p.unit.empty() ? "" : " ", p.unit, p.value[0]);
    case ParamKind::Color:
      return fmt::format("{}: {}. A colour in [0, 1], default {:g}, {:g}, {:g}.", p.name, p.doc, p.value[0], p.value[1],
                         p.value[2]);
    default:
      return fmt::format("{}: {}. One of {}, default {}.", p.name, p.doc, join(p.choices, ", "),
                         p.choices[std::size_t(p.value[0])]);
  }
}

/// The class name for a model: "AshikhminShirley" for "ashikhmin_shirley".
std::string class_name(const std::string& name) {
  std::string out;
  bool start = true;
  for (const char c : name) {
    if (c != '_') out += start ? char(std::toupper(static_cast<unsigned char>(c))) : c;
    start = c == '_';
  }
  return out;
}

std::vector<std::string> components_of(const std::string& vector) {
  return {vector + "_x", vector + "_y", vector + "_z"};
}

std::vector<std::string> joined(std::vector<std::string> names, const std::vector<std::string>& more) {
  names.insert(names.end(), more.begin(), more.end());
  return names;
}

/// The functions of a module; functions with the same text are written once.
class NumpyFunctions {
 public:
  explicit NumpyFunctions(const Model& model) : model_(model) {
    for (const ParamInfo& p : model.info().params)
      if (p.kind != ParamKind::Choice) parameters_.push_back(p.name);
  }

  /// The functions for one combination of choices, as a constructor call.
  std::string add(const Choices& choices) {
    std::string suffix;
    for (const std::string& option : options_of(model_.info(), choices)) suffix += "_" + option;
    const RecordedModel recorded = record_model(model_, choices, Precision::Double);
    const Program& iors = recorded.iors.outputs().empty() ? recorded.ior : recorded.iors;
    const std::vector<std::string> wi = components_of("wi"), wo = components_of("wo"), u = components_of("u"),
                                   both = joined(wi, wo);
    const std::array<std::string, 8> names = {
        function("eval", suffix, recorded.eval, both),
        function("pdf", suffix, recorded.pdf, both),
        function("sample", suffix, recorded.sample, joined(wo, u)),
        function("mirror", suffix, recorded.mirror, wo),
        function("transmit", suffix, recorded.transmit, wo),
        function("whole", suffix, recorded.whole, {}),
        function("iors", suffix, iors, {}),
        function("inside", suffix, recorded.inside, {"distance"}),
    };
    return fmt::format("Formulas({})", join(names, ", "));
  }

  std::string print() const {
    std::string out;
    for (const auto& [name, table] : tables_) out.append("\n").append(print::numpy_table(*table));
    return out + text_;
  }

 private:
  /// The function's name, or None if there are no outputs.
  std::string function(const std::string& what, const std::string& suffix, const Program& program,
                       const std::vector<std::string>& inputs) {
    if (program.outputs().empty()) return "None";
    const std::string text = print::numpy_function(program, what, joined(inputs, parameters_), tables_);
    const auto [it, is_new] = names_.emplace(text, what + suffix);
    if (is_new) text_ += fmt::format("\n\ndef {}{}", it->second, text.substr(4 + what.size()));
    return it->second;
  }

  const Model& model_;
  std::vector<std::string> parameters_;
  std::map<std::string, std::string> names_;
  print::Tables tables_;
  std::string text_;
};

std::string module_of(const Model& model) {
  const ModelInfo& info = model.info();
  NumpyFunctions functions(model);
  std::string formulas;
  for (const Choices& choices : choice_combinations(info)) {
    std::string key;
    for (const std::string& option : options_of(info, choices)) key += python_string(option) + ", ";
    const std::string call = functions.add(choices);
    formulas += fmt::format("        ({}): {},\n", key, call);
  }
  std::string parameters, list = "Parameters";
  for (const ParamInfo& p : info.params) {
    parameters += fmt::format("        {}: {},\n", python_string(p.name), parameter(p));
    list += "\n- " + described(p);
  }
  const std::string text = functions.print(), name = class_name(info.name);
  std::string out = kHead + print::python_docstring({info.label + ". " + info.doc}, 0);
  out += "\nfrom .._formula import table\n";
  out += "from .._model import Choice, Color, Formulas, Model, Number\n" + text;
  out += fmt::format("\n\nclass {}(Model):\n    {}\n", name,
                     print::python_docstring({info.label + ". " + info.doc, info.paper, info.equations, list}, 4));
  for (const auto& [key, value] :
       {std::pair{"name", &info.name}, std::pair{"label", &info.label}, std::pair{"paper", &info.paper},
        std::pair{"equations", &info.equations}, std::pair{"doc", &info.doc}})
    out += fmt::format("    {} = {}\n", key, python_string(*value));
  out += fmt::format("    two_sided = {}\n", model.two_sided() ? "True" : "False");
  out += "    parameters = {\n" + parameters + "    }\n    formulas = {\n" + formulas + "    }\n";
  return out + fmt::format("\n\nMODEL = {}()\n", name);
}

std::string tuple_of(const std::vector<double>& numbers) {
  std::string out = "(";
  for (const double x : numbers) out += python_number(x) + ", ";
  return out + ")";
}

/// The data for optics.py: the observer, the substances, and the formulas.
std::string optics_module() {
  std::string out = kHead + print::python_docstring({"Optical constants, and formulas over them."}, 0);
  out += "\nimport numpy as np\n\nfrom ._formula import table\n\n";
  out += fmt::format("GRAZING = {}\nNEEDED = ({}, {})\nCONDUCTOR = {}\nMAX_INDEX = {}\n", python_number(kGrazing),
                     python_number(kNeededMin), python_number(kNeededMax), python_number(kConductor),
                     python_number(kMaxIndex));
  out += fmt::format("EXPECTED = ({}, {})\nSEEN = ({}, {})\nNANOMETRES, NOISE_OF_K = {}, {}\n",
                     python_number(kExpectedMin), python_number(kExpectedMax), python_number(kSeenMin),
                     python_number(kSeenMax), python_number(kNanometres), python_number(kNoiseOfK));
  out += fmt::format("DISPERSION = {}\n", python_number(kDispersion));
  out += fmt::format("THICKNESS, DARKEST = {}, {}\n", python_number(kThickness), python_number(kDarkest));
  out += fmt::format("THICKNESSES = ({}, {})\n", python_number(kThinnest), python_number(kThickest));
  out += fmt::format("LINE_C, LINE_D, LINE_F = {}, {}, {}\n", python_number(kLineC), python_number(kLineD),
                     python_number(kLineF));
  out +=
      fmt::format("WAVELENGTHS = np.arange({}.0, {}.0, {}.0)\n", kWavelengthMin, kWavelengthMax + 1, kWavelengthStep);
  out += fmt::format("WEIGHTS = table(\n    ({}, 3),\n    \"\"\"\n", kWavelengths);
  for (const Xyz& w : xyz_weights())
    out += fmt::format("{} {} {}\n", python_number(w[0]), python_number(w[1]), python_number(w[2]));
  out += "\"\"\",\n)\n#: Label, source, wavelengths in nm of n, n, those of k, k.\nSUBSTANCES = {\n";
  for (const Substance& s : substances())
    out +=
        fmt::format("    {}: (\n        {},\n        {},\n        {},\n        {},\n        {},\n        {},\n    ),\n",
                    python_string(s.name), python_string(s.label), python_string(s.source), tuple_of(s.n.nm),
                    tuple_of(s.n.values), tuple_of(s.k.nm), tuple_of(s.k.values));
  out += "}\n";
  print::Tables none;
  const auto function = [&](const char* name, const std::vector<std::string>& arguments, const auto& record) {
    Recorder recorder(Precision::Double);
    std::vector<Expr> inputs;
    for (const std::string& a : arguments) inputs.push_back(Expr::input(a));
    Program program;
    record(program, inputs);
    out += "\n\n" + print::numpy_function(program, name, arguments, none);
  };
  function("reflectance", {"cosine", "n", "k"}, [](Program& p, const std::vector<Expr>& x) {
    p.output("R", fresnel_conductor(x[0], (Expr(1) - x[0]) * (Expr(1) + x[0]), x[1], x[2]));
  });
  function("transmittance", {"nm", "k", "metres"},
           [](Program& p, const std::vector<Expr>& x) { p.output("left", transmittance(x[0], x[1], x[2])); });
  function("normal_amplitude", {"n", "k"}, [](Program& p, const std::vector<Expr>& x) {
    const Amplitude<Expr> r = normal_amplitude(x[0], x[1]);
    p.output("real", r.real);
    p.output("imaginary", r.imaginary);
  });
  function("nearest_index", {"R_0", "real", "imaginary", "grazing"}, [](Program& p, const std::vector<Expr>& x) {
    const Index<Expr> i = nearest_index(x[0], {x[1], x[2]}, x[3]);
    p.output("n", i.n);
    p.output("k", i.k);
  });
  return out;
}

}  // namespace

std::map<std::string, std::string> python_package(const std::vector<const Model*>& models, const fs::path& source) {
  if (!fs::exists(source / "__init__.py"))
    input_error("{}: expected the Python package's folder with __init__.py", source.string());
  std::map<std::string, std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(source))
    if (entry.path().extension() == ".py" || entry.path().extension() == ".typed")
      files[entry.path().filename().string()] = read_text(entry.path());
  files["_version.py"] = kHead + "__version__ = " + python_string(BRDFC_VERSION) + "\n";
  files["_optics.py"] = optics_module();
  std::string names;
  for (const Model* model : models) {
    files["models/" + model->info().name + ".py"] = module_of(*model);
    names += "    " + python_string(model->info().name) + ",\n";
  }
  files["models/__init__.py"] = kHead + "\"\"\"The formulas, a module a model.\"\"\"\n\nNAMES = (\n" + names + ")\n";
  return files;
}

void require_package(const fs::path& folder) { require_replaceable(folder, "_version.py", kPythonMadeBy); }

std::string closures_module() {
  std::string out = kHead + "\"\"\"What closures of Cycles scatter.\"\"\"\n";
  for (const auto& [kind, name] :
       {std::pair{ClosureKind::Diffuse, "diffuse"}, std::pair{ClosureKind::DiffuseRamp, "diffuse_ramp"},
        std::pair{ClosureKind::PhongRamp, "phong_ramp"}, std::pair{ClosureKind::Ggx, "ggx"},
        std::pair{ClosureKind::Beckmann, "beckmann"}, std::pair{ClosureKind::GlossyToon, "glossy_toon"}}) {
    Recorder recorder(Precision::Double);
    std::vector<std::string> arguments;
    const auto vector = [&](const std::string& v) {
      for (const char* component : {"_x", "_y", "_z"}) arguments.push_back(v + component);
      return input3(v);
    };
    const auto number = [&](const std::string& n) {
      arguments.push_back(n);
      return Expr::input(n);
    };
    const Vec3<Expr> wi = vector("wi"), wo = vector("wo");
    Closure<Expr> c(kind, Rgb<Expr>(Expr(1.0)));
    c.normal = vector("normal");
    c.turned = true;
    if (kind == ClosureKind::PhongRamp) c.exponent = number("exponent");
    if (kind == ClosureKind::GlossyToon) {
      c.size = number("size");
      c.smooth = number("smooth");
    }
    for (std::size_t i = 0; has_ramp(kind) && i < kRampSize; ++i) {
      arguments.push_back(fmt::format("ramp_{}", i));
      c.ramp[i] = Rgb<Expr>::input(arguments.back());
    }
    if (has_facets(kind)) {
      const Vec3<Expr> along = vector("tangent");
      c.tangent = normalize(along - c.normal * dot(c.normal, along));
      c.stretched = Tangent::Surface;
      c.alpha = number("alpha");
      c.alpha_across = number("alpha_across");
    }
    Program program;
    program.output("f_cos", evaluate(c, wi, wo));
    print::Tables none;
    out += "\n\n" + print::numpy_function(program, name, arguments, none);
  }
  return out;
}

}  // namespace brdfc::pack
