// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/albedo_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/json_text.h"
#include "tables/table_file.h"

namespace brdfc::measure {
namespace {

std::optional<AxisScale> scale_named(const std::string& name) {
  for (const AxisScale s : {AxisScale::Linear, AxisScale::Log, AxisScale::Log1p})
    if (name == name_of(s)) return s;
  return std::nullopt;
}

}  // namespace

void write_albedo_exr(const AlbedoTable& table, const std::filesystem::path& path) {
  using Json = nlohmann::ordered_json;
  std::vector<const Table*> rows;
  Json grids = Json::array(), terms = Json::array();
  for (const Table& g : table.grids) {
    Json axes = Json::array();
    for (const TableAxis& a : g.axes)
      axes.push_back({{"name", a.name}, {"scale", name_of(a.scale)}, {"values", a.values}});
    grids.push_back(
        {{"row", rows.size()}, {"points", g.points()}, {"channels", g.channels}, {"error", g.error}, {"axes", axes}});
    rows.push_back(&g);
  }
  for (const auto& combination : table.terms) {
    Json list = Json::array();
    for (const AlbedoTerm& t : combination)
      list.push_back({{"mirror", t.mirror}, {"colors", t.colors}, {"grid", t.grid}});
    terms.push_back(list);
  }
  const Json meta{{"model", table.model},
                  {"quantity", "directional albedo"},
                  {"layout", "a row a grid: row-major, first axis slowest, padded with zeros"},
                  {"doc", table.doc},
                  {"error", table.error},
                  {"quadrature_error", table.quadrature},
                  {"anisotropy", table.anisotropy},
                  {"choices", table.choices},
                  {"choice_sizes", table.choice_sizes},
                  {"terms", terms},
                  {"grids", grids}};
  TableImage image = image_of(rows);
  image.meta = json_text(meta);
  write_table_image(image, path);
}

AlbedoTable read_albedo_exr(const std::filesystem::path& path) {
  const TableImage image = read_table_image(path);
  AlbedoTable table;
  try {
    const auto meta = json_of_text(image.meta);
    table.model = meta.at("model");
    table.doc = meta.at("doc");
    table.error = meta.at("error");
    table.quadrature = meta.at("quadrature_error");
    table.anisotropy = meta.at("anisotropy");
    table.choices = meta.at("choices").get<std::vector<std::string>>();
    table.choice_sizes = meta.at("choice_sizes").get<std::vector<int>>();
    for (const auto& g : meta.at("grids")) {
      Table grid;
      grid.channels = g.at("channels");
      grid.error = g.at("error");
      std::size_t size = 1;
      for (const auto& a : g.at("axes")) {
        const std::string name = a.at("name"), scale = a.at("scale");
        TableAxis axis{name, AxisScale::Linear, a.at("values").get<std::vector<double>>(), false};
        if (const auto named = scale_named(scale))
          axis.scale = *named;
        else
          input_error("{}: scale of {}: expected linear, log or log1p, got {}", path.string(), name, scale);
        size *= axis.values.size();
        grid.axes.push_back(std::move(axis));
      }
      const std::size_t row = table.grids.size();
      std::optional<std::vector<double>> values = values_in(image, row, size, grid.channels);
      if (!values || g.at("points") != size)
        input_error("{}: grids: {} has other numbers than its axes", path.string(), row);
      grid.values = std::move(*values);
      table.grids.push_back(std::move(grid));
    }
    for (const auto& combination : meta.at("terms")) {
      std::vector<AlbedoTerm> terms;
      for (const auto& t : combination) {
        terms.push_back({t.at("mirror"), t.at("colors").get<std::vector<std::string>>(), t.at("grid")});
        if (terms.back().grid < 0 || std::size_t(terms.back().grid) >= table.grids.size())
          input_error("{}: terms: there is no grid {}", path.string(), terms.back().grid);
      }
      table.terms.push_back(std::move(terms));
    }
  } catch (const nlohmann::json::exception& e) {
    input_error("{}: expected a table of albedos: {}", path.string(), e.what());
  }
  return table;
}

}  // namespace brdfc::measure
