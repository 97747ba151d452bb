// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/glsl.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <set>
#include <sstream>

#include "core/text.h"
#include "print/c_like_printer.h"
#include "print/osl_text.h"

namespace brdfc::print {
namespace {

/// Keywords and reserved words of GLSL ES 3.00 (section 3.7), then built-in functions (chapter 8).
constexpr const char* kGlslWords = R"(
  const uniform layout centroid flat smooth break continue do for while switch case default if else in out inout float int
  void bool true false invariant discard return mat2 mat3 mat4 mat2x2 mat2x3 mat2x4 mat3x2 mat3x3 mat3x4 mat4x2 mat4x3
  mat4x4 vec2 vec3 vec4 ivec2 ivec3 ivec4 bvec2 bvec3 bvec4 uint uvec2 uvec3 uvec4 lowp mediump highp precision sampler2D
  sampler3D samplerCube sampler2DShadow samplerCubeShadow sampler2DArray sampler2DArrayShadow isampler2D isampler3D
  isamplerCube isampler2DArray usampler2D usampler3D usamplerCube usampler2DArray struct

  attribute varying coherent volatile restrict readonly writeonly resource atomic_uint noperspective patch sample subroutine
  common partition active asm class union enum typedef template this goto inline noinline volatile public static extern
  external interface long short double half fixed unsigned superp input output hvec2 hvec3 hvec4 dvec2 dvec3 dvec4 fvec2
  fvec3 fvec4 sampler3DRect filter image1D image2D image3D imageCube iimage1D iimage2D iimage3D iimageCube uimage1D
  uimage2D uimage3D uimageCube image1DArray image2DArray iimage1DArray iimage2DArray uimage1DArray uimage2DArray
  image1DShadow image2DShadow image1DArrayShadow image2DArrayShadow imageBuffer iimageBuffer uimageBuffer sampler1D
  sampler1DShadow sampler1DArray sampler1DArrayShadow isampler1D isampler1DArray usampler1D usampler1DArray sampler2DRect
  sampler2DRectShadow isampler2DRect usampler2DRect samplerBuffer isamplerBuffer usamplerBuffer sampler2DMS isampler2DMS
  usampler2DMS sampler2DMSArray isampler2DMSArray usampler2DMSArray sizeof cast namespace using

  radians degrees sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh pow exp log exp2 log2 sqrt inversesqrt abs
  sign floor trunc round roundEven ceil fract mod modf min max clamp mix step smoothstep isnan isinf floatBitsToInt
  floatBitsToUint intBitsToFloat uintBitsToFloat packSnorm2x16 unpackSnorm2x16 packUnorm2x16 unpackUnorm2x16 packHalf2x16
  unpackHalf2x16 length distance dot cross normalize faceforward reflect refract matrixCompMult outerProduct transpose
  determinant inverse lessThan lessThanEqual greaterThan greaterThanEqual equal notEqual any all textureSize texture
  textureProj textureLod textureOffset texelFetch texelFetchOffset textureProjOffset textureLodOffset textureProjLod
  textureProjLodOffset textureGrad textureGradOffset textureProjGrad textureProjGradOffset dFdx dFdy fwidth main
)";

const char* type_name(ExprType t) { return t == ExprType::Color ? "vec3" : t == ExprType::Bool ? "bool" : "float"; }

std::string variable(const std::string& name) { return is_glsl_word(name) ? name + "_" : name; }

class GlslPrinter : public CLikePrinter {
 public:
  using CLikePrinter::CLikePrinter;

 private:
  const char* type_name(ExprType t) const override { return print::type_name(t); }
  bool is_word(const std::string& name) const override { return is_glsl_word(name); }
  std::string free_base(const std::string& name) const override {
    return name.starts_with("brdfc_") || name.starts_with("table_") ? "model_" + name : name;
  }

  Text text(int id) const override {
    const ExprNode& n = program_.node(id);
    switch (n.op) {
      case Op::Const:
        if (n.type == ExprType::Bool) return {n.value[0] != 0 ? "true" : "false", 6};
        if (n.type == ExprType::Color)
          return {fmt::format("vec3({}, {}, {})", number(n.value[0]), number(n.value[1]), number(n.value[2])), 6};
        return {number(n.value[0]), std::signbit(n.value[0]) ? 5 : 6};
      case Op::Input:
        return {variable(n.name), 6};
      case Op::MakeColor:
        return call("vec3", n);
      case Op::Select:
        // A function and not `?:`, with which devices branch to the arms: compilers then take up to minutes.
        return {fmt::format("brdfc_select({}, {}, {})", use(n.args[0], 0), arm(n, 1, 0), arm(n, 2, 0)), 6};
      case Op::Lookup: {
        std::string sizes, coordinates;
        for (std::size_t i = 0; i < n.args.size(); ++i) {
          sizes += fmt::format(", {}", n.table->axes[i].size());
          coordinates += ", " + use(n.args[i], 0);
        }
        return {fmt::format("brdfc_table{}(table_{}{}{})", n.args.size(), n.name, sizes, coordinates), 6};
      }
      // Of the library, as GLSL lacks them or computes few digits: a device may compute atan to 4096 units in the last
      // place, and sin and cos to 5e-4.
      case Op::Cbrt:
      case Op::Exp:
      case Op::Log:
      case Op::Log1p:
      case Op::Expm1:
      case Op::Sin:
      case Op::Cos:
      case Op::Atan:
      case Op::Pow:
      case Op::MaxComponent:
        return call(library_name(n.op), n);
      default:
        return CLikePrinter::text(id);
    }
  }
};

}  // namespace

bool is_glsl_word(const std::string& name) {
  static const std::set<std::string> words = [] {
    std::istringstream in(kGlslWords);
    return std::set<std::string>{std::istream_iterator<std::string>(in), {}};
  }();
  // Names with two underscores belong to the implementation.
  return words.count(name) > 0 || name.starts_with("brdfc_") || name.starts_with("table_") || name.starts_with("gl_") ||
         name.starts_with("webgl_") || name.starts_with("_webgl_") || name.find("__") != std::string::npos;
}

std::string glsl_function(const Program& program, const std::string& name, const std::vector<GlslArgument>& arguments,
                          const std::vector<ExprType>& results, Tables& tables) {
  add_tables(program, tables);
  const auto& outputs = program.outputs();
  if (results.size() != outputs.size()) throw ExprError(name + ": expected a type for each output");
  const bool returns = outputs.size() == 1;
  std::vector<std::string> heads, taken;
  for (const GlslArgument& a : arguments) {
    heads.push_back(fmt::format("{} {}", type_name(a.type), variable(a.name)));
    taken.push_back(variable(a.name));
  }
  if (!returns)
    for (std::size_t k = 0; k < outputs.size(); ++k) {
      heads.push_back(fmt::format("out {} {}", type_name(results[k]), variable(outputs[k].first)));
      taken.push_back(variable(outputs[k].first));
    }
  GlslPrinter printer(program, taken);
  std::string out = fmt::format("{} {}({}) {{\n", returns ? type_name(results[0]) : "void", name, join(heads, ", "));
  out += printer.statements(4);
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const int id = outputs[k].second;
    const bool promote = results[k] == ExprType::Color && program.node(id).type == ExprType::Real;
    const std::string value = promote ? fmt::format("vec3({})", printer.use(id, 0)) : printer.use(id, 0);
    out += returns ? fmt::format("    return {};\n", value)
                   : fmt::format("    {} = {};\n", variable(outputs[k].first), value);
  }
  return out + "}\n";
}

}  // namespace brdfc::print
