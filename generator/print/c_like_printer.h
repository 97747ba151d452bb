// SPDX-License-Identifier: GPL-3.0-or-later
// What printers of languages with the syntax of C share: OSL and GLSL.
#pragma once

#include "print/program_printer.h"

namespace brdfc::print {

/// The function of the hand-written libraries, osl/brdfc.osl.in or explorer/library.glsl, for an operation that the
/// language lacks.
std::string library_name(Op);

class CLikePrinter : public ProgramPrinter {
 public:
  using ProgramPrinter::ProgramPrinter;

 protected:
  /// Operators, loops' outputs, and names of functions that are those of the operations.
  Text text(int id) const override;
  /// The arm of a selection, args[i], as a colour if the selection is one.
  std::string arm(const ExprNode&, std::size_t i, int precedence) const;
  virtual const char* type_name(ExprType) const = 0;

 private:
  std::string declaration(ExprType, const std::string& name, const std::string& value) const override;
  std::string assignment(const std::string& name, const std::string& value) const override;
  std::string loop_head(const std::string& counter, int count) const override;
  std::string loop_end() const override;
};

}  // namespace brdfc::print
