// SPDX-License-Identifier: GPL-3.0-or-later
// The generator's output: shaders, closure counts, refusals and the extension's files.
#include "pack/pack.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "forms/aimed.h"
#include "forms/form.h"
#include "measure/fold.h"
#include "measure/stored_albedo.h"
#include "measure/tabulate_albedo.h"
#include "model/choices.h"
#include "model/sampling.h"
#include "pack/addon.h"
#include "plan/costs.h"
#include "plan/plan.h"
#include "print/osl_library.h"
#include "print/osl_statements.h"
#include "support.h"

namespace brdfc::pack {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

/// Depth of the left spine of a printed sum, which must fit Cycles' stack of 16.
int nesting(const std::string& sum) {
  int depth = 0, most = 0;
  for (char c : sum) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    most = std::max(most, depth);
  }
  return most;
}

measure::AlbedoTable empty_table(const Model& model) {
  measure::AlbedoTable t;
  t.terms.resize(choice_combinations(model.info()).size());
  return t;
}

std::string read(const fs::path& p) {
  std::ifstream in(p, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace

// Not anonymous: templates of other files are instantiated with these.
namespace pack_test {

/// Lambert with errors that a build must report.
template <class T> struct Broken {
  Rgb<T> rho;
  static ModelInfo info() {
    return {.name = "broken", .label = "", .paper = "", .equations = "", .doc = "", .properties = {}, .params = {}};
  }
  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Reflectance", {0.5, 0.5, 0.5}, ""});
  }
  // NaN for light more than 60 degrees from the normal.
  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>&) const { return rho * sqrt(wi.z - T(0.5)); }
  T pdf(const Vec3<T>& wi, const Vec3<T>&) const { return cosine_pdf(wi); }
  Sample<T> sample(const Vec3<T>&, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_cosine(u.y, u.z);
    return {wi, rho * sqrt(wi.z - T(0.5)), cosine_pdf(wi)};
  }
};

/// An exact form that needs more closure slots than Cycles has.
template <class T> struct Greedy : Broken<T> {
  ClosureSum<T> exact(const Vec3<T>&) const {
    return ClosureSum<T>(22, Closure<T>(ClosureKind::DiffuseRamp, this->rho));
  }
};

/// Only delta terms.
template <class T> struct MirrorOnly {
  Rgb<T> ks;
  static ModelInfo info() {
    return {
        .name = "mirror_only", .label = "", .paper = "", .equations = "", .doc = "", .properties = {}, .params = {}};
  }
  template <class Visitor> void parameters(const Visitor& v) {
    v(ks, ColorSpec{"ks", "Reflectance", {0.5, 0.5, 0.5}, ""});
  }
  Rgb<T> mirror(const Vec3<T>& wo) const { return ks * (T(1) - wo.z / T(2)); }
};

/// A number that no formula reads, whose name occurs in a comment in the shader's text.
template <class T> struct Unread : MirrorOnly<T> {
  T viewer;
  template <class Visitor> void parameters(const Visitor& v) {
    MirrorOnly<T>::parameters(v);
    v(viewer, NumberSpec{"viewer", "Viewer", 0.5, 0, 1, 0, 1, ""});
  }
};

}  // namespace pack_test

namespace {

TEST(Shader, SumIsABalancedTree) {
  std::vector<print::Value> terms;
  for (int i = 0; i < 64; ++i) terms.push_back(fmt::format("t{}", i));
  const std::string sum = print::osl_value(print::balanced_sum(terms));
  EXPECT_EQ(std::count(sum.begin(), sum.end(), '+'), 63);
  EXPECT_LE(nesting(sum), 6);
  EXPECT_EQ(print::osl_value(print::balanced_sum({"a", "b", "c"})), "(a + b) + c");
  EXPECT_EQ(print::osl_value(print::balanced_sum({})), "0");
}

TEST(Shader, MoreClosuresThanCyclesKeepsAreRefused) {
  const detail::ModelOf<pack_test::Greedy> greedy;
  try {
    forms::form("exact")->write(greedy, empty_table(greedy));
    FAIL() << "not refused";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("66 closure slots"));
    EXPECT_THAT(e.what(), HasSubstr("64"));
  }
}

TEST(Shader, EveryFormStaysInsideWhatCyclesKeeps) {
  for (const auto& [name, model] : models())
    for (const forms::Form* kind : forms::forms_of(*model)) {
      if (kind->native()) continue;
      const forms::Shader s = kind->write(*model, empty_table(*model));
      EXPECT_LE(s.slots, kMaxClosures) << s.name;
      // In addition to sampling, aimed forms contain the computations for lamps (including those cut off by the
      // horizon), a base and the model's value; lossless' value is a long sum, and its base has eight colours. That of
      // microfacet contains a polynomial with 45 coefficients for one of its choices, and closures that replace all the
      // others for some values. The base of disney has a matte ramp beside Burley's term. The fit of hapke has its
      // albedo's sum of terms. thin_film has Fresnel's equations of two surfaces and a series. kelemen has polynomials
      // for the albedos of two directions and for their mean.
      const bool aimed = kind == forms::form("aimed");
      const int of_others = name == "hapke" ? 800 : 600;
      const bool is_long = name == "disney" || name == "kelemen" || name == "thin_film";
      const int of_aimed = name == "lossless" ? 2900 : is_long ? 1600 : 1510;
      EXPECT_LT(s.operations, name == "factors" ? 2400 : aimed ? of_aimed : of_others) << s.name;
      EXPECT_THAT(s.source, HasSubstr("shader " + s.name + "("));
    }
}

TEST(Shader, AnAimedFormWithoutABaseHasNoEmptyBlock) {
  const Model& m = find_model("radziszewski_alda");
  const std::string source = forms::form("aimed")->write(m, empty_table(m)).source;
  EXPECT_THAT(source, Not(testing::ContainsRegex("[{][ \n]*[}]")));
}

// OSL's compiler checks the index at each mention of an element: with an element in every formula that reads it, a
// shader took two to three times as long to compile.
TEST(Shader, FormulasOfAimedFormsReadNoElementsOfTheLampsArrays) {
  const std::regex element(R"(\bkept_\w+\[[a-z]\w*\])");
  const std::regex moved(R"(\s*(?:matrix \w+ = kept_\w+\[\w+\]|kept_\w+\[lobes\] = matrix\([^;]*\));)");
  const Model& ward = find_model("ward");
  std::istringstream source(forms::form("aimed")->write(ward, empty_table(ward)).source);
  int found = 0;
  for (std::string line; std::getline(source, line);)
    if (std::regex_search(line, element)) {
      ++found;
      EXPECT_TRUE(std::regex_match(line, moved)) << line;
    }
  EXPECT_GE(found, 7);
}

TEST(Shader, AModelWithoutScatteringIsItsDeltaTerms) {
  const detail::ModelOf<pack_test::MirrorOnly> model;
  EXPECT_FALSE(model.has_scatter());
  EXPECT_EQ(forms::forms_of(model), (std::vector{forms::form("exact"), forms::form("nodes")}));
  const forms::Shader s = forms::form("exact")->write(model, empty_table(model));
  EXPECT_THAT(s.source, HasSubstr("BSDF = weight_0 * reflection(frame_n);"));
  const std::string body = s.source.substr(s.source.find("\n{\n", s.source.find("\nshader ")));
  constexpr std::ptrdiff_t kOfClamping = 2;
  EXPECT_EQ(s.statements, std::count(body.begin(), body.end(), ';') - kOfClamping) << "there is no loop";
  EXPECT_LT(forms::form("exact")->error(model, {}).albedo, 1e-6);
  const measure::AlbedoTable table = measure::tabulate_albedo(model);
  EXPECT_NEAR(lookup(table, model, {{"ks", 0.8}}, 0.5).g, 0.6, 1e-6);
}

TEST(Shader, KeepsThoseParametersWithinTheirRangesThatItReads) {
  const detail::ModelOf<pack_test::Unread> model;
  const forms::Shader unread = forms::form("exact")->write(model, empty_table(model));
  EXPECT_THAT(unread.source, HasSubstr("float viewer = 0.5"));
  EXPECT_THAT(unread.source, HasSubstr("// Towards the viewer"));
  EXPECT_THAT(unread.source, Not(HasSubstr("bounded_viewer")));
  const Model& ward = find_model("ward");
  const forms::Shader read = forms::form("sampled")->write(ward, empty_table(ward));
  EXPECT_THAT(read.source, HasSubstr("float bounded_ax = clamp(ax, "));
  EXPECT_THAT(read.source, HasSubstr("float ax = bounded_ax;"));
  EXPECT_THAT(read.source, HasSubstr("color bounded_ks = max(ks, color(0"));
  EXPECT_THAT(forms::form("sampled")->write(find_model("hapke"), empty_table(find_model("hapke"))).source,
              HasSubstr("color bounded_w = clamp(w, color(0"));
}

TEST(Shader, AFixedParameterLeavesTheText) {
  const Model& m = find_model("ashikhmin_shirley");
  const forms::Shader all = forms::form("sampled")->write(m, empty_table(m));
  const forms::Shader specular =
      forms::form("sampled")->write(m, empty_table(m), {{{"part", std::string("specular")}, {"rotation", 0.0}}});
  EXPECT_THAT(all.source, HasSubstr("color rd ="));
  EXPECT_THAT(all.source, HasSubstr("int part ="));
  EXPECT_THAT(specular.source, Not(HasSubstr("int part")));
  EXPECT_THAT(specular.source, Not(HasSubstr("rotation")));
  EXPECT_LT(specular.operations, all.operations);
  EXPECT_LT(specular.statements, all.statements);
  EXPECT_LT(specular.source.size(), all.source.size());
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(Shader, TablesThatChoicesShareStandThereOnce) {
  const Model& m = find_model("ashikhmin_shirley");
  const forms::Shader s = forms::form("sampled")->write(m, empty_table(m));
  for (const char* table : {"specular_loss", "specular_softness", "mean_loss", "mean_matte"})
    EXPECT_EQ(count(s.source, fmt::format("float {}[", table)), 1u) << table;
  EXPECT_GT(count(s.source, "specular_loss, "), 1u) << "more than one look-up reads it";
}

/// A file contains the text and its bytecode, whether or not the output is linked.
TEST(Shader, AnAlbedoOutputOfLargeTablesIsAShaderOfItsOwn) {
  const Model& m = find_model("ward");
  const measure::AlbedoTable table = measure::albedo_table_of(m);
  const forms::Shader apart = forms::form("sampled")->write(m, table);
  EXPECT_THAT(apart.source, Not(HasSubstr("Albedo")));
  EXPECT_THAT(apart.source, Not(HasSubstr("knots_")));
  EXPECT_LT(apart.source.size(), 10000u);
  EXPECT_THAT(apart.albedo, HasSubstr("shader brdfc_ward_sampled_albedo("));
  EXPECT_THAT(apart.albedo, HasSubstr("output color Albedo = 0)"));
  EXPECT_THAT(apart.albedo, HasSubstr("float ax = "));
  EXPECT_THAT(apart.albedo, Not(HasSubstr("BSDF")));
  const ParamValues known = {{"ax", 0.2}, {"ay", 0.2}, {"normalisation", std::string("bounded")}};
  const forms::Shader small = forms::form("sampled")->write(m, measure::fold(table, m, known), {known});
  EXPECT_EQ(small.albedo, "");
  EXPECT_THAT(small.source, HasSubstr("output color Albedo = 0)"));
  for (const auto& [name, model] : models())
    for (const forms::Form* kind : forms::forms_of(*model)) {
      if (kind->made_of_fit()) continue;  // holds tables of its own
      const std::string text = kind->write(*model, measure::has_albedo_table(*model) ? measure::albedo_table_of(*model)
                                                                                     : empty_table(*model))
                                   .source;
      // Two aimed forms still contain too much for each of their many choices.
      const bool longer = kind == forms::form("aimed") && (name == "ashikhmin_shirley" || name == "radziszewski_alda");
      // A list of nodes is in no file, but Blender makes a node of each entry.
      EXPECT_LE(text.size(), kind->native() ? 226000u : longer ? 200000u : 116500u) << name << " " << kind->name();
    }
}

TEST(Shader, ABlackDiffuseBaseRemovesTheDiffuseLobe) {
  const Model& m = find_model("ashikhmin_shirley");
  const ParamValues both = {{"part", std::string("both")}};
  ParamValues black = both;
  black["rd"] = 0.0;
  const forms::Recording with = forms::form("sampled")->recordings(m, both)[0];
  const forms::Recording without = forms::form("sampled")->recordings(m, black)[0];
  EXPECT_LT(without.operations(), with.operations());
  EXPECT_THAT(without.program->inputs(), Not(testing::Contains("rd")));
  EXPECT_THAT(with.program->inputs(), testing::Contains("rd"));
}

TEST(Shader, WithoutDispersionOneRefractionIsLeft) {
  for (const char* name : {"glass", "fresnel_dielectric"}) {
    const Model& m = find_model(name);
    const auto refractions = [&](const ParamValues& fixed) {
      return count(forms::form("exact")->write(m, empty_table(m), {fixed}).source, "* refraction(");
    };
    EXPECT_EQ(refractions({}), 3u) << name;
    EXPECT_EQ(refractions({{"dispersion", 0.5}}), 3u) << name;
    EXPECT_EQ(refractions({{"dispersion", 0.0}}), 1u) << name;
  }
}

TEST(Shader, TextOnlyHoldsTheLibraryItCalls) {
  const std::string library = print::library_for({"brdfc_log1p", "sqrt"});
  EXPECT_THAT(library, HasSubstr("float brdfc_log1p("));
  EXPECT_THAT(library, Not(HasSubstr("brdfc_expm1(")));
  EXPECT_THROW(print::library_for({"brdfc_missing"}), std::logic_error);
}

TEST(Pack, ABadValueStopsTheBuildAndNamesWhere) {
  const detail::ModelOf<pack_test::Broken> broken;
  try {
    measure::tabulate_albedo(broken);
    FAIL() << "NaN reached a table";
  } catch (const ValueError& e) {
    EXPECT_THAT(e.what(), HasSubstr("broken"));
    EXPECT_THAT(e.what(), HasSubstr("rho="));
    EXPECT_THAT(e.what(), HasSubstr("wi"));
    EXPECT_THAT(e.what(), HasSubstr("nan"));
  }
  EXPECT_THROW(forms::form("sampled")->error(broken, {}), ValueError);
}

TEST(Shader, AnExactFormThatHoldsForOneChoiceLacksTheParameter) {
  const Model& m = find_model("coupled");
  const ParamValues only = forms::form("exact")->values(m, {});
  ASSERT_EQ(only.size(), 1u);
  EXPECT_EQ(std::get<std::string>(only.at("fresnel")), "schlick");
  EXPECT_TRUE(forms::form("sampled")->values(m, {}).empty());
  const measure::AlbedoTable t = empty_table(m);
  EXPECT_THAT(forms::form("exact")->write(m, t).source, Not(HasSubstr("int fresnel")));
  EXPECT_THAT(forms::form("sampled")->write(m, t).source, HasSubstr("int fresnel"));
  try {
    forms::form("exact")->write(m, t, {{{"fresnel", std::string("dielectric")}}});
    FAIL() << "expected a refusal";
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "coupled: the exact form exists only for fresnel=schlick");
  }
}

TEST(Shader, AFitThatTheExtensionHoldsIsForDefaultsButForItsNumberAndFactors) {
  const Model& m = find_model("lafortune");
  const ParamValues only = forms::form("fitted")->values(m, {});
  EXPECT_EQ(only, (ParamValues{{"cxy", -1.0}, {"cz", 0.8}}));
  ParamValues others = complete(m.info(), {});
  others.erase("e");
  EXPECT_TRUE(forms::form("fitted")->values(m, others).empty()) << "one number is open, any may be";
  others["e"] = 4.0;
  others.erase("cz");
  EXPECT_TRUE(forms::form("fitted")->values(m, others).empty());
  EXPECT_TRUE(forms::form("sampled")->values(m, {}).empty());
  const std::string source =
      forms::form("fitted")->write(m, measure::fold(measure::albedo_table_of(m), m, only)).source;
  for (const char* socket : {"  float e = ", "  color ks = "}) EXPECT_THAT(source, HasSubstr(socket));
  for (const char* gone : {"float cxy", "float cz"}) EXPECT_THAT(source, Not(HasSubstr(gone)));
}

class PackFiles : public ::testing::Test {
 protected:
  Options options(const fs::path& out) const {
    return {
        out, BRDFC_SOURCE_DIR "/blender_addon", BRDFC_SOURCE_DIR "/python/brdfc", plan::plan_models({"lambert"}), {},
        {}};
  }
  TempFolder temp;
};

TEST_F(PackFiles, TheSameModelsGiveTheSameBytes) {
  const Result a = build_pack(options(temp.path() / "a")), b = build_pack(options(temp.path() / "b"));
  EXPECT_EQ(read(a.zip), read(b.zip));
  EXPECT_FALSE(read(a.zip).empty());
}

TEST_F(PackFiles, ManifestAndFilesAgree) {
  const Result pack = build_pack(options(temp.path()));
  const auto manifest = nlohmann::json::parse(read(pack.folder / "manifest.json"));
  EXPECT_EQ(manifest.at("format"), 1);
  const auto& lambert = manifest.at("models").at("lambert");
  EXPECT_EQ(lambert.at("auto"), "exact");
  for (const auto& [form, r] : lambert.at("representations").items())
    EXPECT_TRUE(
        fs::exists(pack.folder / r.at(form == "twin" || form == "nodes" ? "nodes" : "shader").get<std::string>()))
        << form;
  EXPECT_TRUE(fs::exists(pack.folder / lambert.at("albedo").at("table").get<std::string>()));
  EXPECT_TRUE(fs::exists(pack.folder / "blender_manifest.toml"));
  for (const auto& entry : fs::recursive_directory_iterator(pack.folder)) EXPECT_NE(entry.path().extension(), ".oso");
}

TEST_F(PackFiles, TheManifestForBlenderHasTheVersionOfTheBuild) {
  const Result pack = build_pack(options(temp.path() / "out"));
  EXPECT_THAT(read(pack.folder / "blender_manifest.toml"), HasSubstr("\nversion = \"" BRDFC_VERSION "\"\n"));
  EXPECT_THAT(pack.zip.filename().string(), HasSubstr(BRDFC_VERSION));
  Options other = options(temp.path() / "other");
  other.addon = temp.path() / "addon";
  fs::create_directory(other.addon);
  std::ofstream(other.addon / "blender_manifest.toml") << "version = \"3\"\n";
  EXPECT_THAT([&] { build_pack(other); },
              ThrowsMessage<InputError>(HasSubstr("blender_manifest.toml: expected the line version = \"@version@\"")));
}

TEST_F(PackFiles, WhatIsCutToASceneHasAnIdOfItsOwn) {
  EXPECT_EQ(extension_id(""), "brdfc_shaders");
  EXPECT_EQ(extension_id("small-lamp"), "brdfc_shaders_small_lamp");
  EXPECT_EQ(extension_id("__My  Scene (2)__"), "brdfc_shaders_my_scene_2");
  EXPECT_EQ(extension_id("\xc3\xa9\"\n"), "brdfc_shaders_scene") << "an id has small letters of ASCII";
  Options o = options(temp.path() / "out");
  o.cut = "small-lamp";
  const Result pack = build_pack(o);
  EXPECT_EQ(pack.zip.filename(), "brdfc_shaders_small_lamp-" BRDFC_VERSION ".zip");
  EXPECT_EQ(pack.folder.filename(), "brdfc_shaders");
  const std::string toml = read(pack.folder / "blender_manifest.toml");
  EXPECT_THAT(toml, HasSubstr("\nid = \"brdfc_shaders_small_lamp\"\n"));
  EXPECT_THAT(toml, HasSubstr("\nname = \"brdfc Shaders (small_lamp)\"\n"));
}

TEST_F(PackFiles, ManifestHasTheCostsThatAreKnown) {
  const fs::path table = temp.path() / "costs.csv";
  std::ofstream(table) << "model,form,cost,cost_min\nlambert,glossy,1,1\nlambert,exact,0.75,0.7\n";
  Options o = options(temp.path() / "out");
  o.costs = plan::Costs(table);
  const auto manifest = nlohmann::json::parse(read(build_pack(o).folder / "manifest.json"));
  const auto& forms = manifest.at("models").at("lambert").at("representations");
  EXPECT_EQ(forms.at("exact").at("cost"), 0.75);
  EXPECT_TRUE(forms.at("sampled").at("cost").is_null());
}

TEST_F(PackFiles, ATableOfCostsThatIsWrongIsRefused) {
  const fs::path table = temp.path() / "costs.csv";
  EXPECT_EQ(plan::Costs(table).of(find_model("lambert"), *forms::form("exact")), std::nullopt) << "there is no file";
  const auto refusal = [&](const std::string& text) -> std::string {
    std::ofstream(table) << text;
    try {
      const plan::Costs costs(table);
    } catch (const InputError& e) {
      return e.what();
    }
    return "not refused";
  };
  const std::string head = "model,form,cost\n";
  EXPECT_THAT(refusal(""), HasSubstr("costs.csv: line 1: expected the columns model,form,cost"));
  EXPECT_THAT(refusal("lambert,exact,1\n"), HasSubstr("line 1: expected the columns model,form,cost"));
  EXPECT_THAT(refusal(head + "lambert,exact,1\nlambert,sampled,fast\n"),
              HasSubstr("line 3: cost: expected a positive number, got 'fast'"));
  for (const char* cost : {"", "0", "-1", "nan", "inf", "1x"})
    EXPECT_THAT(refusal(head + "lambert,exact," + cost), HasSubstr("line 2: cost: expected")) << cost;
  EXPECT_THAT(refusal(head + "lambert,excat,1\n"), HasSubstr("line 2: form: unknown form 'excat'"));
  EXPECT_THAT(refusal(head + ",exact,1\n"), HasSubstr("line 2: model: expected a name"));
  EXPECT_THAT(refusal(head + "lambert,exact,1\nlambert,exact,2\n"), HasSubstr("line 3: form: expected one row"));
}

TEST(Costs, ThoseOfTheExtensionAreMeasured) {
  const plan::Costs costs(BRDFC_SOURCE_DIR "/blender_addon/costs.csv");
  for (const auto& [model, kind] :
       {std::pair("coupled", forms::form("exact")), std::pair("ward", forms::form("sampled")),
        std::pair("phong", forms::form("fitted")), std::pair("ward", forms::form("aimed")),
        std::pair("phong", forms::form("twin"))}) {
    const std::optional<double> cost = costs.of(find_model(model), *kind);
    ASSERT_TRUE(cost) << model << " " << kind->name();
    EXPECT_GT(*cost, 0.2);
    EXPECT_LT(*cost, 10);
  }
}
TEST_F(PackFiles, AFailedBuildLeavesTheOldPackAsItWas) {
  const Result pack = build_pack(options(temp.path()));
  const std::string before = read(pack.zip);
  Options bad = options(temp.path());
  bad.models[0].fixed["rho"] =
      std::array<double, 3>{7, 7, 7};  // refused when the shader is written, after the build has begun
  EXPECT_THROW(build_pack(bad), InputError);
  bad = options(temp.path());
  bad.addon = temp.path() / "nowhere";
  EXPECT_THROW(build_pack(bad), InputError);
  EXPECT_EQ(read(pack.zip), before);
  int files = 0;
  for (const auto& entry : fs::directory_iterator(temp.path())) files += entry.exists();
  EXPECT_EQ(files, 2);  // the zip and the folder: no incomplete files
}

TEST_F(PackFiles, NothingIsDeletedThatThisToolDidNotWrite) {
  const fs::path folder = temp.path() / "brdfc_shaders";
  fs::create_directory(folder);
  build_pack(options(temp.path()));  // an empty folder may be overwritten
  build_pack(options(temp.path()));  // and so may an earlier pack
  for (const char* manifest : {"", "{\"generator\": \"other 1.0\"}"}) {
    fs::remove_all(folder);
    fs::create_directory(folder);
    std::ofstream(folder / "mine.txt") << "mine";
    if (*manifest) std::ofstream(folder / "manifest.json") << manifest;
    EXPECT_THAT([&] { build_pack(options(temp.path())); },
                ThrowsMessage<InputError>(testing::AllOf(HasSubstr(folder.string()), HasSubstr("manifest.json"))));
    EXPECT_EQ(read(folder / "mine.txt"), "mine");
  }
  fs::remove_all(folder);
  std::ofstream(folder) << "mine";
  EXPECT_THROW(build_pack(options(temp.path())), InputError);
  EXPECT_EQ(read(folder), "mine");
}

TEST_F(PackFiles, AnOutputThatIsAFileIsAnErrorThatNamesIt) {
  const fs::path file = temp.path() / "file";
  std::ofstream(file) << "x";
  try {
    build_pack(options(file));
    FAIL() << "not refused";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr(file.string()));
  }
}

}  // namespace
}  // namespace brdfc::pack
