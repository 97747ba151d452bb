// SPDX-License-Identifier: GPL-3.0-or-later
// A sum of models in the place of one model, for renderers and quadrature.
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

/// Adds others up. Sampling chooses a lobe by its albedo for the view, and the pdf is that of all.
class SumModel final : public OpaqueModel {
 public:
  /// `lobes` are of models that let no light through.
  explicit SumModel(std::vector<Lobe> lobes);
  bool has_scatter() const override;
  bool has_mirror() const override;
  std::unique_ptr<Brdf<double>> make_double(const ParamValues&) const override;
  std::unique_ptr<PackedBrdf> make_packed(const ParamValues&) const override;

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
  std::vector<Lobe> lobes_;
  std::shared_ptr<const Shares> shares_;
};

}  // namespace brdfc::measured
