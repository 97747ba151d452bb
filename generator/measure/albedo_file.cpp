// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/albedo_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/error.h"
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
  std::size_t width = 1;
  int channels = 1;
  for (const AlbedoGrid& g : table.grids) {
    width = std::max(width, g.values.size() / std::size_t(g.channels));
    channels = std::max(channels, g.channels);
  }
  const std::size_t height = std::max<std::size_t>(1, table.grids.size());
  std::vector<float> pixels(width * height * std::size_t(channels), 0.f);
  Json grids = Json::array(), terms = Json::array();
  for (std::size_t row = 0; row < table.grids.size(); ++row) {
    const AlbedoGrid& g = table.grids[row];
    const std::size_t n = g.values.size() / std::size_t(g.channels);
    for (std::size_t i = 0; i < n; ++i)
      for (int c = 0; c < channels; ++c)
        pixels[(row * width + i) * std::size_t(channels) + std::size_t(c)] =
            g.values[i * std::size_t(g.channels) + std::size_t(g.channels == 1 ? 0 : c)];
    Json axes = Json::array();
    for (const TableAxis& a : g.axes)
      axes.push_back({{"name", a.name}, {"scale", name_of(a.scale)}, {"values", a.values}});
    grids.push_back({{"row", row}, {"points", n}, {"channels", g.channels}, {"error", g.error}, {"axes", axes}});
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
  write_table_image({int(width), int(height), channels, std::move(pixels), meta.dump()}, path);
}

AlbedoTable read_albedo_exr(const std::filesystem::path& path) {
  const TableImage image = read_table_image(path);
  AlbedoTable table;
  try {
    const auto meta = nlohmann::json::parse(image.meta);
    table.model = meta.at("model");
    table.doc = meta.at("doc");
    table.error = meta.at("error");
    table.quadrature = meta.at("quadrature_error");
    table.anisotropy = meta.at("anisotropy");
    table.choices = meta.at("choices").get<std::vector<std::string>>();
    table.choice_sizes = meta.at("choice_sizes").get<std::vector<int>>();
    for (const auto& g : meta.at("grids")) {
      AlbedoGrid grid;
      grid.channels = g.at("channels");
      grid.error = g.at("error");
      std::size_t size = 1;
      for (const auto& a : g.at("axes")) {
        const std::string name = a.at("name"), scale = a.at("scale");
        TableAxis axis{name, AxisScale::Linear, a.at("values").get<std::vector<double>>()};
        if (const auto known = scale_named(scale))
          axis.scale = *known;
        else
          input_error("{}: scale of {}: expected linear, log or log1p, got {}", path.string(), name, scale);
        size *= axis.values.size();
        grid.axes.push_back(std::move(axis));
      }
      const std::size_t row = table.grids.size(), all = std::size_t(image.channels);
      if (row >= std::size_t(image.height) || size > std::size_t(image.width) || g.at("points") != size ||
          grid.channels < 1 || grid.channels > image.channels)
        input_error("{}: grids: {} has other numbers than its axes", path.string(), row);
      for (std::size_t i = 0; i < size; ++i)
        for (std::size_t c = 0; c < std::size_t(grid.channels); ++c)
          grid.values.push_back(image.pixels[(row * std::size_t(image.width) + i) * all + c]);
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
