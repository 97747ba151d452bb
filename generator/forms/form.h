// SPDX-License-Identifier: GPL-3.0-or-later
// A form is a way to represent a model in Cycles: as a shader, or as a tree of Blender's nodes. Each form is a file in
// this folder that implements Form, and a line in registry.cpp. The rest of the program knows no form by name and asks
// this interface: the plan asks which materials a form exists for (Availability) and how large its error is
// (Measurement), the pack asks for its shader or nodes (Emission).
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "forms/availability.h"
#include "forms/emission.h"
#include "forms/measurement.h"

namespace brdfc::forms {

class Form : public Availability, public Measurement, public Emission {
 public:
  explicit Form(std::string name) : name_(std::move(name)) {}
  Form(const Form&) = delete;
  Form& operator=(const Form&) = delete;

  /// The name in files, tables, the manifest, and a material's `representation`.
  const std::string& name() const { return name_; }
  /// True if it samples random directions itself.
  virtual bool draws() const { return false; }
  /// True if it aims closures at lamps. It then has lamp slots and a base.
  virtual bool aims() const { return false; }
  /// True if it consists of Blender's own nodes, described by a JSON file, without a shader.
  virtual bool native() const { return false; }

  std::optional<fit::FitAxis> axis(const Model& model, const Setting& setting) const override {
    const fit::Fit* made = made_of_fit() ? fit(model, setting) : nullptr;
    return made ? made->axis() : std::nullopt;
  }

 private:
  std::string name_;
};

/// All forms, preferred first.
const std::vector<const Form*>& forms();
/// The form with this name. Throws InputError, which lists the known names, if there is none.
const Form* form(const std::string& name);
/// The forms that a pack of all models contains for this one, preferred first.
std::vector<const Form*> forms_of(const Model&);

}  // namespace brdfc::forms
