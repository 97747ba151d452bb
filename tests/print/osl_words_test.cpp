// SPDX-License-Identifier: GPL-3.0-or-later
// The list of names that a shader's own text uses is complete, and models can't use these names.
#include "print/osl_words.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <regex>

#include "fit/terms.h"
#include "forms/form.h"
#include "forms/osl_form.h"
#include "measure/albedo_table.h"
#include "measure/fold.h"
#include "model/choices.h"
#include "model/registry.h"
#include "model/sampling.h"
#include "pack/probe.h"
#include "plan/plan.h"
#include "print/osl_program.h"

namespace brdfc {

// Not in the anonymous namespace: the model adapter has members of these types.
namespace osl_words_test {

/// All names that a shader uses otherwise, including numbered ones.
std::vector<std::string> all_words() {
  std::vector<std::string> words(print::osl_words().begin(), print::osl_words().end());
  for (const std::string& stem : print::numbered_osl_words())
    for (const char* end : {"", "_0", "_12", "_0_1", "_1_x"}) words.push_back(stem + end);
  words.insert(words.end(), {"brdfc_random", "M_PI"});
  return words;
}

/// Gives every statement such a name, and two more that follow the rule for making names unique.
template <class T> struct Hinted {
  Rgb<T> rho;
  T unread;
  static ModelInfo info() {
    return {.name = "hinted", .label = "", .paper = "", .equations = "", .doc = "", .properties = {}, .params = {}};
  }
  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Reflectance", {0.5, 0.5, 0.5}, ""});
    v(unread, NumberSpec{"unread", "Unread", 1, 0, 1, 0, 1, ""});
  }
  /// 1, in many statements.
  T one(const T& x) const {
    T y = x;
    for (const std::string& word : all_words()) y = named(word.c_str(), sin(y));
    for (const char* name : {"count_1", "model_weight", "unread", "rho"}) y = named(name, sin(y));
    return T(1) + y * y / T(1e30);
  }
  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return rho * select(above(wi, wo), one(wi.z) / pi<T>(), T(0));
  }
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), cosine_pdf(wi), T(0)); }
  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_cosine(u.y, u.z);
    return sample_if(above(wi, wo), wi, rho * one(wi.z), pdf(wi, wo));
  }
  ClosureSum<T> exact(const Vec3<T>& wo) const {
    ClosureSum<T> sum;
    sum.emplace_back(ClosureKind::Diffuse, rho * one(wo.z));
    return sum;
  }
  Rgb<T> mirror(const Vec3<T>& wo) const { return rho * (one(wo.z) - T(1)); }
};

/// A model with one parameter, whose name can be set.
std::string name_of_parameter;
template <class T> struct OfName : Hinted<T> {
  static ModelInfo info() {
    ModelInfo of_name = Hinted<T>::info();
    of_name.look = Look::Matte;
    return of_name;
  }
  template <class Visitor> void parameters(const Visitor& v) {
    v(this->rho, ColorSpec{name_of_parameter.c_str(), "Reflectance", {0.5, 0.5, 0.5}, ""});
    this->unread = T(1);
  }
};

}  // namespace osl_words_test

namespace {

using namespace osl_words_test;
using ::testing::HasSubstr;

measure::AlbedoTable table_of(const Model& model) {
  measure::AlbedoTable t;
  t.model = model.info().name;
  t.grids.push_back({"", {{"cos_theta_o", AxisScale::Linear, {0, 1}}}, 3, {0, 0, 0, 1, 1, 1}, 0});
  t.terms.assign(choice_combinations(model.info()).size(), {measure::AlbedoTerm{}});
  return t;
}

std::string without_comments_and_strings(const std::string& text) {
  return std::regex_replace(std::regex_replace(text, std::regex("//[^\n]*"), ""), std::regex("\"[^\"]*\""), "");
}

std::vector<std::string> matches(const std::string& text, const char* pattern) {
  const std::regex name(pattern);
  std::vector<std::string> found;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), name); it != std::sregex_iterator(); ++it)
    found.push_back((*it)[1]);
  return found;
}

std::vector<std::string> declared_in(const std::string& statements) {
  return matches(statements, R"((?:float|color|int) (\w+)(?:\[\d+\])? = )");
}

/// The variables that a model's statements declare, for all choices.
std::set<std::string> declared_by(const Model& model, const forms::Form* kind, const ParamValues& fixed) {
  std::set<std::string> names;
  const auto add = [&](const forms::Recording& r) {
    for (const std::string& name : declared_in(print::osl_program(*r.program, 0, r.taken))) names.insert(name);
  };
  for (const Choices& c : choice_combinations(model.info())) {
    if (!admits(model.info(), c, fixed)) continue;
    const ParamValues values = with_choices(model.info(), c, fixed);
    for (const forms::Recording& r : kind->recordings(model, values)) add(r);
    if (model.has_mirror()) add(forms::record_mirror(model, values));
  }
  for (const forms::Recording& r : forms::record_bending(model)) add(r);
  return names;
}

TEST(OslWords, AreAllThatShadersUseBesideTheirModelsNames) {
  for (const auto& [name, model] : models())
    for (const forms::Form* kind : forms::forms_of(*model)) {
      if (kind->native()) continue;
      const ParamValues fixed = kind->values(*model, {});
      const forms::Shader shader = kind->write(*model, measure::fold(table_of(*model), *model, fixed), {fixed});
      std::set<std::string> own = declared_by(*model, kind, fixed);
      for (const ParamInfo& p : model->info().params) own.insert(p.name);
      const std::string text = without_comments_and_strings(shader.source);
      std::set<std::string> unknown;
      // An exponent of a number, or a component of a vector, is not a name.
      for (const std::string& word :
           matches(text.substr(text.find("\n{\n", text.find("\nshader "))), R"((\b[A-Za-z_]\w*))"))
        if (!own.count(word) && !print::is_osl_word(word)) unknown.insert(word);
      EXPECT_THAT(unknown, testing::IsEmpty()) << shader.name << ": add to print/osl_words.cpp";
    }
}

TEST(OslWords, AStatementOfAModelMayHaveAnyForAName) {
  const detail::ModelOf<Hinted> model;
  for (const forms::Form* kind : {forms::form("exact"), forms::form("sampled")}) {
    const forms::Recording r = kind->recordings(model, {}).at(0);
    const std::string text = print::osl_program(*r.program, 4, r.taken);
    const std::vector<std::string> names = declared_in(text);
    EXPECT_GE(names.size(), all_words().size() + 4) << "each has its own";
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size()) << "twice the same";
    for (const std::string& name : names) {
      EXPECT_FALSE(print::is_osl_word(name)) << name;
      EXPECT_EQ(model.info().param(name), nullptr) << name << ": a parameter, also where statements do not read it";
    }
    EXPECT_THAT(text, HasSubstr("float count_1 = sin("));
    EXPECT_NO_THROW(kind->write(model, table_of(model)));
  }
  EXPECT_THAT(pack::probe_source(model, {}), HasSubstr("float shown_f_1 = sin("));
}

TEST(OslWords, AParameterMayHaveNoneForAName) {
  for (const std::string& word : all_words()) {
    name_of_parameter = word;
    if (!print::is_osl_word(word)) {
      const detail::ModelOf<OfName> model;
      EXPECT_NO_THROW(forms::form("sampled")->write(model, table_of(model))) << word;
      continue;
    }
    Registry registry;
    registry.add(std::make_unique<detail::ModelOf<OfName>>(), "hinted.cpp");
    EXPECT_THAT([&] { registry.models(); },
                testing::ThrowsMessage<InputError>(HasSubstr("hinted: parameter name '" + word + "'")))
        << word;
  }
}

}  // namespace
}  // namespace brdfc
