// SPDX-License-Identifier: GPL-3.0-or-later
// Data that are sums of models of this project.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "measured/measurement.h"
#include "measured/sum_model.h"

namespace brdfc::measured {

/// A term of a sum: a model's name, and its values in the syntax of parse_values().
struct Part {
  const char* model;
  std::vector<std::string> values;
};

inline std::vector<Lobe> lobes_of(const std::vector<Part>& parts) {
  std::vector<Lobe> out;
  for (const Part& p : parts) {
    const Model& model = find_model(p.model);
    out.push_back({&model, complete(model.info(), parse_values(model.info(), p.values))});
  }
  return out;
}

class SumTable final : public Table {
 public:
  explicit SumTable(const std::vector<Part>& parts) {
    for (const Lobe& lobe : lobes_of(parts)) terms_.push_back(lobe.model->make_double(lobe.values));
  }
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    Rgb<double> f(0);
    for (const auto& term : terms_) f += term->eval(wi, wo);
    return f;
  }

 private:
  std::vector<std::unique_ptr<Brdf<double>>> terms_;
};

}  // namespace brdfc::measured
