// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/schema.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/nearest.h"
#include "core/parse.h"
#include "core/text.h"

namespace brdfc::inline model {
namespace {

double parse_number(const std::string& model, const std::string& name, const std::string& text) {
  if (const auto value = parse(text)) return *value;
  input_error("{}: {}: expected a number, got '{}'", model, name, text);
}

void check_range(const ModelInfo& m, const ParamInfo& p, double value) {
  if (!(value >= p.min && value <= p.max))  // also catches NaN
    input_error("{}: {}: expected a number in [{:g}, {:g}], got {}", m.name, p.name, p.min, p.max, value);
}

ScaledRange range(const ParamInfo& p, double low, double high) {
  if (!p.by_factors) return {AxisScale::Linear, low, high};
  if (low > 0) return {AxisScale::Log, low, high};
  // A logarithmic scale can't reach 0. Up to 1, log(1 + x) is hardly different from a linear scale.
  return {high > 1 ? AxisScale::Log1p : AxisScale::Linear, low, high};
}

}  // namespace

const char* name_of(Optical what) {
  switch (what) {
    case Optical::None:
      return "";
    case Optical::Index:
      return "index";
    case Optical::Dispersion:
      return "dispersion";
    case Optical::IndexRed:
      return "index_r";
    case Optical::IndexGreen:
      return "index_g";
    case Optical::IndexBlue:
      return "index_b";
    case Optical::ExtinctionRed:
      return "extinction_r";
    case Optical::ExtinctionGreen:
      return "extinction_g";
    case Optical::ExtinctionBlue:
      return "extinction_b";
    case Optical::Reflectance:
      return "reflectance";
    case Optical::Tint:
      return "tint";
    case Optical::Attenuation:
      return "attenuation";
    case Optical::PerLength:
      return "per_length";
  }
  return "";
}

ScaledRange ParamInfo::slider() const { return range(*this, soft_min, soft_max); }
ScaledRange ParamInfo::accepted() const { return range(*this, min, max); }

std::string name_of(Look look) {
  switch (look) {
    case Look::Undeclared:
      break;
    case Look::Matte:
      return "matte";
    case Look::Glossy:
      return "glossy";
    case Look::Metal:
      return "metal";
    case Look::Glass:
      return "glass";
    case Look::Special:
      return "special";
  }
  return "undeclared";
}

const ParamInfo* ModelInfo::param(const std::string& wanted) const {
  for (const ParamInfo& p : params)
    if (p.name == wanted) return &p;
  return nullptr;
}

ParamValues complete(const ModelInfo& info, const ParamValues& given) {
  ParamValues all;
  for (const auto& [name, value] : given) {
    if (info.param(name)) continue;
    std::vector<std::string> names;
    for (const ParamInfo& p : info.params) names.push_back(p.name);
    input_error("{}: unknown parameter '{}': {}expected one of {}", info.name, name, did_you_mean(name, names),
                join(names, ", "));
  }
  for (const ParamInfo& p : info.params) {
    const auto it = given.find(p.name);
    switch (p.kind) {
      case ParamKind::Number: {
        double v = p.value[0];
        if (it != given.end()) {
          const double* number = std::get_if<double>(&it->second);
          if (!number) input_error("{}: {}: expected a number", info.name, p.name);
          v = *number;
        }
        check_range(info, p, v);
        all[p.name] = v;
        break;
      }
      case ParamKind::Color: {
        std::array<double, 3> c = p.value;
        if (it != given.end()) {
          if (const double* level = std::get_if<double>(&it->second))
            c = {*level, *level, *level};
          else if (const auto* rgb = std::get_if<std::array<double, 3>>(&it->second))
            c = *rgb;
          else
            input_error("{}: {}: expected a colour (three numbers)", info.name, p.name);
        }
        for (double v : c) check_range(info, p, v);
        all[p.name] = c;
        break;
      }
      case ParamKind::Choice: {
        std::string text = p.choices[std::size_t(p.value[0])];
        if (it != given.end()) {
          const auto* s = std::get_if<std::string>(&it->second);
          if (!s || std::find(p.choices.begin(), p.choices.end(), *s) == p.choices.end())
            input_error("{}: {}: expected one of {}, got '{}'", info.name, p.name, join(p.choices, ", "),
                        s ? *s : "a number");
          text = *s;
        }
        all[p.name] = text;
        break;
      }
    }
  }
  return all;
}

ParamValues parse_values(const ModelInfo& info, const std::vector<std::string>& assignments) {
  ParamValues values;
  for (const std::string& a : assignments) {
    const auto eq = a.find('=');
    if (eq == std::string::npos) input_error("{}: expected name=value, got '{}'", info.name, a);
    const std::string name = a.substr(0, eq), text = a.substr(eq + 1);
    const ParamInfo* p = info.param(name);
    if (values.count(name)) input_error("{}: {}: given twice", info.name, name);
    if (!p || p->kind == ParamKind::Choice) {
      values[name] = text;  // complete() reports what was expected
    } else if (p->kind == ParamKind::Number) {
      values[name] = parse_number(info.name, name, text);
    } else {
      std::vector<double> parts;
      std::size_t start = 0;
      for (std::size_t comma = text.find(','); comma != std::string::npos; comma = text.find(',', start)) {
        parts.push_back(parse_number(info.name, name, text.substr(start, comma - start)));
        start = comma + 1;
      }
      parts.push_back(parse_number(info.name, name, text.substr(start)));
      if (parts.size() == 1)
        values[name] = parts[0];
      else if (parts.size() == 3)
        values[name] = std::array<double, 3>{parts[0], parts[1], parts[2]};
      else
        input_error("{}: {}: expected one number or r,g,b, got '{}'", info.name, name, text);
    }
  }
  return complete(info, values);
}

double table_error(const ModelInfo& info, const ParamValues& given) {
  const TabulatedChoice& t = info.properties.tabulated;
  if (t.error == 0) return 0;
  return std::get<std::string>(complete(info, given).at(t.parameter)) == t.choice ? t.error : 0;
}

bool is_compensated(const ModelInfo& info, const ParamValues& given) {
  const CompensatedChoice& c = info.properties.compensated;
  return !c.choice.empty() && std::get<std::string>(complete(info, given).at(c.parameter)) == c.choice;
}

std::string format_values(const ModelInfo& info, const ParamValues& values) {
  std::string text;
  for (const ParamInfo& p : info.params) {
    const auto it = values.find(p.name);
    if (it == values.end()) continue;
    text += (text.empty() ? "" : " ") + p.name + "=";
    if (const double* v = std::get_if<double>(&it->second))
      text += fmt::format("{}", *v);
    else if (const auto* c = std::get_if<std::array<double, 3>>(&it->second))
      text += fmt::format("{},{},{}", (*c)[0], (*c)[1], (*c)[2]);
    else
      text += std::get<std::string>(it->second);
  }
  return text;
}

}  // namespace brdfc::inline model
