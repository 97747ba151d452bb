// SPDX-License-Identifier: GPL-3.0-or-later
// Loops that compilers turn into vector instructions.
//
// Mark a function with such loops BRDFC_VECTORISED. It is then compiled for several instruction sets, together with
// every function that it calls, and the machine's instruction set is chosen when the program starts. Sums, products and
// roots are the same in all of them, because no product is fused with a sum.
//
// The formulas of models call too many functions for that: compiled into one function, a model took up to three
// minutes. Instead, their sources are compiled once for each instruction set (generator/CMakeLists.txt), and the types
// that such a source computes with are in an inline namespace BRDFC_INSTRUCTION_SET. The linker then can't take a
// function for another of the same name that needs a different processor. A test reads the names in the object files.
// A processor with none of these instruction sets evaluates directions one by one (model/one_by_one.cpp).
#pragma once

#include <cmath>

#if !defined(__clang__) && __GNUC__ >= 12 && defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define BRDFC_VECTORISED [[gnu::flatten, gnu::target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")]]
#define BRDFC_INDEPENDENT _Pragma("GCC ivdep")
// glibc's vector library has all the functions that formulas use from version 2.35 on.
#define BRDFC_HAS_VECTOR_MATH (__GLIBC__ == 2 && __GLIBC_MINOR__ >= 35)
#else
#define BRDFC_VECTORISED
#define BRDFC_INDEPENDENT
#define BRDFC_HAS_VECTOR_MATH 0
#endif

#ifndef BRDFC_INSTRUCTION_SET
#define BRDFC_INSTRUCTION_SET baseline
/// Whether this is a source's main compilation, as opposed to those for further instruction sets.
#define BRDFC_BASELINE 1
#else
#define BRDFC_BASELINE 0
#endif

/// The C library's functions, which a loop calls in their vector versions. Their values differ in the last digits (4
/// units in the last place) between the scalar version and the vector versions of each width. Results that must not
/// depend on a number's place in a loop are therefore computed only in loops over whole vectors.
namespace brdfc::vectorised::inline BRDFC_INSTRUCTION_SET {

#if BRDFC_HAS_VECTOR_MATH
// Declared under names of this project. With the names of the library's header, every loop in every file that includes
// this one would call them.
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
// Functions of one number that formulas call. core/pack.h has the same functions for a Pack.
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
