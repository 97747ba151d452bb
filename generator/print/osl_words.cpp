// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/osl_words.h"

#include <cctype>
#include <iterator>
#include <sstream>

namespace brdfc::print {
namespace {

/// Separated by spaces, one kind after the other.
constexpr const char* kOslWords = R"(
  and break closure color continue do else emit float for if illuminance illuminate int matrix normal not or output point
  public return string struct vector void while shader surface displacement volume light

  bool case catch char class const default delete double enum extern false friend goto inline long new operator private
  protected short signed sizeof static switch template this throw true try typedef uniform union unsigned varying virtual
  volatile

  Ci I N Ng Oi P Ps dPdtime dPdu dPdv dtime time u v

  abs atan backfacing burley_diffuse_bsdf cbrt clamp cos diffuse_ramp dot emission exp generalized_schlick_bsdf getattribute glossy_toon
  isfinite log max microfacet min normalize oren_nayar_diffuse_bsdf phong_ramp pow raytype reflect reflection refraction sin sqrt

  area ceil cross distance floor hypot length mix mod noise rotate round sign smoothstep step transform

  Albedo BSDF Normal Shown Tangent

  entry first frame_b frame_n frame_t last mirror_rise mirror_weight path_length ray shading_n show side
  shown_f shown_pdf shown_weight shown_x shown_y shown_z sum u_all weight whole wi wi_x wi_y wi_z wo wo_x wo_y wo_z

  across_here aimed along_here any_beam any_corner any_flat any_spot beam beam_blend beam_edge beam_here centre_here
  chosen chosen_extent chosen_lobe chosen_towards covered covered_before density_under disk_here drawn_density drawn_x
  drawn_y drawn_z earlier earlier_across earlier_along earlier_centre earlier_disk earlier_end earlier_exponent
  earlier_extent earlier_half earlier_lamp earlier_lobe earlier_radius earlier_rise earlier_solid_angle
  earlier_towards earlier_value excess full_across full_along full_centre full_disk half_way horizon kept_lamp kept_lobe lamp lamp_above lamp_across lamp_along
  lamp_centre lamp_cut lamp_density lamp_disk lamp_emphasis lamp_low lamp_met lamp_place lamp_rise lamp_scale lamp_shape
  lamp_solid_angle lamp_turn lamps lit_across lit_along lit_centre lit_disk lobe_colour lobe_colours lobe_end
  lobe_exponent lobe_extent lobe_followed lobe_half lobe_height lobe_radius lobe_rise lobe_room lobe_towards
  lobe_value lobe_weight lobes ray_x ray_y ray_z rest_colour rest_followed rest_weight several shape_here
  to_centre to_half_x to_half_y to_half_z to_lamp_x to_lamp_y to_lamp_z tossed v_all
)";

/// Prefixes of numbered names.
constexpr const char* kNumbered =
    "albedo alpha alpha_across exponent ior knots normal position ramp roughness size smooth table table_b table_g "
    "table_r tangent u v weight whole_across whole_alpha whole_f0 whole_weight";

std::set<std::string> split(const char* text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

/// True for names such as weight_0, normal_0_x or knots_0_1.
bool is_numbered(const std::string& name) {
  for (std::size_t at = name.find('_'); at != std::string::npos; at = name.find('_', at + 1))
    if (at + 1 < name.size() && std::isdigit(static_cast<unsigned char>(name[at + 1])))
      return numbered_osl_words().count(name.substr(0, at)) > 0;
  return false;
}

/// True for library functions, OSL's constants, lamp slots, and clamped parameters.
bool is_prefixed(const std::string& name) {
  for (const char* prefix : {"bounded_", "brdfc_", "M_", "LampPlace", "LampTurn", "LampScale", "LampShape"})
    if (name.starts_with(prefix)) return true;
  return false;
}

}  // namespace

const std::set<std::string>& osl_words() {
  static const std::set<std::string> words = split(kOslWords);
  return words;
}

const std::set<std::string>& numbered_osl_words() {
  static const std::set<std::string> words = split(kNumbered);
  return words;
}

bool is_osl_word(const std::string& name) { return osl_words().count(name) || is_numbered(name) || is_prefixed(name); }

std::string unnumbered(const std::string& name) {
  return is_numbered(name) || numbered_osl_words().count(name) || is_prefixed(name) ? "model_" + name : name;
}

}  // namespace brdfc::print
