// SPDX-License-Identifier: GPL-3.0-or-later
// Compares every registered model with its row in cases.csv, with golden.csv (values of an independent implementation,
// see make_golden.py), and with numbers from the papers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <set>
#include <sstream>

#include "check/check.h"
#include "check/chi_square.h"
#include "forms/form.h"
#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "measure/stability.h"
#include "support.h"

namespace brdfc {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> out;
  std::size_t start = 0;
  for (;;) {
    const auto at = text.find(separator, start);
    out.push_back(text.substr(start, at == std::string::npos ? at : at - start));
    if (at == std::string::npos) return out;
    start = at + 1;
  }
}

/// Rows of a CSV without quotes in tests/, by column name.
std::vector<std::map<std::string, std::string>> read_table(const std::string& name) {
  std::ifstream in(std::string(BRDFC_SOURCE_DIR) + "/tests/models/" + name);
  EXPECT_TRUE(in) << name;
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> header = split(line, ',');
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(in, line)) {
    const std::vector<std::string> fields = split(line, ',');
    EXPECT_EQ(fields.size(), header.size()) << name << ": " << line;
    std::map<std::string, std::string> row;
    for (std::size_t i = 0; i < std::min(fields.size(), header.size()); ++i) row[header[i]] = fields[i];
    rows.push_back(row);
  }
  return rows;
}

/// strtod, not stod: a number in the file that underflows is 0 here.
double number(const std::string& text) { return std::strtod(text.c_str(), nullptr); }

/// Scales the counts of the checks: evidence/run doubles it, and lowers it for the sanitizers, which look for other
/// faults.
double effort() {
  const char* text = std::getenv("BRDFC_EFFORT");
  return text ? number(text) : 1;
}

/// Parses "a=1 b=0.1:0.2:0.3".
ParamValues parameters(const Model& m, const std::string& text) {
  std::vector<std::string> assignments;
  for (std::string a : split(text, ' ')) {
    std::replace(a.begin(), a.end(), ':', ',');
    if (!a.empty()) assignments.push_back(a);
  }
  return parse_values(m.info(), assignments);
}

/// One set of parameters from a column of cases.csv.
struct Case {
  std::string model, text;
  double lossless, amplified;  // lossless < 0: not claimed
  std::size_t number = 0;      // in its column
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.model << " " << c.text; }

std::vector<Case> cases(const std::string& column) {
  std::vector<Case> out;
  for (auto& row : read_table("cases.csv"))
    for (const std::string& text : split(row["cases"] + "|" + (column == "all" ? row["stiff"] : ""), '|'))
      out.push_back(
          {row["model"], text, row["lossless"].empty() ? -1 : number(row["lossless"]), number(row["amplified"])});
  if (column == "stiff") {
    out.clear();
    for (auto& row : read_table("cases.csv"))
      for (const std::string& text : split(row["stiff"], '|'))
        out.push_back(
            {row["model"], text, row["lossless"].empty() ? -1 : number(row["lossless"]), number(row["amplified"])});
  }
  for (std::size_t i = 0; i < out.size(); ++i) out[i].number = i;
  return out;
}

/// Of each model a third, and at least one.
std::vector<Case> third_of_cases(const std::string& column) {
  return third_of(cases(column), [](const Case& c) { return c.model; });
}

/// View cosines at which histograms of samples are compared with the pdf, for each row of column `cases`.
constexpr double kHistogramCosines[] = {1, 0.7, 0.3, 0.1};

std::string test_name(const testing::TestParamInfo<Case>& info) {
  return fmt::format("{}_{}", info.param.model, info.param.number);
}

TEST(Registry, EveryModelHasACaseAndARowOfTheDocsAndNoneIsLeftOver) {
  std::set<std::string> registered, in_cases, in_docs;
  for (const auto& [name, model] : models()) registered.insert(name);
  for (auto& row : read_table("cases.csv")) EXPECT_TRUE(in_cases.insert(row["model"]).second) << row["model"];
  std::ifstream docs(std::string(BRDFC_SOURCE_DIR) + "/docs/models.md");
  ASSERT_TRUE(docs);
  for (std::string line; std::getline(docs, line);)
    if (line.starts_with("| `")) in_docs.insert(line.substr(3, line.find('`', 3) - 3));
  EXPECT_FALSE(registered.empty());
  EXPECT_EQ(in_cases, registered) << "tests/models/cases.csv needs one row a model";
  for (const std::string& name : registered)
    EXPECT_TRUE(in_docs.count(name)) << "docs/models.md needs a table row starting with | `" << name << "`";
}

class ModelCase : public testing::TestWithParam<Case> {
 protected:
  const Model& model() const { return find_model(GetParam().model); }
  measure::BoundModel bound() const { return measure::bind_model(model(), parameters(model(), GetParam().text)); }
};

TEST_P(ModelCase, HistogramOfSamplesFollowsThePdf) {
  if (!model().has_scatter()) return;
  const measure::BoundModel b = bound();
  // Sidak correction: a correct sampler fails anywhere in the whole of this suite with a probability of 1 %.
  const double threshold = 1 - std::pow(0.99, 1. / double(std::size(kHistogramCosines) * cases("cases").size()));
  std::uint64_t seed = 1;
  for (const double c : kHistogramCosines) {
    const check::ChiSquare r =
        check::chi_square(b, direction(c, 0.4 + c), std::max(10000, int(20000 * effort())), seed++);
    // More samples require a more precise pdf than quadrature can give.
    if (!r.converged && effort() > 1) continue;
    ASSERT_TRUE(r.converged) << b.label << " cos_theta_o=" << c;
    EXPECT_GT(r.degrees, 20) << b.label << ": too few cells to tell anything";
    EXPECT_GT(r.p, threshold) << b.label << " cos_theta_o=" << c << " chi2=" << r.statistic << " dof=" << r.degrees;
  }
}

TEST_P(ModelCase, AlbedoConservesAndAgreesWithSampling) {
  const measure::BoundModel b = bound();
  for (const double c : {1., 0.5, 0.1}) {
    const measure::Albedo a = measure::albedo(*b.brdf, c, 0.3, b.label);
    EXPECT_LT(a.error, 1e-4) << b.label;
    if (model().info().properties.conserving && !is_compensated(model().info(), b.values)) {
      const double tables = table_error(model().info(), parameters(model(), GetParam().text));
      EXPECT_LE(max_component(a.total()), 1 + 1e-9 + a.error + tables) << b.label;
    }
    const measure::SampledAlbedo s = measure::sampled_albedo(*b.brdf, c, 0.3, b.label);
    const Rgb<double> d = a.scattered - s.scattered;
    EXPECT_LE(std::max({std::abs(d.r), std::abs(d.g), std::abs(d.b)}), 7 * s.standard_error + a.error + 1e-9)
        << b.label;
  }
}

TEST_P(ModelCase, LostSamplesPointWhereNothingIsScattered) {
  // The aimed form divides f by the pdf in the direction of a sample, also of a lost one.
  if (!model().has_scatter()) return;
  const measure::BoundModel b = bound();
  measure::Random random(5);
  for (int i = 0; i < 4000; ++i) {
    Vec3<double> wo = measure::uniform_direction(random);
    if (measure::two_sided(model(), *b.brdf) && i % 2 == 1) wo.z = -wo.z;
    const Vec3<double> u{measure::uniform(random), measure::uniform(random), measure::uniform(random)};
    const Sample<double> s = b.brdf->sample(wo, u);
    if (s.pdf > 0) continue;
    ASSERT_EQ(max_component(b.brdf->eval(s.wi, wo)), 0) << b.label << " wo.z=" << wo.z;
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, ModelCase, testing::ValuesIn(third_of_cases("cases")), test_name);

TEST(Sampling, FollowsThePdfAtTheExtremesToo) {
  // Extreme parameters, and all parameters at grazing views. Where the pdf is a ridge that no quadrature resolves,
  // nothing can be compared.
  std::vector<std::pair<Case, double>> asked;
  std::size_t elsewhere = 0;
  for (const Case& c : cases("stiff"))
    for (const double cosine : {0.6, 0.02}) asked.emplace_back(c, cosine);
  for (const Case& c : cases("cases")) {
    asked.emplace_back(c, 0.02);
    if (find_model(c.model).has_scatter()) elsewhere += std::size(kHistogramCosines);
  }
  std::erase_if(asked, [](const auto& a) { return !find_model(a.first.model).has_scatter(); });
  std::vector<check::ChiSquare> found(asked.size());
  std::vector<std::string> where(asked.size());
  tbb::parallel_for(std::size_t(0), asked.size(), [&](std::size_t i) {
    const auto& [c, cosine] = asked[i];
    const Model& m = find_model(c.model);
    const measure::BoundModel b = measure::bind_model(m, parameters(m, c.text));
    found[i] =
        check::chi_square(b, direction(cosine, 0.4 + double(i)), std::max(10000, int(20000 * effort())), 100 + i);
    where[i] = fmt::format("{} cos_theta_o={}", b.label, cosine);
  });
  const auto judged =
      std::size_t(std::count_if(found.begin(), found.end(), [](const check::ChiSquare& r) { return r.converged; }));
  const double threshold = 1 - std::pow(0.99, 1. / double(judged));
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!found[i].converged) continue;
    EXPECT_GT(found[i].p, threshold) << where[i] << " chi2=" << found[i].statistic << " dof=" << found[i].degrees;
  }
  fmt::print("{} histograms of {} at the extremes, {} elsewhere\n", judged, found.size(), elsewhere);
  EXPECT_GE(judged, found.size() * 3 / 4);
  EXPECT_GE(judged + elsewhere, 500u);
}

class StiffCase : public ModelCase {};

TEST_P(StiffCase, RoundingStaysNearThatOfTheInputs) {
  const ParamValues v = parameters(model(), GetParam().text);
  const measure::Stability f = measure::float_stability(model(), v, 512, 3),
                           d = measure::double_stability(model(), v, 128, 4);
  EXPECT_LE(f.amplified, GetParam().amplified) << f.amplified_where;
  EXPECT_LE(d.amplified, GetParam().amplified) << d.amplified_where;
}

TEST_P(StiffCase, LosslessModelsLoseNothing) {
  if (GetParam().lossless < 0) return;
  ParamValues v = parameters(model(), GetParam().text);
  for (const ParamInfo& p : model().info().params)
    if (p.kind == ParamKind::Color) v[p.name] = 1.;
  const measure::BoundModel b = measure::bind_model(model(), v);
  for (const double c : {1., 0.9, 0.5, 0.1, 0.01}) {
    const measure::Albedo a = measure::albedo(*b.brdf, c, 1, b.label);
    const Rgb<double> t = a.total();
    EXPECT_NEAR(t.r, 1, GetParam().lossless) << b.label << " cos_theta_o=" << c << " error=" << a.error;
    EXPECT_NEAR(t.g, 1, GetParam().lossless) << b.label;
    EXPECT_NEAR(t.b, 1, GetParam().lossless) << b.label;
  }
}

INSTANTIATE_TEST_SUITE_P(Stiff, StiffCase, testing::ValuesIn(third_of_cases("all")), test_name);

class EveryModel : public testing::TestWithParam<std::string> {};

TEST_P(EveryModel, HasTheDeclaredProperties) {
  for (const check::Row& row : check::check_model(find_model(GetParam()), {.effort = effort()}))
    EXPECT_NE(row.result, check::Result::Failed)
        << row.model << ": " << row.check << ": " << row.worst << " (limit " << row.limit << ") at " << row.where;
}

std::string name_itself(const testing::TestParamInfo<std::string>& info) { return info.param; }
INSTANTIATE_TEST_SUITE_P(Models, EveryModel, testing::ValuesIn(third_of(model_names())), name_itself);

class GoldenModel : public testing::TestWithParam<std::string> {};

TEST_P(GoldenModel, HasGoldenValuesOfEveryKindAndMatchesThem) {
  const Model& m = find_model(GetParam());
  std::map<std::string, int> seen;
  for (auto& row : read_table("golden.csv")) {
    if (row["model"] != GetParam()) continue;
    ++seen[row["kind"]];
    const measure::BoundModel b = measure::bind_model(m, parameters(m, row["parameters"]));
    const auto vec = [&](const char* w) {
      return Vec3<double>{number(row[std::string(w) + "_x"]), number(row[std::string(w) + "_y"]),
                          number(row[std::string(w) + "_z"])};
    };
    double tolerance = number(row["tolerance"]);
    const Rgb<double> want{number(row["r"]), number(row["g"]), number(row["b"])};
    Rgb<double> got;
    if (row["kind"] == "f") {
      got = b.brdf->eval(vec("wi"), vec("wo"));
    } else if (row["kind"] == "pdf") {
      got = Rgb<double>(b.brdf->pdf(vec("wi"), vec("wo")));
    } else {
      ASSERT_EQ(row["kind"], "albedo");
      const measure::Albedo a = measure::albedo(*b.brdf, number(row["wo_z"]), 0, b.label);
      got = a.total();
      tolerance += 2 * a.error;
    }
    for (const auto& [g, w] : {std::pair{got.r, want.r}, {got.g, want.g}, {got.b, want.b}})
      EXPECT_NEAR(g, w, tolerance * (row["kind"] == "albedo" ? 1 : w))
          << row["kind"] << " of " << b.label << " wi=" << row["wi_x"] << "," << row["wi_y"] << "," << row["wi_z"]
          << " wo=" << row["wo_x"] << "," << row["wo_y"] << "," << row["wo_z"];
  }
  if (m.has_scatter()) {
    EXPECT_GE(seen["f"], 10) << "tests/models/make_golden.py lacks this model";
    EXPECT_GE(seen["pdf"], 10);
  }
  EXPECT_GE(seen["albedo"], 4);
}

std::vector<std::string> golden_models() {
  // The models in make_golden.py; a user's model need not be there.
  std::set<std::string> names;
  for (auto& row : read_table("golden.csv")) names.insert(row["model"]);
  return {names.begin(), names.end()};
}
INSTANTIATE_TEST_SUITE_P(Models, GoldenModel, testing::ValuesIn(golden_models()), name_itself);

TEST(Landmarks, AshikhminShirleyLosesWhatTheFurnacePictureShows) {
  const Model& m = find_model("ashikhmin_shirley");
  const measure::BoundModel b =
      measure::bind_model(m, parse_values(m.info(), {"part=specular", "rs=1", "nu=10", "nv=10"}));
  EXPECT_NEAR(measure::albedo(*b.brdf, 1).total().r, 0.6957, 5e-5);  // the paper: "about 68 %"
  EXPECT_NEAR(measure::albedo(*b.brdf, 0.5).total().r, 0.613, 5e-4);
  EXPECT_NEAR(measure::albedo(*b.brdf, std::cos(80 * kPi / 180)).total().r, 0.539, 5e-4);
  EXPECT_NEAR(measure::albedo(*b.brdf, 0.09).total().r, 0.52, 5e-3);
}

TEST(Landmarks, CoupledWithWhiteMatteIsAPerfectFurnaceAtEveryAngle) {
  const Model& m = find_model("coupled");
  for (const char* r0 : {"r0=0", "r0=0.05", "r0=0.9"}) {
    const measure::BoundModel b = measure::bind_model(m, parse_values(m.info(), {"rm=1", r0}));
    for (int i = 1; i <= 20; ++i)
      EXPECT_NEAR(measure::albedo(*b.brdf, i / 20.).total().g, 1, 1e-9) << r0 << " " << i / 20.;
  }
}

TEST(Landmarks, TheConstructionFromSech2IsTheClosedForm) {
  // Two ways to compute the same function: from a kernel by inverting its marginal, and by eq. 17.
  for (const double n : {0., 1e-9, 0.001, 0.3, 0.99, 1.01, 4., 25., 1e3, 1e4}) {
    const auto made = find_model("lossless").make_double({{"n", n}});
    const auto closed = find_model("radziszewski_alda").make_double({{"n", n}, {"part", std::string("latitudinal")}});
    measure::Random random(7);
    for (const auto& [wi, wo] : measure::direction_pairs(*closed, 500, random)) {
      const double want = closed->eval(wi, wo).r;
      // Both know x - y only up to the rounding of the directions, which the glossiness amplifies. Below 1e-300 numbers
      // have few significant digits.
      EXPECT_NEAR(made->eval(wi, wo).r, want, want * (1e-14 + 2e-15 * n) + 1e-300) << n;
    }
  }
}

TEST(Landmarks, EveryKernelLosesNothing) {
  // Over x = cos^2 theta_i alone, in small steps: because of the kernels' edges, quadrature over directions has errors
  // of up to 1e-5.
  const Model& m = find_model("lossless");
  for (const char* shape : {"kernel=exponential", "kernel=table", "kernel=sech2"})
    for (const char* n : {"n=3", "n=60"})
      for (const double cosine : {1., 0.5, 0.05}) {
        const measure::BoundModel b = measure::bind_model(m, parse_values(m.info(), {shape, n}));
        constexpr int kSteps = 20000;
        double sum = 0;
        for (int i = 0; i < kSteps; ++i)
          for (const double at : {0.5 - std::sqrt(1 / 12.), 0.5 + std::sqrt(1 / 12.)})
            sum += b.brdf->eval(direction(std::sqrt((i + at) / kSteps), 1), direction(cosine, 2)).g / 2;
        EXPECT_NEAR(kPi * sum / kSteps, 1, 1e-7) << b.label << " cos_theta_o=" << cosine;
      }
}

TEST(Landmarks, RadziszewskiAldaIsLambertAtZeroGloss) {
  const Model& m = find_model("radziszewski_alda");
  const measure::BoundModel b = measure::bind_model(m, parse_values(m.info(), {"n=0", "tint=1"}));
  for (const double c : {0.05, 0.4, 1.})
    EXPECT_NEAR(b.brdf->eval(direction(c, 1), direction(0.3, 2)).r, 1 / kPi, 1e-15);
}

}  // namespace
}  // namespace brdfc
