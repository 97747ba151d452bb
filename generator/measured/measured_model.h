// SPDX-License-Identifier: GPL-3.0-or-later
// A measured BRDF in the place of a model, for renderers and quadrature.
#pragma once

#include "measured/half_vectors.h"
#include "measured/measurement.h"
#include "model/model.h"

namespace brdfc::measured {

/// A model without parameters that looks values up. It is not registered, has no formulas to record, and takes double
/// precision alone.
class MeasuredModel final : public Model {
 public:
  explicit MeasuredModel(const Measurement&);
  const ModelInfo& info() const override { return info_; }
  bool has_scatter() const override { return true; }
  bool has_mirror() const override { return false; }
  bool has_exact() const override { return false; }
  std::unique_ptr<Brdf<double>> make_double(const ParamValues&) const override;
  std::unique_ptr<PackedBrdf> make_packed(const ParamValues&) const override;
  /// Throws std::logic_error, as the two below.
  std::unique_ptr<Brdf<float>> make_float(const ParamValues&) const override;
  std::unique_ptr<Brdf<Wide>> make_wide(const ParamValues&) const override;
  std::unique_ptr<Brdf<Expr>> record(const ParamValues&) const override;

  const HalfVectors& sampling() const { return *sampling_; }

 private:
  ModelInfo info_;
  std::shared_ptr<const Table> table_;
  std::shared_ptr<const HalfVectors> sampling_;
};

}  // namespace brdfc::measured
