// SPDX-License-Identifier: GPL-3.0-or-later
// A form is a way to bring a model to Cycles: a shader, or a tree of Blender's nodes. Each is a file of this folder
// that implements Form, and a line in registry.cpp. What else there is, the plan, the pack, the command line, asks
// forms here and knows none by name: the plan which materials have one (Availability) and how far it is off
// (Measurement), the pack what it holds of it (Emission).
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

  /// In files, tables and the manifest, and for a material's `representation`.
  const std::string& name() const { return name_; }
  /// Whether it sends rays in directions that it draws.
  virtual bool draws() const { return false; }
  /// Whether it aims at lamps: then it has slots for them, and a base.
  virtual bool aims() const { return false; }
  /// Whether it is Blender's own nodes, a JSON file, and no shader.
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
/// Throws InputError that lists the known names.
const Form* form(const std::string& name);
/// Those that a pack of everything has of a model, preferred first.
std::vector<const Form*> forms_of(const Model&);

}  // namespace brdfc::forms
