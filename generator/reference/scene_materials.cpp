// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the materials of a scene file: models, values, textures and substances.
#include <algorithm>
#include <fstream>
#include <sstream>

#include "core/hash.h"
#include "core/text.h"
#include "measured/fit_lobes.h"
#include "measured/fit_models.h"
#include "model/optical.h"
#include "reference/procedural.h"
#include "reference/scene_files.h"

namespace brdfc::reference {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

/// Values of a table in linear Rec.709, in another space.
class Converted final : public measured::Table {
 public:
  Converted(std::shared_ptr<const measured::Table> table, std::array<Rgb<double>, 3> primaries)
      : table_(std::move(table)), primaries_(primaries) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    const Rgb<double> f = table_->eval(wi, wo);
    const Rgb<double> out = primaries_[0] * f.r + primaries_[1] * f.g + primaries_[2] * f.b;
    return {std::max(out.r, 0.), std::max(out.g, 0.), std::max(out.b, 0.)};
  }

 private:
  std::shared_ptr<const measured::Table> table_;
  std::array<Rgb<double>, 3> primaries_;  ///< of Rec.709, in the other space
};

measured::Measurement in_working_space(measured::Measurement m, const ColorConfig& colors) {
  if (colors.working_space() == working_spaces()[0].name) return m;
  Image unit;
  unit.width = 3, unit.height = 1;
  unit.rgb = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  colors.to_scene_linear(unit, working_spaces()[0].chromaticities);
  std::array<Rgb<double>, 3> primaries;
  for (std::size_t k = 0; k < 3; ++k) primaries[k] = {unit.rgb[3 * k], unit.rgb[3 * k + 1], unit.rgb[3 * k + 2]};
  m.table = std::make_shared<Converted>(std::move(m.table), primaries);
  return m;
}

class MaterialReader {
 public:
  MaterialReader(SceneFiles& files, bool alone) : files_(files), scene_(files.scene), alone_(alone) {}

  void read(const JsonView& j) {
    json& out = scene_.resolved["materials"] = json::object();
    for (const auto& [id, m] : j.members()) {
      Material material;
      material.id = id;
      if (m.has("measured")) {
        read_measured(m, material, out[id]);
        scene_.materials.push_back(std::move(material));
        continue;
      }
      if (m.has("sum") || m.has("layers")) {
        read_stack(m, m.has("sum") ? measured::Stack::Sum : measured::Stack::Layers, material, out[id]);
        scene_.materials.push_back(std::move(material));
        continue;
      }
      m.only({"model", "optical", "thickness", "parameters", "representation"});
      material.model = &read_model(m.at("model"));
      const ModelInfo& info = material.model->info();
      json& resolved = out[id] = {{"model", info.name}, {"parameters", json::object()}};
      if (const auto optical = m.find("optical")) {
        std::optional<double> thickness;
        if (const auto t = m.find("thickness")) thickness = t->number(kThinnest, kThickest);
        material.values = optical_parameters(*optical, info, thickness);
        resolved["parameters"] = to_json(material.values);
      } else if (const auto thickness = m.find("thickness")) {
        thickness->error("expected \"optical\" beside it, which says what absorbs");
      }
      const ParamValues of_substance = material.values;
      if (const auto parameters = m.find("parameters"))
        for (const auto& [name, value] : parameters->members()) {
          const ParamInfo* const p = &parameter_named(name, value, info);
          if (of_substance.count(name)) value.error("\"optical\" says what it is, expected one of the two");
          if (alone_ && value.json().is_object()) {
            value.only({"varies"});
            if (!value.at("varies").boolean()) value.at("varies").fail("true, or the parameter's value");
            material.varying.insert(name);
          } else if (value.json().is_object()) {
            value.only({"texture"});
            if (p->kind == ParamKind::Choice) value.error("a choice can't be textured");
            const auto image = read_texture(value.at("texture"), *p, resolved["parameters"][name]);
            material.values[name] = texture_mean(value, *p, *image);
            material.textures[name] = image;
          } else {
            material.values[name] = read_value(value, *p);
            resolved["parameters"][name] = value.json();
          }
        }
      if (m.has("optical"))
        for (const auto& [name, value] : clear_inside(info))
          if (!material.varying.count(name) && material.values.try_emplace(name, value).second)
            resolved["parameters"].update(to_json({{name, value}}));
      if (const auto v = m.find("representation")) material.representation = v->text();
      resolved["representation"] = material.representation;
      try {
        material.values = complete(info, material.values);
      } catch (const InputError& e) {
        m.error(e.what());
      }
      scene_.materials.push_back(std::move(material));
    }
    if (scene_.materials.empty()) j.error("expected at least one material");
  }

 private:
  static const Model& read_model(const JsonView& name) {
    std::vector<std::string> names;
    for (const auto& [each, model] : models()) names.push_back(each);
    return find_model(name.choice(names));
  }

  /// Models that are added up, or that lie above others, with constant parameters.
  void read_stack(const JsonView& m, measured::Stack stack, Material& material, json& resolved) {
    const char* key = key_of(stack);
    m.only({key, "representation"});
    if (alone_) m.at(key).error("expected \"model\" in a file of materials alone");
    if (const auto v = m.find("representation")) material.representation = v->text();
    std::vector<measured::Lobe> lobes;
    const JsonView list = m.at(key);
    if (!list.json().is_array() || list.json().empty() || list.json().size() > kMostLobes)
      list.fail(fmt::format("1 to {} lobes", kMostLobes));
    for (const JsonView& each : list.elements()) {
      each.only({"model", "parameters"});
      measured::Lobe lobe{&read_model(each.at("model")), {}};
      const ModelInfo& info = lobe.model->info();
      if (const auto parameters = each.find("parameters"))
        for (const auto& [name, value] : parameters->members()) {
          if (value.json().is_object())
            value.error(fmt::format("expected a constant: textures are not for the lobes of {}", key));
          lobe.values[name] = read_value(value, parameter_named(name, value, info));
        }
      lobe.values = complete(info, lobe.values);
      if (lobe.model->has_transmit() || lobe.model->make_double(lobe.values)->scatters_through())
        each.error("lets light through: expected lobes that reflect");
      lobes.push_back(std::move(lobe));
    }
    set_stack(std::move(lobes), stack, material, resolved);
    const auto brdf = material.model->make_double({});
    if (const auto said =
            measured::gain_of_sum(measured::brightest_view(*brdf, material.model->info().properties.isotropic)))
      files_.note(fmt::format("{}: {}", list.key(), *said));
  }

  static const char* key_of(measured::Stack stack) { return stack == measured::Stack::Sum ? "sum" : "layers"; }

  static void set_stack(std::vector<measured::Lobe> lobes, measured::Stack stack, Material& material, json& resolved) {
    resolved = {{key_of(stack), json::array()}, {"representation", material.representation}};
    for (const measured::Lobe& lobe : lobes)
      resolved[key_of(stack)].push_back({{"model", lobe.model->info().name}, {"parameters", to_json(lobe.values)}});
    material.sum = lobes;
    material.stack = stack;
    material.own = std::make_shared<measured::SumModel>(std::move(lobes), stack);
    material.model = material.own.get();
  }

  static json to_json(const ParamValues& values) {
    json out = json::object();
    for (const auto& [name, value] : values) out[name] = std::visit([](const auto& v) { return json(v); }, value);
    return out;
  }

  static const ParamInfo& parameter_named(const std::string& name, const JsonView& value, const ModelInfo& info) {
    if (const ParamInfo* p = info.param(name)) return *p;
    std::vector<std::string> known;
    for (const ParamInfo& each : info.params) known.push_back(each.name);
    value.error(fmt::format("{} has no such parameter, expected one of {}", info.name, join(known, ", ")));
  }

  static std::string described(const ModelInfo& info, const ParamValues& values) {
    return format_values(info, measured::rounded(values));
  }

  /// Measured data as such, or as models that are fitted to them.
  void read_measured(const JsonView& m, Material& material, json& resolved) {
    m.only({"measured", "as", "lobes", "representation"});
    if (alone_) m.at("measured").error("expected \"model\" in a file of materials alone");
    const JsonView file = m.at("measured");
    const auto as = m.find("as");
    if (const auto v = m.find("representation")) {
      if (!as) v->error("expected \"as\" beside it: measured data themselves have no form in Blender");
      material.representation = v->text();
    }
    std::vector<std::string> names{"best", "lobes"};
    std::vector<const Model*> tried;
    for (const auto& [name, model] : models())
      if (model->has_scatter()) names.push_back(name), tried.push_back(model.get());
    const std::string name = as ? as->choice(names) : "";
    if (const auto lobes = m.find("lobes"); lobes && name != "lobes")
      lobes->error("expected \"as\": \"lobes\" beside it");
    const auto measurement = files_.read_file(file, [&](const fs::path& path) {
      return in_working_space(measured::read_measurement(path, files_.colors().to_rec709()), files_.colors());
    });
    for (const std::string& text : measurement.notes) files_.note(measurement.file + ": " + text);
    auto table = std::make_shared<measured::MeasuredModel>(measurement);
    if (!as) {
      material.model = table.get();
      material.values = {};
      material.own = std::move(table);
      std::ifstream in(files_.beside(file.text()), std::ios::binary);
      std::ostringstream content;
      content << in.rdbuf();
      resolved = {{"measured", sha256(content.str())}};
      return;
    }
    const auto note_error = [&](const std::string& what, double error, const std::string& values) {
      files_.note(fmt::format("{}: {}, error {} %: {}", measurement.file, what, in_percent(error), values));
    };
    if (name == "lobes") {
      const auto most = m.find("lobes");
      const auto sums = measured::fit_lobes(measurement, *table, measured::lobe_kinds({}, measurement.isotropic),
                                            most ? std::size_t(most->integer(1, kMostLobes)) : kFittedLobes);
      if (sums.empty()) as->error("is a sum of nothing: the data are black");
      const measured::LobeSum& sum = sums.back();
      std::vector<std::string> each;
      for (const measured::Lobe& lobe : sum.lobes)
        each.push_back(lobe.model->info().name + " " + described(lobe.model->info(), lobe.values));
      note_error("a sum of " + measured::counted(sum.lobes.size(), "lobe", "lobes"), sum.error, join(each, " + "));
      if (const auto said = measured::gain_of_sum(sum.brightest)) files_.note(measurement.file + ": " + *said);
      set_stack(sum.lobes, measured::Stack::Sum, material, resolved);
      return;
    }
    if (name != "best") tried = {&find_model(name)};
    const auto fits = measured::fit_models(measurement, *table, tried, measured::Matte::Added);
    if (fits.empty()) as->error("lets light through, which no measured BRDF shows: expected another model");
    const measured::ModelFit& fit = fits.front();
    const ModelInfo& info = fit.model->info();
    if (measured::has_mirror(fit))
      files_.note(fmt::format("{}: {} has a mirror, {} % of a white world, which is not in the data", measurement.file,
                              info.name, in_percent(fit.mirror)));
    if (fit.matte) {
      const Model& lambert = find_model("lambert");
      const ParamValues rho{{"rho", std::array<double, 3>{fit.matte->r, fit.matte->g, fit.matte->b}}};
      note_error(info.name + " with lambert", fit.error,
                 described(info, fit.values) + " + " + described(lambert.info(), rho) + measured::remarks(fit));
      set_stack({{fit.model, fit.values}, {&lambert, rho}}, measured::Stack::Sum, material, resolved);
      return;
    }
    note_error(info.name, fit.error, described(info, fit.values) + measured::remarks(fit));
    material.model = fit.model;
    material.values = fit.values;
    resolved = {{"model", info.name}, {"parameters", to_json(fit.values)}, {"representation", material.representation}};
  }

  static std::size_t channels_of(const ParamInfo& info) { return info.kind == ParamKind::Number ? 1 : 3; }

  std::shared_ptr<const Image> read_texture(const JsonView& j, const ParamInfo& info, json& resolved) {
    Image image;
    if (j.json().is_object() && j.has("procedural")) {
      j.at("procedural").choice({"checker"});
      j.only({"procedural", "a", "b", "cells"});
      const auto a = j.at("a").numbers<3>(0, kBright), b = j.at("b").numbers<3>(0, kBright);
      image = checker_texture({a[0], a[1], a[2]}, {b[0], b[1], b[2]}, j.at("cells").integer(1, 256));
    } else {
      const bool named = j.json().is_string();
      if (!named) j.only({"image", "colorspace"});
      const JsonView file = named ? j : j.at("image");
      image = files_.read_picture(file, named ? "auto" : files_.read_colorspace(j));
      limit(image, info, files_.beside(file.text()).string());
    }
    std::string name;
    auto kept = files_.keep(std::move(image), name);
    resolved = {{"texture", {{"image", name}, {"colorspace", "linear"}}}};
    return kept;
  }

  /// Clamps values to the range of the parameter, as the shaders do.
  void limit(Image& image, const ParamInfo& info, const std::string& name) {
    std::size_t count = 0, first = 0;
    float worst = 0;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3)
      for (std::size_t c = 0; c < channels_of(info); ++c) {
        float& x = image.rgb[i + c];
        const float inside = std::clamp(x, float(info.min), float(info.max));
        if (x == inside) continue;
        if (count++ == 0) first = i / 3, worst = x;
        x = inside;
      }
    if (count)
      files_.note(
          fmt::format("{}: {} outside of [{:g}, {:g}], the range of \"{}\", the first {:g} at ({}, {}); taken for the "
                      "end of the range",
                      name, count == 1 ? "1 value is" : fmt::format("{} values are", count), info.min, info.max,
                      info.name, worst, first % image.width, first / image.width));
  }

  ParamValue read_value(const JsonView& j, const ParamInfo& info) {
    if (info.kind == ParamKind::Choice) return j.choice(info.choices);
    if (info.kind == ParamKind::Number) return j.number(info.min, info.max);
    if (j.json().is_number()) {
      const double grey = j.number(info.min, info.max);
      return std::array<double, 3>{grey, grey, grey};
    }
    return j.numbers<3>(info.min, info.max);
  }

  /// The parameters that a substance sets, in the working space.
  ParamValues optical_parameters(const JsonView& j, const ModelInfo& info, std::optional<double> thickness) {
    try {
      const Substance substance = find_substance(j.text(), files_.path().parent_path());
      for (const std::string& text : substance.notes) files_.note(text);
      return parameters_of(
          info, substance, [&](const Xyz& xyz) { return files_.colors().from_xyz(xyz); }, thickness);
    } catch (const InputError& e) {
      j.error(e.what());
    }
  }

  /// The mean of the texels. Every texel must be in the range of the parameter.
  static ParamValue texture_mean(const JsonView& j, const ParamInfo& info, const Image& image) {
    std::array<double, 3> sum{0, 0, 0};
    for (std::size_t i = 0; i < image.rgb.size(); i += 3)
      for (std::size_t c = 0; c < channels_of(info); ++c) {
        const double x = image.rgb[i + c];
        if (!(x >= info.min && x <= info.max))
          j.error(fmt::format("the texture has the value {:g} at pixel ({}, {}), expected [{:g}, {:g}]", x,
                              i / 3 % image.width, i / 3 / image.width, info.min, info.max));
        sum[c] += x;
      }
    for (double& x : sum) x /= double(image.rgb.size() / 3);
    if (info.kind == ParamKind::Number) return sum[0];
    return sum;
  }

  SceneFiles& files_;
  Scene& scene_;
  bool alone_;
};

}  // namespace

void read_materials(const JsonView& j, SceneFiles& files, bool alone) { MaterialReader(files, alone).read(j); }

void require_models(const std::vector<Material>& materials) {
  for (const Material& m : materials) {
    if (m.own && m.sum.empty())
      input_error(
          "material {}: measured data are rendered by `brdfc render` alone: expected \"as\" with a model beside "
          "\"measured\"",
          m.id);
    if (m.stack == measured::Stack::Sum || m.representation == "twin") continue;
    for (std::size_t k = 0; k + 1 < m.sum.size(); ++k)
      if (const ModelInfo& info = m.sum[k].model->info(); !info.properties.albedo_table)
        input_error(
            "material {}: layer {}: {} has no Albedo output: no table can hold its albedo: only `brdfc render` and "
            "twins have it above other layers",
            m.id, k + 1, info.label);
  }
}

}  // namespace brdfc::reference
