// SPDX-License-Identifier: GPL-3.0-or-later
// Models with wrong declarations.
#include "model/registry.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace brdfc {

// Not in the anonymous namespace, where Clang would call their functions unused.
namespace registry_test {

enum class Wrong { Nothing, First, Middle, Last, Only, Twice };

/// Minnaert's parameters and a choice, bound correctly or not.
template <Wrong W> struct Draft {
  template <class T> struct Type {
    Rgb<T> rho;
    T k;
    Choice law;

    static ModelInfo info() { return {.name = "draft", .look = Look::Matte}; }
    template <class Visitor> void parameters(const Visitor& v) {
      if (W == Wrong::Only) return;
      if (W != Wrong::First) v(rho, ColorSpec{"rho", "Reflectance", {0.5, 0.5, 0.5}, ""});
      if (W != Wrong::Middle) v(k, NumberSpec{"k", "Darkening", 1, 1, 2, 1, 2, ""});
      if (W == Wrong::Twice) v(k, NumberSpec{"l", "Brightening", 1, 1, 2, 1, 2, ""});
      if (W != Wrong::Last) v(law, ChoiceSpec{"law", "Law", {"one", "other"}, ""});
    }
    Rgb<T> mirror(const Vec3<T>&) const { return rho * k; }
  };
};

template <class T> struct OneNumber {
  T k{1};
  static constexpr double kOf = 2;  // a constant is not a member

  static ModelInfo info() { return {.name = "draft", .look = Look::Matte}; }
  template <class Visitor> void parameters(const Visitor&) {}
  Rgb<T> mirror(const Vec3<T>&) const { return Rgb<T>(T(kOf)); }
};

template <class T> struct NoNumber {
  static ModelInfo info() { return {.name = "draft", .look = Look::Matte}; }
  template <class Visitor> void parameters(const Visitor&) {}
  Rgb<T> mirror(const Vec3<T>&) const { return Rgb<T>(T(1)); }
};

}  // namespace registry_test

namespace {

using registry_test::Draft;
using registry_test::Wrong;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

struct Declared : Model {
  explicit Declared(ModelInfo info) : own(std::move(info)) {}
  const ModelInfo& info() const override { return own; }
  bool has_scatter() const override { return true; }
  bool has_mirror() const override { return false; }
  bool has_exact() const override { return false; }
  std::unique_ptr<Brdf<double>> make_double(const ParamValues&) const override { return nullptr; }
  std::unique_ptr<Brdf<float>> make_float(const ParamValues&) const override { return nullptr; }
  std::unique_ptr<Brdf<Wide>> make_wide(const ParamValues&) const override { return nullptr; }
  std::unique_ptr<PackedBrdf> make_packed(const ParamValues&) const override { return nullptr; }
  std::unique_ptr<Brdf<Expr>> record(const ParamValues&) const override { return nullptr; }
  ModelInfo own;
};

/// A first draft, which omits everything optional: it must compile without a warning.
ModelInfo draft() {
  ModelInfo info{.name = "draft", .look = Look::Matte};
  ParamInfo k;
  k.name = "k";
  info.params = {k};
  return info;
}
void add(Registry& registry, const ModelInfo& info, const char* file = "draft.cpp") {
  registry.add(std::make_unique<Declared>(info), file);
}
/// The error when models are requested.
std::string complaint(const ModelInfo& info) {
  Registry registry;
  add(registry, info);
  try {
    registry.models();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(Registry, TakesADraft) { EXPECT_EQ(complaint(draft()), ""); }

TEST(Registry, NamesBothFilesOfANameThatIsTakenTwice) {
  Registry registry;
  add(registry, draft(), "one.cpp");
  add(registry, draft(), "two.cpp");
  EXPECT_THAT([&] { registry.models(); },
              ThrowsMessage<InputError>("two.cpp: two models are named draft, the other in one.cpp"));
}

TEST(Registry, NamesFileModelAndWhatWasExpected) {
  ModelInfo info = draft();
  info.name = "Draft 2";
  EXPECT_THAT(complaint(info), AllOf(HasSubstr("draft.cpp: model name 'Draft 2'"), HasSubstr("lower-case")));
  info = draft();
  info.look = Look::Undeclared;
  EXPECT_THAT(complaint(info), AllOf(HasSubstr("draft.cpp: draft"), HasSubstr(".look = Look::")));
  info = draft();
  info.params.push_back(info.params[0]);
  EXPECT_THAT(complaint(info), HasSubstr("draft.cpp: draft: two parameters are named k"));
  info = draft();
  info.params[0].soft_max = 11;
  EXPECT_THAT(complaint(info), HasSubstr("draft: k: the slider's range"));
  info = draft();
  info.params[0].min = -1;
  info.params[0].by_factors = true;
  EXPECT_THAT(complaint(info), HasSubstr("draft: k: a number that goes by factors"));
}

ModelInfo of_parameter(const std::string& name) {
  ModelInfo info = draft();
  info.params[0].name = name;
  return info;
}

TEST(Registry, RefusesNamesThatOslTheGeneratorOrPythonUse) {
  for (const char* name : {"cos", "float", "wi", "time", "u", "color", "normal", "class", "pdf", "lamp", "weight_0"})
    EXPECT_EQ(
        complaint(of_parameter(name)),
        fmt::format("draft.cpp: draft: parameter name '{}': expected another name: OSL or the generator uses this "
                    "one",
                    name));
  for (const char* name : {"lambda", "np", "yield", "table_a"})
    EXPECT_EQ(complaint(of_parameter(name)),
              fmt::format("draft.cpp: draft: parameter name '{}': expected another name: Python uses this one", name));
  for (const char* name : {"representation", "cos_theta_o", "samples"})
    EXPECT_THAT(complaint(of_parameter(name)),
                AllOf(HasSubstr("draft.cpp: draft: parameter name"), HasSubstr("function in Python")))
        << name;
  for (const char* name : {"alpha", "exponent", "ior", "n_r", "rho", "size", "timely"})
    EXPECT_EQ(complaint(of_parameter(name)), "") << name;
  for (const char* name : {"class", "lambda", "none", "true"}) {
    ModelInfo info = draft();
    info.name = name;
    EXPECT_EQ(complaint(info),
              fmt::format("draft.cpp: model name '{}': expected another name: Python uses this one", name));
  }
  for (const char* name : {"_draft", "__init__", "2nd"}) {
    ModelInfo info = draft();
    info.name = name;
    EXPECT_THAT(complaint(info), HasSubstr("a letter first")) << name;
  }
}

TEST(Registry, RefusesLabelsThatOtherSocketsHave) {
  ModelInfo info = draft();
  info.params[0].label = "Normal";
  EXPECT_THAT(complaint(info), HasSubstr("draft: k: expected another label than 'Normal'"));
  ParamInfo other = draft().params[0];
  info.params[0].label = other.label = "Glossiness";
  other.name = "m";
  info.params.push_back(other);
  EXPECT_THAT(complaint(info), HasSubstr("draft: m: expected another label than 'Glossiness'"));
}

/// The error when models are requested, for a model of this class.
template <template <class> class M> std::string complaint_of() {
  Registry registry;
  registry.add(std::make_unique<detail::ModelOf<M>>(), "draft.cpp");
  try {
    registry.models();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(Registry, RefusesMembersThatAreNoParameters) {
  EXPECT_EQ(complaint_of<Draft<Wrong::Nothing>::Type>(), "");
  EXPECT_EQ(complaint_of<registry_test::NoNumber>(), "");
  const auto left_out = [](const std::string& where) {
    return "draft.cpp: draft: parameters() leaves out a member, " + where +
           ": every member of a model has to be a parameter";
  };
  EXPECT_EQ(complaint_of<Draft<Wrong::First>::Type>(), left_out("which stands before k"));
  EXPECT_EQ(complaint_of<Draft<Wrong::Middle>::Type>(), left_out("which stands after rho"));
  EXPECT_EQ(complaint_of<Draft<Wrong::Last>::Type>(), left_out("which stands after k"));
  EXPECT_EQ(complaint_of<registry_test::OneNumber>(), left_out("the first one"));
  EXPECT_EQ(complaint_of<Draft<Wrong::Only>::Type>(), left_out("the first one"));
  EXPECT_EQ(complaint_of<Draft<Wrong::Twice>::Type>(), "draft.cpp: draft: parameters() binds k and l to one member");
}

TEST(Registry, TellsAllThatIsWrongAtOnce) {
  Registry registry;
  ModelInfo info = draft();
  info.name = "";
  add(registry, info, "one.cpp");
  add(registry, info, "two.cpp");
  EXPECT_THAT([&] { registry.models(); }, ThrowsMessage<InputError>(AllOf(HasSubstr("one.cpp: model name ''"),
                                                                          HasSubstr("; two.cpp: model name ''"))));
}

TEST(Registry, GuessesWhatWasMeant) {
  for (const char* word : {"wrad", "Ward", "war", "warde", "waard"})
    EXPECT_THAT([&] { find_model(word); },
                ThrowsMessage<InputError>(AllOf(HasSubstr("did you mean ward? `brdfc list`"), HasSubstr(word))))
        << word;
  for (const std::string& word : {std::string("xyzzy"), std::string(), std::string(1 << 24, 'w')})
    EXPECT_THAT([&] { find_model(word); }, ThrowsMessage<InputError>(testing::Not(HasSubstr("did you mean"))))
        << word[0];
}

}  // namespace
}  // namespace brdfc
