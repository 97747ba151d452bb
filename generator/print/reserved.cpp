// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/reserved.h"

#include "print/numpy.h"
#include "print/osl_words.h"

namespace brdfc::print {

const std::set<std::string>& osl_function_words() {
  static const std::set<std::string> words = {"wi", "wo", "numbers", "distance", "value", "pdf"};
  return words;
}

const std::set<std::string>& python_arguments() {
  static const std::set<std::string> words = {"cos_theta_o", "material", "model", "node", "phi_o", "representation",
                                              "samples",     "self",     "u",     "wi",   "wo"};
  return words;
}

std::optional<std::string> reserved_for_parameters(const std::string& name) {
  if (is_osl_word(name) || osl_function_words().count(name)) return "OSL or the generator";
  if (is_python_word(name)) return "Python";
  if (python_arguments().count(name)) return "a function in Python that takes parameters by name";
  return std::nullopt;
}

std::optional<std::string> reserved_for_models(const std::string& name) {
  // The class of a model has its name in CamelCase, and None, True and False are keywords of Python.
  if (is_python_word(name) || name == "none" || name == "true" || name == "false") return "Python";
  return std::nullopt;
}

}  // namespace brdfc::print
