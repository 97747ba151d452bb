// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/bound_model.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"

namespace brdfc::measure {
namespace {

[[noreturn]] void bad_value(const std::string& value, const char* what, const std::string& label,
                            const Vec3<double>& wi, const Vec3<double>& wo) {
  throw ValueError(fmt::format("{}: {}(wi={}, wo={}) = {}, expected finite and >= 0", label.empty() ? "model" : label,
                               what, text(wi, 17), text(wo, 17), value));
}

bool good(double v) { return v >= 0 && std::isfinite(v); }

}  // namespace

BoundModel bind_model(const Model& model, const ParamValues& values) {
  BoundModel bound;
  bound.model = &model;
  bound.values = complete(model.info(), values);
  bound.brdf = model.make_double(bound.values);
  bound.label = fmt::format("{} {}", model.info().name, format_values(model.info(), bound.values));
  return bound;
}

std::string text(const Vec3<double>& w, int digits) {
  return fmt::format("({:.{}g}, {:.{}g}, {:.{}g})", w.x, digits, w.y, digits, w.z, digits);
}

void require_value(double value, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo) {
  if (!good(value)) bad_value(fmt::format("{:.17g}", value), what, label, wi, wo);
}

void require_value(const Rgb<double>& v, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo) {
  if (!good(v.r) || !good(v.g) || !good(v.b))
    bad_value(fmt::format("{:.17g}, {:.17g}, {:.17g}", v.r, v.g, v.b), what, label, wi, wo);
}

}  // namespace brdfc::measure
