// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/explorer.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <bit>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/json_text.h"
#include "core/text.h"
#include "model/spectrum.h"
#include "pack/addon.h"
#include "pack/manifest.h"
#include "pack/recorded_model.h"
#include "pack/target.h"
#include "print/glsl.h"

namespace brdfc::pack {
namespace {

namespace fs = std::filesystem;
using print::GlslArgument;

constexpr const char* kScriptMadeBy = "// Made by brdfc ";

/// Little-endian floats in base64, which JavaScript decodes to the same bits.
std::string base64(const std::vector<double>& values) {
  std::vector<unsigned char> bytes;
  for (const double v : values) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(float(v));
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<unsigned char>(bits >> shift));
  }
  std::string out((bytes.size() + 2) / 3 * 4 + 1, '\0');  // OpenSSL writes a 0 at the end
  out.resize(
      std::size_t(EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data()), bytes.data(), int(bytes.size()))));
  return out;
}

/// The GLSL functions of a model; functions with the same text are written once.
class GlslFunctions {
 public:
  GlslFunctions(const Model& model, print::Tables& tables) : model_(model), tables_(tables) {
    for (const ParamInfo& p : model.info().params)
      if (p.kind != ParamKind::Choice)
        parameters_.push_back({p.name, p.kind == ParamKind::Color ? ExprType::Color : ExprType::Real});
  }

  /// The names of the functions for one combination of choices.
  Json add(const Choices& choices, const std::string& suffix) {
    constexpr ExprType kReal = ExprType::Real, kColor = ExprType::Color;
    const RecordedModel recorded = record_model(model_, choices, Precision::Single);
    Json names = Json::object();
    const auto function = [&](const char* what, const Program& program, const std::vector<const char*>& inputs,
                              const std::vector<ExprType>& results) {
      if (!program.outputs().empty()) names[what] = name_of(what, suffix, program, inputs, results);
    };
    const std::vector<const char*> wi_wo = {"wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"};
    const std::vector<const char*> wo = {"wo_x", "wo_y", "wo_z"};
    function("eval", recorded.eval, wi_wo, {kColor});
    function("pdf", recorded.pdf, wi_wo, {kReal});
    function("sample", recorded.sample, {"wo_x", "wo_y", "wo_z", "u_x", "u_y", "u_z"},
             {kReal, kReal, kReal, kColor, kReal});
    function("mirror", recorded.mirror, wo, {kColor});
    function("transmit", recorded.transmit, wo, {kColor});
    function("iors", recorded.iors, {}, {kColor});
    function("inside", recorded.inside, {"distance"}, {kColor});
    return names;
  }

  /// Text and tables by the name of the function.
  Json print() const { return functions_; }

 private:
  std::string name_of(const std::string& what, const std::string& suffix, const Program& program,
                      const std::vector<const char*>& inputs, const std::vector<ExprType>& results) {
    std::vector<GlslArgument> arguments;
    for (const char* input : inputs) arguments.push_back({input, ExprType::Real});
    arguments.insert(arguments.end(), parameters_.begin(), parameters_.end());
    print::Tables used;
    // The text of two functions is compared without their names.
    const std::string head = "@";
    const std::string text = print::glsl_function(program, head, arguments, results, used);
    const auto [it, is_new] = names_.emplace(text, model_.info().name + "_" + what + suffix);
    if (is_new) {
      Json tables = Json::array();
      for (const auto& [name, table] : used) {
        tables.push_back(name);
        if (tables_.emplace(name, table).first->second != table) throw ExprError("two tables are named " + name);
      }
      std::string named = text;
      named.replace(named.find(head), head.size(), it->second);
      functions_[it->second] = {{"text", named}, {"tables", tables}};
    }
    return it->second;
  }

  const Model& model_;
  print::Tables& tables_;
  std::vector<GlslArgument> parameters_;
  std::map<std::string, std::string> names_;
  Json functions_ = Json::object();
};

Json described(const Model& model, print::Tables& tables) {
  const ModelInfo& info = model.info();
  Json parameters = Json::array(), formulas = Json::object();
  for (const ParamInfo& p : info.params) parameters.push_back(parameter_json(p));
  GlslFunctions functions(model, tables);
  for (const Choices& choices : choice_combinations(info)) {
    const std::vector<std::string> options = options_of(info, choices);
    const std::string key = join(options, " ");
    std::string suffix;
    for (const std::string& option : options) suffix += "_" + option;
    formulas[key] = functions.add(choices, suffix);
    formulas[key]["through"] = model.has_through() && [&] {
      Recorder recorder;
      return model.record(with_choices(info, choices))->scatters_through();
    }();
  }
  return {{"label", info.label},
          {"look", name_of(info.look)},
          {"paper", info.paper},
          {"equations", info.equations},
          {"doc", info.doc},
          {"isotropic", info.properties.isotropic},
          {"parameters", std::move(parameters)},
          {"formulas", std::move(formulas)},
          {"functions", functions.print()}};
}

/// What each wavelength adds to red, green and blue.
Json described_spectrum(const ToRgb& to_rgb) {
  Json rgb = Json::array();
  for (const Xyz& weight : xyz_weights()) rgb.push_back(to_rgb(weight));
  return {{"first", kWavelengthMin}, {"step", kWavelengthStep}, {"rgb", std::move(rgb)}};
}

}  // namespace

std::map<std::string, std::string> explorer_page(const std::vector<const Model*>& models, const fs::path& source,
                                                 const ToRgb& to_rgb) {
  if (!fs::exists(source / "index.html"))
    input_error("{}: expected the explorer's folder with index.html", source.string());
  std::map<std::string, std::string> files;
  Json glsl = Json::object();
  for (const fs::directory_entry& entry : fs::directory_iterator(source)) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".html" || extension == ".css" || extension == ".js")
      files[entry.path().filename().string()] = read_text(entry.path());
    else if (extension == ".glsl")
      glsl[entry.path().stem().string()] = read_text(entry.path());
  }
  print::Tables tables;
  Json described_models = Json::object(), described_tables = Json::object();
  for (const Model* model : models) described_models[model->info().name] = described(*model, tables);
  for (const auto& [name, table] : tables) described_tables[name] = base64(table->values);
  std::string& text = files["models.js"];
  text = std::string("// SPDX-License-Identifier: GPL-3.0-or-later\n") + kScriptMadeBy +
         BRDFC_VERSION " of the formulas in C++: changes belong there.\n";
  const auto add = [&](const char* name, const Json& value) {
    text.append("BRDFC.").append(name).append(" = ").append(json_text(value)).append(";\n");
  };
  text += "\"use strict\";\nconst BRDFC = {};\n";
  add("version", BRDFC_VERSION);
  add("glsl", glsl);
  add("tables", described_tables);
  add("spectrum", described_spectrum(to_rgb));
  text += "BRDFC.models = {};\n";
  for (const auto& [name, model] : described_models.items()) add(("models." + name).c_str(), model);
  return files;
}

void require_explorer(const fs::path& folder) { require_replaceable(folder, "models.js", kScriptMadeBy); }

}  // namespace brdfc::pack
