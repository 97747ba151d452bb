// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the checks on models with deliberate errors.
#include "check/check.h"

#include <gmock/gmock.h>

#include <map>
#include <set>

#include "faulty.h"
#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "measure/properties.h"
#include "measure/tabulate_albedo.h"
#include "support.h"

namespace brdfc::check {

// Not in the anonymous namespace: the model adapter has members of this type.
/// Black, and unable to sample a direction.
template <class T> struct Lost {
  static ModelInfo info() {
    return {.name = "lost", .label = "", .paper = "", .equations = "", .doc = "", .properties = {}, .params = {}};
  }
  template <class Visitor> void parameters(const Visitor&) {}
  Rgb<T> eval(const Vec3<T>&, const Vec3<T>&) const { return Rgb<T>(T(0)); }
  T pdf(const Vec3<T>&, const Vec3<T>&) const { return T(0); }
  Sample<T> sample(const Vec3<T>&, const Vec3<T>&) const { return {{T(0), T(0), T(1)}, Rgb<T>(T(0)), T(0)}; }
};

/// Omits a member from its parameters.
template <class T> struct Forgetful : Lost<T> {
  Rgb<T> rho;
  T k;
  static ModelInfo info() {
    return {.name = "forgetful", .label = "", .paper = "", .equations = "", .doc = "", .properties = {}, .params = {}};
  }
  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Reflectance", {0.5, 0.5, 0.5}, ""});
  }
};

namespace {

using namespace faulty;

using testing::HasSubstr;

/// The results of the checks that apply.
template <Defect D> std::map<std::string, bool> outcome() {
  const detail::ModelOf<Faulty<D>::template Type> model;
  std::map<std::string, bool> passed;
  for (const Row& r : check_model(model))
    if (r.result != Result::Skipped) passed[r.check] = r.result == Result::Passed;
  return passed;
}
Row row_of(const Model& model, const std::string& check) {
  for (const Row& r : check_model(model, {.effort = 0.1}))
    if (r.check == check) return r;
  throw InputError(check + ": no such check");
}

TEST(Checks, PassARightModel) {
  for (const auto& [check, passed] : outcome<kNone>()) EXPECT_TRUE(passed) << check;
}
TEST(Checks, AreSkippedWhereNoCaseCouldBeJudged) {
  const detail::ModelOf<Lost> model;
  const Row row = row_of(model, "exact sampling");
  EXPECT_EQ(row.result, Result::Skipped);
  EXPECT_THAT(row.reason, HasSubstr("no case could be judged"));
  EXPECT_EQ(row.declare, "");
}
TEST(Checks, SeeAPdfThatIsNotTheSamplers) {
  const auto r = outcome<kPdf>();
  EXPECT_FALSE(r.at("chi-square"));
  EXPECT_FALSE(r.at("sampled albedo"));
  EXPECT_TRUE(r.at("pdf integral"));
}
TEST(Checks, SeeASamplerThatLeavesTwoPercentOut) {
  // All its weights equal the reflectance, so a furnace test can't detect the error.
  const auto r = outcome<kSampler>();
  EXPECT_FALSE(r.at("chi-square"));
  EXPECT_TRUE(r.at("sampled albedo"));
}
TEST(Checks, NameAMemberThatIsNoParameter) {
  const detail::ModelOf<Forgetful> model;
  const auto says = testing::ThrowsMessage<InputError>(
      "forgetful: parameters() leaves out a member, which stands after rho: every member of a model has to be a "
      "parameter");
  EXPECT_THAT([&] { check_model(model); }, says);
  EXPECT_THAT([&] { require_vital(model); }, says);
}
TEST(Checks, NameDirectionsThatAreNoUnitVectors) {
  const detail::ModelOf<Faulty<kLong>::Type> model;
  const Row row = row_of(model, "unit directions");
  EXPECT_EQ(row.result, Result::Failed);
  EXPECT_THAT(row.where, testing::AllOf(HasSubstr("faulty rho="), HasSubstr("sample() gives wi=(")));
  EXPECT_THAT(message([&] { require_vital(model); }), HasSubstr("faulty: fails unit directions"));
}
TEST(Checks, NameWhatIsNotZeroBelowTheSurface) {
  const Row f = row_of(detail::ModelOf<Faulty<kBelow>::Type>(), "horizon");
  EXPECT_EQ(f.result, Result::Failed);
  EXPECT_THAT(f.where, testing::AllOf(HasSubstr("faulty rho="), HasSubstr(" f(wi=("), HasSubstr("wo=(")));
  // For a view from below.
  const Row pdf = row_of(detail::ModelOf<Faulty<kPdfBelow>::Type>(), "horizon");
  EXPECT_EQ(pdf.result, Result::Failed);
  EXPECT_THAT(pdf.where, HasSubstr("pdf(wi=("));
}
TEST(Checks, SeeMissingReciprocity) { EXPECT_FALSE(outcome<kReciprocity>().at("reciprocal")); }
TEST(Checks, SeeMissingIsotropy) { EXPECT_FALSE(outcome<kTurn>().at("isotropic")); }
TEST(Checks, SeeEnergyFromNowhere) {
  const auto r = outcome<kGain>();
  EXPECT_FALSE(r.at("conserving"));
  EXPECT_FALSE(r.at("lossless"));
}
TEST(Checks, SeeCancellation) {
  const auto r = outcome<kUnstable>();
  EXPECT_FALSE(r.at("float rounding"));
  EXPECT_FALSE(r.at("double rounding"));
}
TEST(Checks, SeeClosuresThatAreNotTheModel) { EXPECT_FALSE(outcome<kClosure>().at("exact closures")); }
TEST(Checks, SeePropertiesDeclaredAbsentThatHold) {
  const auto passed = outcome<kModest>();
  EXPECT_FALSE(passed.at("not reciprocal"));
  EXPECT_FALSE(passed.at("not conserving"));
  EXPECT_FALSE(passed.at("not lossless"));
  EXPECT_FALSE(passed.at("not isotropic"));
  EXPECT_FALSE(passed.at("not positive"));
  EXPECT_FALSE(passed.at("not smooth"));
  EXPECT_FALSE(passed.at("not exact sampling"));
}

TEST(Checks, SeeDarkPlacesAndTellThemFromUnderflow) {
  EXPECT_FALSE(outcome<kDark>().at("positive"));
  const auto r = outcome<kShadow>();
  EXPECT_TRUE(r.at("positive"));
  EXPECT_TRUE(r.at("smooth"));
}
TEST(Checks, SeeEdgesOfAFewPercent) {
  const auto r = outcome<kEdge>();
  EXPECT_FALSE(r.at("smooth"));
  EXPECT_TRUE(r.at("positive"));
}
TEST(Checks, SeeLimitsThatAreNone) {
  EXPECT_FALSE(outcome<kShadow>().at("diffuse limit"));
  const auto r = outcome<kModest>();
  EXPECT_FALSE(r.at("specular limit"));
  EXPECT_FALSE(r.at("no diffuse limit"));
}
TEST(Checks, SeeWeightsThatVary) { EXPECT_FALSE(outcome<kPdf>().at("exact sampling")); }
TEST(Checks, SeeALobeThatItsSamplerDoesNotKnow) {
  EXPECT_FALSE(outcome<kShadow>().at("sampling variance"));
  EXPECT_TRUE(outcome<kDark>().at("sampling variance"));
}
TEST(Checks, SeeAHighlightThatUniformDirectionsMiss) {
  const Model& model = find_model("kelemen");
  const measure::BoundModel bound = measure::bind_model(model, parse_values(model.info(), {"m=0.001"}));
  measure::Random random(1);
  EXPECT_GT(measure::unevenness(*bound.brdf, 128, random).value(), 0.999);
}
TEST(Checks, SayWhyOneDoesNotApply) {
  const Row skipped = row_of(find_model("fresnel_dielectric"), "chi-square");
  EXPECT_EQ(skipped.result, Result::Skipped);
  EXPECT_EQ(skipped.cases, 0);
  EXPECT_EQ(skipped.reason, "the model has delta terms alone");
  EXPECT_EQ(row_of(find_model("phong"), "exact closures").reason, "no closures equal the model");
  EXPECT_EQ(row_of(find_model("lambert"), "exact closures").reason, "");
}
TEST(Checks, AreTheSameNumberForEveryModelAndHaveALimit) {
  std::set<std::size_t> numbers;
  for (const std::string& name : third_of(model_names())) {
    const std::vector<Row> rows = check_model(find_model(name), {.effort = 0.01});
    numbers.insert(rows.size());
    for (const Row& r : rows) EXPECT_LT(std::abs(r.limit), 100) << name << ": " << r.check;
  }
  EXPECT_EQ(numbers.size(), 1u);
}

/// A property may be declared absent, but not one that every model must have.
TEST(Checks, SayWhatToDeclareIfAFailureIsMeant) {
  const detail::ModelOf<Faulty<kModest>::Type> modest;
  const detail::ModelOf<Faulty<kShadow>::Type> shadow;
  const detail::ModelOf<Faulty<kPdf>::Type> pdf;
  EXPECT_EQ(row_of(modest, "not conserving").declare, ".conserving = true");
  EXPECT_EQ(row_of(modest, "no diffuse limit").declare, ".diffuse_limit = \"PARAMETER=VALUE\"");
  EXPECT_EQ(row_of(shadow, "diffuse limit").declare, ".diffuse_limit = \"\"");
  EXPECT_EQ(row_of(pdf, "exact sampling").declare, ".exact_sampling = false");
  EXPECT_EQ(row_of(pdf, "chi-square").result, Result::Failed);
  EXPECT_EQ(row_of(pdf, "chi-square").declare, "");
  EXPECT_EQ(row_of(pdf, "positive").declare, "") << "which holds";
  const detail::ModelOf<Faulty<kNegative>::Type> negative;
  EXPECT_EQ(row_of(negative, "conserving").declare, "") << "a value that is bad is no gain";
}
TEST(Checks, AGlanceNamesTheModelAndTheCommandThatSaysMore) {
  require_vital(detail::ModelOf<Faulty<kNone>::Type>());
  require_vital(detail::ModelOf<Faulty<kModest>::Type>());
  EXPECT_EQ(message([] { require_vital(detail::ModelOf<Faulty<kNegative>::Type>()); }),
            "faulty: fails values (no bad one: f, pdf, weights finite and >= 0, in float and double): run `brdfc check "
            "faulty`");
}

TEST(Checks, NameModelParametersDirectionsAndValueOfABadOne) {
  const detail::ModelOf<Faulty<kNegative>::Type> negative;
  const detail::ModelOf<Faulty<kNan>::Type> nan;
  for (const std::string& text : {row_of(negative, "values").where, row_of(negative, "conserving").where,
                                  message([&] { measure::tabulate_albedo(negative); }), message([&] {
                                    measure::albedo(*measure::bind_model(negative, {}).brdf, 0.5, 0,
                                                    measure::bind_model(negative, {}).label);
                                  })}) {
    EXPECT_THAT(text, HasSubstr("faulty rho="));
    EXPECT_THAT(text, HasSubstr("level="));
    EXPECT_THAT(text, testing::ContainsRegex("(f|weight)\\(wi=\\("));
    EXPECT_THAT(text, HasSubstr("wo=("));
    EXPECT_THAT(text, HasSubstr("= -0.00"));
    EXPECT_THAT(text, HasSubstr("expected finite and >= 0"));
  }
  // Occurs only for some parameters, which the tabulation has to find.
  EXPECT_THAT(message([&] { measure::tabulate_albedo(nan); }), HasSubstr("nan"));
  // One bad value fails the checks that encounter it, and no others.
  for (const char* check : {"values", "conserving"}) EXPECT_EQ(row_of(negative, check).result, Result::Failed) << check;
  EXPECT_EQ(row_of(negative, "sample weight").result, Result::Passed);
}

}  // namespace
}  // namespace brdfc::check
