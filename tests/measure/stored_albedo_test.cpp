// SPDX-License-Identifier: GPL-3.0-or-later
// Stored albedo tables: they belong to the current models, and equal what a tabulation would give.
#include "measure/stored_albedo.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <random>
#include <set>

#include "core/error.h"
#include "core/hash.h"
#include "measure/albedo.h"
#include "measure/albedo_file.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "measure/tabulate_albedo.h"
#include "model/choices.h"
#include "support.h"
#include "tables/table_file.h"

namespace brdfc::measure {
namespace {

using testing::HasSubstr;

void expect_equal(const AlbedoTable& a, const AlbedoTable& b) {
  EXPECT_EQ(a.model, b.model);
  EXPECT_EQ(a.choices, b.choices);
  EXPECT_EQ(a.choice_sizes, b.choice_sizes);
  EXPECT_EQ(a.error, b.error);
  EXPECT_EQ(a.quadrature, b.quadrature);
  EXPECT_EQ(a.anisotropy, b.anisotropy);
  EXPECT_EQ(a.doc, b.doc);
  ASSERT_EQ(a.terms.size(), b.terms.size());
  for (std::size_t i = 0; i < a.terms.size(); ++i) {
    ASSERT_EQ(a.terms[i].size(), b.terms[i].size());
    for (std::size_t t = 0; t < a.terms[i].size(); ++t) {
      EXPECT_EQ(a.terms[i][t].mirror, b.terms[i][t].mirror);
      EXPECT_EQ(a.terms[i][t].colors, b.terms[i][t].colors);
      EXPECT_EQ(a.terms[i][t].grid, b.terms[i][t].grid);
    }
  }
  ASSERT_EQ(a.grids.size(), b.grids.size());
  for (std::size_t g = 0; g < a.grids.size(); ++g) {
    EXPECT_EQ(a.grids[g].channels, b.grids[g].channels);
    EXPECT_EQ(a.grids[g].values, b.grids[g].values);
    EXPECT_EQ(a.grids[g].error, b.grids[g].error);
    ASSERT_EQ(a.grids[g].axes.size(), b.grids[g].axes.size());
    for (std::size_t x = 0; x < a.grids[g].axes.size(); ++x) {
      EXPECT_EQ(a.grids[g].axes[x].name, b.grids[g].axes[x].name);
      EXPECT_EQ(a.grids[g].axes[x].scale, b.grids[g].axes[x].scale);
      EXPECT_EQ(a.grids[g].axes[x].values, b.grids[g].axes[x].values);
    }
  }
}

std::vector<const Model*> stored() {
  std::vector<const Model*> out;
  for (const auto& [name, model] : models())
    if (has_albedo_table(*model)) out.push_back(model.get());
  return out;
}

/// None belongs to an outdated formula; script/fits makes them again. A model without one is tabulated for each pack.
TEST(StoredAlbedos, BelongToTheFormulas) {
  std::set<std::filesystem::path> expected, found;
  for (const Model* model : stored()) expected.insert(stored_albedo(*model).path());
  for (const auto& entry : std::filesystem::directory_iterator(expected.begin()->parent_path()))
    found.insert(entry.path());
  EXPECT_THAT(found, testing::IsSubsetOf(expected));
  EXPECT_GT(found.size(), 20u);
}

TEST(StoredAlbedos, AreReadNumberForNumber) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "table.exr";
  AlbedoTable made = tabulate_albedo(find_model("coupled"));
  const auto expect_kept = [&](const AlbedoTable& table) {
    write_albedo_exr(table, file);
    expect_equal(read_albedo_exr(file), table);
  };
  expect_kept(made);
  Table& grid = made.grids.front();
  grid.channels = 3;
  std::vector<double> values = grid.values;
  for (std::size_t i = 0, n = 2 * values.size(); i < n; ++i) values.push_back(0.01f * float(i));
  grid.values = values;
  expect_kept(made);
  std::set<AxisScale> scales;
  for (const Model* model : stored()) {
    const AlbedoTable kept = albedo_table_of(*model);
    expect_kept(kept);
    for (const Table& g : kept.grids)
      for (const TableAxis& axis : g.axes) scales.insert(axis.scale);
  }
  EXPECT_EQ(scales.size(), 3u) << "linear, log and log1p";
}

/// A grid may serve several choices only if they reflect the same light: at the middle of the sliders, and where a lobe
/// is as wide as they allow.
TEST(StoredAlbedos, AreThoseOfEachChoice) {
  std::size_t combinations = 0;
  for (const Model* model : stored()) {
    const std::vector<Choices> all = choice_combinations(model->info());
    if (all.size() == 1) continue;
    const AlbedoTable table = albedo_table_of(*model);
    combinations += all.size();
    for (const Choices& choices : third_of(all)) {
      for (const bool wide : {false, true}) {
        ParamValues values = with_choices(model->info(), choices);
        for (const ParamInfo& p : model->info().params) {
          if (p.kind == ParamKind::Color) values[p.name] = std::array<double, 3>{0.7, 0.7, 0.7};
          if (wide && (p.name == "ax" || p.name == "ay" || p.name == "alpha" || p.name == "r")) values[p.name] = 0.8;
          if (wide && (p.name == "nu" || p.name == "nv")) values[p.name] = 3.;
        }
        const auto brdf = bind_model(*model, values).brdf;
        for (const double c : {0.2, 0.9}) {
          const int azimuths = model->info().properties.isotropic ? 1 : 4;
          double sum = 0;
          for (int i = 0; i < azimuths; ++i) {
            const double phi = 2 * kPi * (i + 0.5) / azimuths;
            sum += albedo(*brdf, c, phi, "", {1e-3, 200, 1 << 8}).total().g / azimuths;
          }
          EXPECT_NEAR(lookup(table, *model, values, c).g, sum, 0.025)
              << model->info().name << " " << format_values(model->info(), complete(model->info(), values)) << " at "
              << c;
        }
      }
    }
  }
  EXPECT_GT(combinations, 40u);
}

/// Tests one model, selected by BRDFC_CELL: script/test sets it to the commit, so that all are tested in the course of
/// time. Rounding on other processors may move knots, so each table is compared with its stated error.
TEST(StoredAlbedos, AreWhatIsMadeAnew) {
  const char* given = std::getenv("BRDFC_CELL");
  const std::string choice = given ? given : "";
  const std::vector<const Model*> all = stored();
  const Model& model = *all[std::stoull(sha256(choice).substr(0, 15), nullptr, 16) % all.size()];
  const AlbedoTable kept = albedo_table_of(model), anew = tabulate_albedo(model);
  std::mt19937_64 random(37);
  std::uniform_real_distribution<double> uniform;
  double off = 0;
  for (int i = 0; i < 2000; ++i) {
    ParamValues values;
    for (const ParamInfo& p : model.info().params) {
      if (p.kind == ParamKind::Number) values[p.name] = p.soft_min + (p.soft_max - p.soft_min) * uniform(random);
      if (p.kind == ParamKind::Color)
        values[p.name] = std::array<double, 3>{uniform(random), uniform(random), uniform(random)};
      if (p.kind == ParamKind::Choice) values[p.name] = p.choices[random() % p.choices.size()];
    }
    const double c = uniform(random);
    const Rgb<double> a = lookup(kept, model, values, c), b = lookup(anew, model, values, c);
    off = std::max(off, max_component(Rgb<double>(std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b))) /
                            std::max(1.0, max_component(b)));
  }
  fmt::print("BRDFC_CELL={}: {}, stored and anew {:.2g} apart, each off by {:.2g} and {:.2g}\n", choice,
             model.info().name, off, kept.error, anew.error);
  EXPECT_LE(off, kept.error + anew.error + 1e-6) << model.info().name;
  EXPECT_LE(kept.error, 1.25 * anew.error + 1e-5) << model.info().name;
}

TEST(StoredAlbedos, OfAnotherShapeAreRefused) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "table.exr";
  const auto refusal = [&](const std::string& from, const std::string& to) -> std::string {
    write_albedo_exr(albedo_table_of(find_model("phong")), file);
    TableImage image = read_table_image(file);
    const std::size_t at = image.meta.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    image.meta.replace(at, from.size(), to);
    write_table_image(image, file);
    try {
      read_albedo_exr(file);
    } catch (const InputError& e) {
      return e.what();
    }
    return "taken";
  };
  EXPECT_THAT(refusal("\"model\"", "\"nodel\""), HasSubstr("table.exr: expected a table of albedos"));
  EXPECT_THAT(refusal("\"points\":", "\"points\":1"), HasSubstr("table.exr: grids: 0 has other numbers"));
  EXPECT_THAT(refusal("\"scale\":\"log1p\"", "\"scale\":\"lag\""),
              HasSubstr("table.exr: scale of e: expected linear, log or log1p, got lag"));
  EXPECT_THAT(refusal("\"grid\":0", "\"grid\":7"), HasSubstr("table.exr: terms: there is no grid 7"));
  EXPECT_THAT(refusal("\"channels\":1", "\"channels\":4"), HasSubstr("table.exr: grids: 0 has other numbers"));
  std::ofstream(file) << "no picture";
  EXPECT_THROW(read_albedo_exr(file), InputError);
}

}  // namespace
}  // namespace brdfc::measure
