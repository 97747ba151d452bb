// SPDX-License-Identifier: GPL-3.0-or-later
// A sum of models in the place of one model, for renderers and quadrature; or layers of them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "measured/opaque.h"

namespace brdfc::measured {

/// One term of a sum: a registered model with its parameters, whose colours say how much of it there is.
struct Lobe {
  const Model* model = nullptr;
  ParamValues values;
};

/// How lobes are put together.
enum class Stack {
  Sum,
  /// The first lobe is on top. A lobe below others has its f times the product of 1 - A over these, where A is the
  /// largest channel of the albedo for the view, averaged over the azimuth. So does Cycles' Principled node. Layers
  /// that gain no light gain none together. They are not reciprocal, because the factor does not depend on
  /// the direction of the light.
  Layers
};

/// Adds others up. Sampling chooses a lobe by its albedo for the view, and the pdf is that of all.
class SumModel final : public OpaqueModel {
 public:
  /// `lobes` are of models that let no light through. Throws ValueError where layers need the albedo of a model that
  /// returns a value that is NaN, infinite or negative.
  explicit SumModel(std::vector<Lobe> lobes, Stack = Stack::Sum);
  bool has_scatter() const override;
  bool has_mirror() const override;
  std::unique_ptr<Brdf<double>> make_double(const ParamValues&) const override;
  std::unique_ptr<PackedBrdf> make_packed(const ParamValues&) const override;

  const std::vector<Lobe>& lobes() const { return lobes_; }

  /// What depends on the cosine of the view, for each lobe.
  class Views {
   public:
    Views(const std::vector<std::unique_ptr<Brdf<double>>>&, Stack);
    /// The probability that the lobe is sampled: adds up to 1 over the lobes.
    const std::vector<double>& shares(double cosTheta_o) const;
    /// Whether passed() differs from 1.
    bool dims() const { return !passed_.empty(); }
    /// The factor of the lobe's f: 1 in a sum.
    double passed(std::size_t lobe, double cosTheta_o) const;

   private:
    std::vector<std::vector<double>> passed_;  // by lobe and view; empty in a sum
    std::vector<std::vector<double>> shares_;  // by view and lobe
  };

 private:
  std::vector<Lobe> lobes_;
  std::shared_ptr<const Views> views_;
};

}  // namespace brdfc::measured
