// SPDX-License-Identifier: GPL-3.0-or-later
// A measured BRDF in the place of a model, for renderers and quadrature.
#pragma once

#include "measured/half_vectors.h"
#include "measured/measurement.h"
#include "measured/opaque.h"

namespace brdfc::measured {

/// Looks values up. Of a table's own sampler and one of half vectors, the one with less noise is taken.
class MeasuredModel final : public OpaqueModel {
 public:
  explicit MeasuredModel(const Measurement&);
  bool has_scatter() const override { return true; }
  bool has_mirror() const override { return false; }
  std::unique_ptr<Brdf<double>> make_double(const ParamValues&) const override;
  std::unique_ptr<PackedBrdf> make_packed(const ParamValues&) const override;

  const Sampler& sampling() const { return *sampling_; }

 private:
  std::shared_ptr<const Table> table_;
  std::shared_ptr<const Sampler> sampling_;
};

}  // namespace brdfc::measured
