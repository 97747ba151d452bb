// SPDX-License-Identifier: GPL-3.0-or-later
// What a BRDF is that lets no light through and has no formula: no ideal refraction, closures or colours to assign.
#pragma once

#include <stdexcept>

#include "model/model.h"

namespace brdfc::measured {

class OpaqueBrdf : public Brdf<double> {
 public:
  Rgb<double> transmit(const Vec3<double>&) const override { return Rgb<double>(0); }
  double ior() const override { return 1; }
  std::array<double, 3> channel_iors() const override { return {1, 1, 1}; }
  Rgb<double> transmittance(const double&) const override { return Rgb<double>(1); }
  bool scatters_through() const override { return false; }
  std::optional<ClosureSum<double>> exact(const Vec3<double>&) const override { return std::nullopt; }
  ClosureSum<double> base(const Vec3<double>&) const override { return {}; }
  void assign(const std::string&, const std::array<double, 3>&) override {}
};

class OpaquePacked : public PackedBrdf {
 public:
  Rgb<Pack> transmit(const Vec3<Pack>&) const override { return Rgb<Pack>(Pack(0)); }
  Rgb<Pack> transmittance(const Pack&) const override { return Rgb<Pack>(Pack(1)); }
  Pack ior() const override { return Pack(1); }
  std::array<Pack, 3> channel_iors() const override { return {Pack(1), Pack(1), Pack(1)}; }
  void assign(const std::string&, const std::array<Pack, 3>&) override {}
};

/// A model without parameters in the place of one that is registered, for renderers and quadrature: it takes double
/// precision alone, and there is no formula to record.
class OpaqueModel : public Model {
 public:
  explicit OpaqueModel(ModelInfo info) : info_(std::move(info)) {}
  const ModelInfo& info() const override { return info_; }
  bool has_exact() const override { return false; }
  /// Throws std::logic_error, as the two below.
  std::unique_ptr<Brdf<float>> make_float(const ParamValues&) const override { no_formula(); }
  std::unique_ptr<Brdf<Wide>> make_wide(const ParamValues&) const override { no_formula(); }
  std::unique_ptr<Brdf<Expr>> record(const ParamValues&) const override { no_formula(); }

 protected:
  ModelInfo info_;

 private:
  [[noreturn]] void no_formula() const {
    throw std::logic_error(fmt::format("the model '{}' has no formula of its own", info_.name));
  }
};

}  // namespace brdfc::measured
