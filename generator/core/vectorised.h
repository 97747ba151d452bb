// SPDX-License-Identifier: GPL-3.0-or-later
// Loops of which compilers make vector instructions.
//
// A function that has such loops is BRDFC_VECTORISED: it is compiled for several instruction sets, of which the
// machine's is taken when the program starts, together with every function that it calls. Sums, products and roots are
// the same in all of them: no product is contracted with a sum.
//
// The formulas of models call too much for that: with all of it in one function, a model took up to three minutes to
// compile. Instead, their sources are compiled once for each instruction set (generator/CMakeLists.txt), and what such
// a source computes with stands in an inline namespace BRDFC_INSTRUCTION_SET. So the linker can't mistake a function
// for one of the same name that needs another processor; a test reads the names in the object files.
#pragma once

#include <cmath>

#if !defined(__clang__) && __GNUC__ >= 12 && defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define BRDFC_VECTORISED [[gnu::flatten, gnu::target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")]]
#define BRDFC_INDEPENDENT _Pragma("GCC ivdep")
// From 2.35 on glibc's vector library has all the functions that formulas use.
#define BRDFC_HAS_VECTOR_MATH (__GLIBC__ == 2 && __GLIBC_MINOR__ >= 35)
#else
#define BRDFC_VECTORISED
#define BRDFC_INDEPENDENT
#define BRDFC_HAS_VECTOR_MATH 0
#endif

#ifndef BRDFC_INSTRUCTION_SET
#define BRDFC_INSTRUCTION_SET baseline
/// Whether this is a source's main compilation, not one of those for further instruction sets.
#define BRDFC_BASELINE 1
#else
#define BRDFC_BASELINE 0
#endif

/// The C library's functions, of which a loop calls that for a whole vector: values differ in the last digits (4 units
/// in the last place), by whether and for how wide a vector. What must not depend on a number's place in a loop is
/// computed in loops over whole vectors alone.
namespace brdfc::vectorised::inline BRDFC_INSTRUCTION_SET {

#if BRDFC_HAS_VECTOR_MATH
// Under names of our own: declared by those of the library's header they would be called by every loop of whoever
// includes this.
#define BRDFC_DECLARE(name, ...) \
  extern "C" [[gnu::simd("notinbranch"), gnu::const]] double brdfc_vector_##name(__VA_ARGS__) noexcept __asm__(#name);
#define BRDFC_CALL(name) brdfc_vector_##name
#else
#define BRDFC_DECLARE(name, ...)
#define BRDFC_CALL(name) std::name
#endif
#define BRDFC_FUNCTION(name)  \
  BRDFC_DECLARE(name, double) \
  inline double name(double x) { return BRDFC_CALL(name)(x); }
#define BRDFC_FUNCTION_OF_TWO(name)   \
  BRDFC_DECLARE(name, double, double) \
  inline double name(double a, double b) { return BRDFC_CALL(name)(a, b); }
// Those of one number that formulas call: core/pack.h has the same of a Pack.
#define BRDFC_FORMULA_FUNCTIONS(F) F(atan) F(cbrt) F(cos) F(exp) F(expm1) F(log) F(log1p) F(sin)
BRDFC_FORMULA_FUNCTIONS(BRDFC_FUNCTION)
BRDFC_FUNCTION(asin)
BRDFC_FUNCTION_OF_TWO(atan2)
BRDFC_FUNCTION_OF_TWO(pow)
#undef BRDFC_DECLARE
#undef BRDFC_CALL
#undef BRDFC_FUNCTION
#undef BRDFC_FUNCTION_OF_TWO

}  // namespace brdfc::vectorised::inline BRDFC_INSTRUCTION_SET
