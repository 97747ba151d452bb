// SPDX-License-Identifier: GPL-3.0-or-later
// A model's formulas as programs, for printers of whole models.
#pragma once

#include "model/choices.h"
#include "model/model.h"
#include "trace/program.h"

namespace brdfc::pack {

/// The formulas of a model for one combination of choices. Directions are inputs of input3(), parameters inputs with
/// their names. A program of a term that the model lacks has no outputs.
struct RecordedModel {
  Program eval;      ///< f, of wi and wo
  Program pdf;       ///< pdf, likewise
  Program sample;    ///< wi, weight, pdf, of wo and u
  Program mirror;    ///< weight, of wo
  Program transmit;  ///< weight, likewise
  Program iors;      ///< iors, of ideal refraction for red, green and blue
  Program ior;       ///< iors of f where it crosses the surface, all the same
  Program inside;    ///< transmittance, of the input `distance`
  Program whole;     ///< stands, of the parameters alone: 1 where one of Cycles' closures equals the model, else 0
};
RecordedModel record_model(const Model&, const Choices&, Precision);

}  // namespace brdfc::pack
