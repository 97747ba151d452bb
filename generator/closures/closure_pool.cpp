// SPDX-License-Identifier: GPL-3.0-or-later
#include "closures/closure_pool.h"

namespace brdfc::inline closures {

int pool_bytes(ClosureKind kind) {
  // An OSLClosureComponent consists of an identifier and a weight, then a pointer to a label and the parameters, padded
  // to a multiple of 8 bytes (kernel/osl/types.h, closures_setup.h, closures_template.h).
  constexpr int kVector = 12, kNumber = 4, kComponent = kNumber + kVector, kPointer = 8;
  const auto with = [](int parameters) { return kComponent + (kPointer + parameters + 7) / 8 * 8; };
  switch (kind) {
    case ClosureKind::Diffuse:
    case ClosureKind::Reflection:
      return with(kVector);
    case ClosureKind::Burley:
    case ClosureKind::OrenNayar:
      return with(2 * kVector + kNumber);
    case ClosureKind::DiffuseRamp:
      return with((1 + kRampSize) * kVector);
    case ClosureKind::PhongRamp:
      return with((1 + kRampSize) * kVector + kNumber);
    case ClosureKind::Ggx:
    case ClosureKind::Beckmann:
      return with(kPointer + 2 * kVector + 4 * kNumber);
    case ClosureKind::GlossyToon:
    case ClosureKind::DiffuseToon:
      return with(kVector + 2 * kNumber);
    case ClosureKind::Refraction:
    case ClosureKind::Velvet:
      return with(kVector + kNumber);
  }
  throw std::logic_error("closure of unknown kind");
}

}  // namespace brdfc::inline closures
