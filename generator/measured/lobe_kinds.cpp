// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/lobe_kinds.h"

#include <algorithm>

#include "core/text.h"

namespace brdfc::measured {
namespace {

using Number = LobeKind::Number;
using enum AxisScale;

enum class Data { Any, Isotropic, Anisotropic };

struct KindRow {
  const char* model;
  std::vector<std::string> choices;  ///< and colours that are fixed, in the syntax of parse_values()
  const char* color;
  std::vector<Number> numbers;
  Data data = Data::Any;
  bool everywhere = true;
};

/// The ranges end where a highlight is narrower than what most tables resolve, or as wide as a matte surface.
const std::vector<KindRow>& rows() {
  static const std::vector<KindRow> out{
      {"lambert", {}, "rho", {}},
      {"oren_nayar", {"form=full"}, "rho", {{{"sigma"}, {Linear, 0.05, 0.66}, 3}}},
      {"charlie", {"terminator=plain"}, "tint", {{{"r"}, {Log, 0.1, 1}, 5}}},
      {"radziszewski_alda",
       {"proportion=paper", "part=product", "around=reflection"},
       "tint",
       {{{"n"}, {Log1p, 0.2, 1e4}, 16}}},
      {"radziszewski_alda",
       {"proportion=custom", "part=product", "around=reflection"},
       "tint",
       {{{"n_theta"}, {Log1p, 0, 1e3}, 6}, {{"n_phi"}, {Log1p, 0, 1e3}, 6}},
       Data::Any},
      {"radziszewski_alda",
       {"proportion=paper", "part=product", "around=retro"},
       "tint",
       {{{"n"}, {Log1p, 0.2, 1e3}, 8}},
       Data::Any,
       false},
      {"lossless", {"kernel=sech2"}, "tint", {{{"n"}, {Log1p, 0.2, 1e3}, 8}}},
      {"ward", {"normalisation=bounded"}, "ks", {{{"ax", "ay"}, {Log, 0.01, 1}, 14}}, Data::Isotropic},
      {"ward",
       {"normalisation=bounded"},
       "ks",
       {{{"ax"}, {Log, 0.01, 1}, 7}, {{"ay"}, {Log, 0.01, 1}, 7}},
       Data::Anisotropic},
      {"cook_torrance", {}, "f0", {{{"m"}, {Log, 0.01, 1}, 14}}},
      {"microfacet",
       {"distribution=ggx", "masking=smith_correlated", "tint=1"},
       "f0",
       {{{"ax", "ay"}, {Log, 0.01, 1}, 14}},
       Data::Isotropic},
      {"microfacet",
       {"distribution=ggx", "masking=smith_correlated", "tint=1"},
       "f0",
       {{{"ax"}, {Log, 0.01, 1}, 7}, {{"ay"}, {Log, 0.01, 1}, 7}},
       Data::Anisotropic},
      // Its Beckmann facets are so near to those of cook_torrance and ward that a search takes either for the other.
      {"blinn", {}, "ks", {{{"e"}, {Log1p, 1, 1e5}, 14}}},
      // Smoother ones have a part of an ideal mirror, which no data show.
      {"schlick", {"p=1"}, "r", {{{"rough"}, {Linear, 0.5, 1}, 4}}, Data::Isotropic},
      {"schlick", {}, "r", {{{"rough"}, {Linear, 0.5, 1}, 3}, {{"p"}, {Log, 0.05, 1}, 3}}, Data::Anisotropic},
      // Matte under a coat.
      {"ashikhmin_shirley", {"part=diffuse", "diffuse=paper", "rs=0"}, "rd", {}},
      {"ashikhmin_shirley",
       {"part=both", "diffuse=paper", "rd=0"},
       "rs",
       {{{"nu", "nv"}, {Log1p, 1, 1e5}, 14}},
       Data::Isotropic},
      {"ashikhmin_shirley",
       {"part=both", "diffuse=paper", "rd=0"},
       "rs",
       {{{"nu"}, {Log1p, 1, 1e5}, 5}, {{"nv"}, {Log1p, 1, 1e5}, 5}, {{"rotation"}, {Linear, -kPi / 2, kPi / 2}, 4}},
       Data::Anisotropic},
      {"phong", {}, "ks", {{{"e"}, {Log1p, 1, 1e4}, 12}}},
      {"modified_phong", {}, "ks", {{{"e"}, {Log1p, 1, 1e4}, 12}}},
      {"max_phong", {}, "ks", {{{"e"}, {Log1p, 1, 1e4}, 12}}},
      {"glossy_reflector", {"kr=1", "below=mirror"}, "cr", {{{"e"}, {Log1p, 1, 1e4}, 12}}},
      {"edwards", {}, "rho", {{{"e"}, {Log1p, 1, 1e5}, 10}}},
      {"lafortune",
       {},
       "ks",
       {{{"cxy"}, {Linear, -1, 1}, 5}, {{"cz"}, {Linear, 0, 1}, 4}, {{"e"}, {Log1p, 0.5, 300}, 5}}},
  };
  return out;
}

/// Narrower highlights than those of the range are searched for, where a model accepts them.
SearchRange search_of(const Number& number, const ModelInfo& info) {
  const auto p = std::ranges::find(info.params, number.names.front(), &ParamInfo::name);
  double least = number.range.low, most = number.range.high;
  // Isotropy, which is 1 or less, is no width.
  if (number.range.scale == Log && number.range.high == 1 && p->name != "p") least = std::max(p->min, least / kBeyond);
  if (number.range.scale == Log1p) most = std::min(p->max, most * kBeyondExponent);
  return {number.range, least, most};
}

}  // namespace

std::vector<LobeKind> lobe_kinds(const std::vector<std::string>& names, bool isotropic) {
  const auto named = [&](const std::string& model) {
    return names.empty() || std::ranges::find(names, model) != names.end();
  };
  for (const std::string& name : names) {
    if (std::ranges::none_of(rows(), [&](const KindRow& row) { return row.model == name; })) {
      std::vector<std::string> known;
      for (const KindRow& row : rows())
        if (std::ranges::find(known, row.model) == known.end()) known.emplace_back(row.model);
      input_error("{} has no lobe for a sum, expected all or some of {}", name, join(known, ", "));
    }
  }
  std::vector<LobeKind> out;
  for (const KindRow& row : rows()) {
    if (row.data == (isotropic ? Data::Anisotropic : Data::Isotropic) || !named(row.model)) continue;
    const Model& model = find_model(row.model);
    out.push_back({&model, complete(model.info(), parse_values(model.info(), row.choices)), row.color, row.numbers,
                   row.everywhere});
    for (Number& number : out.back().numbers) number.search = search_of(number, model.info());
  }
  return out;
}

}  // namespace brdfc::measured
