// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/file.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "core/error.h"
#include "core/json_text.h"
#include "tables/table_file.h"

namespace brdfc::fit {
namespace {

/// The axes of a fit's tables, with or without a parameter as axis (`along`). Files store only their sizes.
std::vector<TableAxis> fit_axes(const std::string& table, const std::vector<int>& sizes, bool along) {
  static const std::vector<std::string> position = {"place_on_axis"}, errors = {"place", "number"},
                                        by_view = {"place_of_view", "position_in_ramp"},
                                        others = {"knot", "place_of_view", "position_in_ramp"};
  const std::vector<std::string>& names = table == "position_on_axis" ? position
                                          : table == "errors"         ? errors
                                          : along                     ? others
                                                                      : by_view;
  std::vector<TableAxis> axes;
  for (std::size_t i = 0; i < sizes.size(); ++i) axes.push_back(even_axis(names.at(i), sizes[i]));
  return axes;
}

}  // namespace

void write_fit(const FitTables& fit, const Model& model, const ParamValues& values, const std::string& hash,
               const std::filesystem::path& path) {
  using Json = nlohmann::ordered_json;
  std::vector<double> errors;
  for (ViewError e : fit.errors)
    for (const double* x : numbers_of(e)) errors.push_back(*x);
  const int count = int(fit.errors.size()), numbers = int(errors.size()) / count;
  std::vector<TablePtr> rows = fit.all();
  rows.push_back(make_table("errors", {even_axis("place", count), even_axis("number", numbers)}, std::move(errors)));
  std::vector<const Table*> pointers;
  Json facets = Json::array(), tables = Json::array();
  for (const FitTables::FacetTables& f : fit.facets) facets.push_back(f.kind == ClosureKind::Ggx ? "ggx" : "beckmann");
  for (const auto& table : rows) {
    pointers.push_back(table.get());
    Json sizes = Json::array();
    for (const TableAxis& a : table->axes) sizes.push_back(a.size());
    tables.push_back({{"row", tables.size()}, {"name", table->name}, {"sizes", sizes}});
  }
  // Each term is stored as the parameters at which f equals this term times `scale`.
  Json terms = Json::array();
  for (const Terms::Term& term : fit.terms.terms)
    terms.push_back({{"values", format_values(model.info(), term.values)}, {"scale", term.scale}});
  const Json axis = fit.axis ? Json{{"parameter", fit.axis->parameter},
                                    {"low", fit.axis->low},
                                    {"high", fit.axis->high},
                                    {"scale", name_of(fit.axis->scale)}}
                             : Json();
  Json meta = {{"model", model.info().name},
               {"quantity", fit.axis ? "closures fitted to a model, over a number and the view"
                                     : "closures fitted to a model, over the view"},
               {"values", format_values(model.info(), values)},
               {"axis", axis},
               {"hash", hash.empty() ? Json() : Json(hash)},
               {"knots", fit.knots},
               {"family", fit.family},
               {"grey", fit.grey},
               {"tint", {fit.tint.r, fit.tint.g, fit.tint.b}},
               {"lobes", fit.lobes.size()},
               {"facets", facets},
               {"terms", terms},
               {"channels", fit.linear.front().colour.front().size()},
               {"layout", "a row a table: row-major, first axis slowest, padded with zeros"},
               {"tables", tables}};
  // The scale differs from 1 only for fits with factors other than 1.
  if (fit.scale != 1) meta["scale"] = fit.scale;
  TableImage image = image_of(pointers);
  image.meta = json_text(meta);
  write_table_image(image, path);
}

FitTables read_fit(const std::optional<FitAxis>& axis, const Terms& all_terms, const std::string& hash,
                   const std::filesystem::path& path) {
  FitTables fit;
  fit.axis = axis;
  fit.terms = all_terms;
  const TableImage image = read_table_image(path);
  try {
    const auto meta = json_of_text(image.meta);
    if (meta.at("hash") != hash)
      input_error("{}: hash: expected {}, got {}", path.string(), hash, json_text(meta.at("hash")));
    std::map<std::string, TablePtr> tables;
    for (const auto& t : meta.at("tables")) {
      const auto sizes = t.at("sizes").get<std::vector<int>>();
      std::size_t count = 1;
      for (const int n : sizes) count *= std::size_t(n);
      const std::string name = t.at("name");
      std::optional<std::vector<double>> values = values_in(image, t.at("row"), count, 1);
      if (!values)
        input_error("{}: tables: {} has more numbers than there are", path.string(), json_text(t.at("name")));
      tables[name] = make_table(name, fit_axes(name, sizes, axis.has_value()), std::move(*values));
    }
    fit.knots = meta.at("knots").get<std::vector<double>>();
    fit.family = meta.at("family");
    fit.grey = meta.at("grey");
    fit.tint = {meta.at("tint").at(0), meta.at("tint").at(1), meta.at("tint").at(2)};
    if (axis) fit.position = tables.at("position_on_axis");
    const std::size_t terms = fit.terms.terms.size();
    const auto term = [&](const std::string& name, std::size_t t) {
      return tables.at(terms == 1 ? name : fmt::format("{}_{}", name, t));
    };
    for (std::size_t t = 0; axis && t < terms; ++t) fit.amplitude.push_back(term("amplitude", t));
    const auto& facets = meta.at("facets");
    for (std::size_t i = 0; i < facets.size(); ++i)
      fit.facets.push_back({facets[i] == "ggx" ? ClosureKind::Ggx : ClosureKind::Beckmann,
                            tables.at(fmt::format("lean_of_{}", i)), tables.at(fmt::format("alpha_of_{}", i)),
                            tables.at(fmt::format("stretch_of_{}", i))});
    const std::size_t lobes = meta.at("lobes"), channels = meta.at("channels");
    for (std::size_t j = 0; j < lobes; ++j)
      fit.lobes.push_back({tables.at(fmt::format("offset_of_{}", j)), tables.at(fmt::format("power_of_{}", j))});
    for (std::size_t j = 0; j < lobes + 1 + fit.facets.size(); ++j) {
      FitTables::LinearTables l;
      for (std::size_t t = 0; t < terms; ++t) {
        if (j <= lobes) l.weight.push_back(term(fmt::format("share_of_{}", j), t));
        l.colour.emplace_back();
        for (std::size_t channel = 0; channel < channels; ++channel)
          l.colour[t].push_back(tables.at(fmt::format("colour_of_{}_{}", j, t * channels + channel)));
      }
      fit.linear.push_back(std::move(l));
    }
    const auto& errors = tables.at("errors");
    for (std::size_t i = 0; i < errors->values.size();) {
      ViewError e;
      for (double* x : numbers_of(e)) *x = errors->values.at(i++);
      fit.errors.push_back(e);
    }
  } catch (const nlohmann::json::exception& e) {
    input_error("{}: expected a stored fit: {}", path.string(), e.what());
  } catch (const std::out_of_range&) {
    input_error("{}: expected a stored fit, a table is missing", path.string());
  }
  return fit;
}

}  // namespace brdfc::fit
