// SPDX-License-Identifier: GPL-3.0-or-later
// The list of forms. A new one is declared and listed here.
#include <algorithm>

#include "core/error.h"
#include "core/text.h"
#include "forms/form.h"

namespace brdfc::forms {

const Form& exact();
const Form& aimed();
const Form& sampled();
const Form& fitted();
const Form& nodes();
const Form& twin();

const std::vector<const Form*>& forms() {
  static const std::vector<const Form*> all = {&exact(), &aimed(), &sampled(), &fitted(), &nodes(), &twin()};
  return all;
}

const Form* form(const std::string& name) {
  std::vector<std::string> names;
  for (const Form* f : forms()) {
    if (f->name() == name) return f;
    names.push_back(f->name());
  }
  input_error("unknown form '{}': expected one of {}", name, join(names, ", "));
}

std::vector<const Form*> forms_of(const Model& model) {
  std::vector<const Form*> out;
  std::ranges::copy_if(forms(), std::back_inserter(out), [&](const Form* f) { return f->in_whole_pack(model); });
  return out;
}

}  // namespace brdfc::forms
