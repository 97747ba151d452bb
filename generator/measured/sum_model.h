// SPDX-License-Identifier: GPL-3.0-or-later
// A sum of models in the place of one model, for renderers and quadrature.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::measured {

/// One term of a sum: a registered model with its parameters, whose colours say how much of it there is.
struct Lobe {
  const Model* model = nullptr;
  ParamValues values;
};

/// A model without parameters that adds others up. Sampling chooses a lobe by its albedo for the view, and the pdf is
/// that of all. It is not registered, and takes double precision alone.
class SumModel final : public Model {
 public:
  /// `lobes` are of models that let no light through.
  explicit SumModel(std::vector<Lobe> lobes);
  const ModelInfo& info() const override { return info_; }
  bool has_scatter() const override;
  bool has_mirror() const override;
  bool has_exact() const override { return false; }
  std::unique_ptr<Brdf<double>> make_double(const ParamValues&) const override;
  std::unique_ptr<PackedBrdf> make_packed(const ParamValues&) const override;
  /// Throws std::logic_error, as the two below.
  std::unique_ptr<Brdf<float>> make_float(const ParamValues&) const override;
  std::unique_ptr<Brdf<Wide>> make_wide(const ParamValues&) const override;
  std::unique_ptr<Brdf<Expr>> record(const ParamValues&) const override;

  const std::vector<Lobe>& lobes() const { return lobes_; }

  /// The probability of each lobe, by the cosine of the view.
  class Shares {
   public:
    explicit Shares(const std::vector<std::unique_ptr<Brdf<double>>>&);
    /// Adds up to 1 over the lobes.
    const std::vector<double>& at(double cosTheta_o) const;

   private:
    std::vector<std::vector<double>> of_row_;
  };

 private:
  ModelInfo info_;
  std::vector<Lobe> lobes_;
  std::shared_ptr<const Shares> shares_;
};

}  // namespace brdfc::measured
