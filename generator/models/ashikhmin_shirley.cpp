// SPDX-License-Identifier: GPL-3.0-or-later
// Ashikhmin and Shirley's anisotropic Phong model: a specular microfacet lobe with Schlick's Fresnel term over a
// diffuse base that darkens towards grazing angles.
//
// M. Ashikhmin, P. Shirley: An Anisotropic Phong Light Reflection Model, 2000. Equation numbers are those of the paper:
// specular term eq. 16 with the Fresnel term eq. 11, diffuse term eq. 14 or 12, their sum eq. 15, sampling eqs. 19, 20.
//
// Erratum: eq. 18 is printed upside down; p(k2) = p_h(h) / (4 (k1.h)).
//
// Numerical stability. The exponent (n_u (h.u)^2 + n_v (h.v)^2) / (1 - (h.n)^2) is 0/0 at h = n. With
// s2 = (h.u)^2 + (h.v)^2 = 1 - (h.n)^2, the power is exp((n_u (h.u)^2 + n_v (h.v)^2) log(h.n) / s2), where
// log(h.n) = log1p(-s2) / 2 is precise for any small s2. For the same reason cos theta = (1 - xi)^(1/(e+1)) is computed
// as 1 - cos theta = -expm1(log1p(-xi) / (e+1)). The tangent in eq. 19, which is infinite at xi_1 = 1, is kept as a
// ratio of sine and cosine; over the full circle this equals the paper's mapping of four quadrants.
//
// The choice diffuse = tabulated evaluates eq. 12 literally: R(k) is the albedo of the specular term, which has no
// closed form, and c makes the model lossless for R_d = 1:
//   f_d = R_d (1 - R(k1)) (1 - R(k2)) / (pi (1 - R_mean)),
// where 1 - R_mean is the cosine-weighted mean of 1 - R. By eq. 11, R = R_s A + (1 - R_s) B, where A is the albedo for
// F = 1 and B the albedo for F = (1 - k.h)^5. Tables of 1 - A and K = 1 - B / A are made from sample() on first use.
// With them 1 - R is a sum of non-negative terms:
//   1 - R = R_s (1 - A) + (1 - R_s) [(1 - A) + A K].
// A and K depend on the view and the exponents through four numbers. The slopes of a narrow lobe have the variances
// s_u^2, s_v^2 = 1 / (n + 1) along the axes. What matters are the variances along and across the plane of incidence,
// the correlation of these slopes, and how much of the lobe is below the surface. The cosine of the view can't replace
// the last one, because the angle at which the lobe begins to reach below the surface depends on the lobe's width.
// The interpolation error is at most 0.02 of the incident light, 0.003 on average; with R_d = 1 the model gains or
// loses that much.
#include "model/base_terms.h"
#include "model/half_vector.h"
#include "model/under.h"
#include "tables/table.h"

namespace brdfc {

struct LobeTables {
  std::shared_ptr<const Table> loss;      ///< 1 - A over the first four members of LobeAtView
  std::shared_ptr<const Table> softness;  ///< K over sqrt(cosTheta), the square roots of the widths, correlation2
};
const LobeTables& lobe_tables();

/// Cosine-weighted means over all views, as functions of the members of MeanWidth.
struct MeanTables {
  std::shared_ptr<const Table> loss;   ///< of 1 - A
  std::shared_ptr<const Table> matte;  ///< of 1 - B
};
const MeanTables& mean_tables();

/// The specular lobe relative to the plane of incidence.
template <class T> struct LobeAtView {
  T below_horizon;    ///< 0 if no part of a narrow lobe is below the surface, 1 at the horizon
  T along2, across2;  ///< variances of its slopes along and across the plane
  T correlation2;     ///< squared correlation of the two slopes
  T cosTheta;

  /// `w` is above the surface, in the frame of the exponents.
  LobeAtView(const Vec3<T>& w, const T& nu, const T& nv) {
    const T su2 = T(1) / (nu + T(1)), sv2 = T(1) / (nv + T(1));
    const T x2 = w.x * w.x, y2 = w.y * w.y, sin2 = named("sin2Theta", x2 + y2);
    // At normal incidence any plane contains the view.
    const T cosPhi2 = named("cosPhi2", select(sin2 > T(0), x2 / maximum(sin2, tiny<T>()), T(1)));
    const T sinPhi2 = select(sin2 > T(0), y2 / maximum(sin2, tiny<T>()), T(0));
    along2 = named("along2", su2 * cosPhi2 + sv2 * sinPhi2);
    across2 = named("across2", su2 * sinPhi2 + sv2 * cosPhi2);
    // along2 across2 = su2 sv2 + covariance^2
    const T covariance2 = named("covariance2", sqr(sv2 - su2) * cosPhi2 * sinPhi2);
    correlation2 = named("correlation2", covariance2 / (su2 * sv2 + covariance2));
    cosTheta = maximum(w.z, T(0));
    const T reach = named("reach", T(2) * sqrt(su2 * x2 + sv2 * y2));
    below_horizon = named("sunk", reach / maximum(cosTheta + reach, tiny<T>()));
  }

  /// 1 - A
  T loss() const {
    return named("loss", lookup(lobe_tables().loss, std::array<T, 4>{below_horizon, along2, across2, correlation2}));
  }
  /// 1 - B
  T matte() const {
    const std::array<T, 4> x{sqrt(cosTheta), sqrt(sqrt(along2)), sqrt(sqrt(across2)), correlation2};
    return loss() + (T(1) - loss()) * named("K", lookup(lobe_tables().softness, x));
  }
};

/// The lobe's width, averaged over all planes of incidence.
template <class T> struct MeanWidth {
  T width;      ///< square root of the slopes' mean variance
  T roundness;  ///< 1 for equal exponents, 0 for a line

  MeanWidth(const T& nu, const T& nv) {
    const T u = nu + T(1), v = nv + T(1);
    width = named("width", sqrt((T(1) / u + T(1) / v) / T(2)));
    roundness = named("roundness", T(2) * sqrt(u * v) / (u + v));
  }
  T loss() const { return lookup(mean_tables().loss, std::array<T, 2>{width, roundness}); }
  T matte() const { return lookup(mean_tables().matte, std::array<T, 2>{width, roundness}); }
};

template <class T> struct AshikhminShirley {
  Rgb<T> rs, rd;
  T nu, nv, rotation;
  Choice part, diffuse;

  enum { Both, Specular, Diffuse };
  enum { Paper, Tabulated };

  static ModelInfo info() {
    return {
        .name = "ashikhmin_shirley",
        .label = "Ashikhmin-Shirley",
        .look = Look::Glossy,
        .paper = "M. Ashikhmin, P. Shirley: An Anisotropic Phong Light Reflection Model, 2000",
        .equations = "eqs. 11, 12, 14-16, 19, 20; eq. 18 inverted",
        .doc = "Anisotropic Phong lobe with Fresnel reflection over a diffuse base that gives way at grazing angles.",
        .properties = {.isotropic = false,
                       .smooth = false,  // max(wi.z, wo.z) of eq. 16
                       .exact_sampling = false,
                       .specular_limit = "part=specular nu=1e8 nv=1e8",
                       .tabulated = {"diffuse", "tabulated", 0.02}},
        .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rs, ColorSpec{"rs", "Specular Reflectance", {0.05, 0.05, 0.05}, "Mirror reflectance at normal incidence, R_s"}
              .as(Optical::Reflectance)
              .at_most_one());
    v(rd, ColorSpec{"rd", "Diffuse Reflectance", {0.5, 0.5, 0.5}, "Albedo of the diffuse substrate, R_d"});
    v(nu, NumberSpec{"nu", "Exponent U", 100, 0, 1e8, 0, 10000, "Phong exponent along the tangent, n_u"}.by_factors());
    v(nv, NumberSpec{"nv", "Exponent V", 100, 0, 1e8, 0, 10000, "Phong exponent across the tangent, n_v"}.by_factors());
    v(rotation,
      NumberSpec{"rotation", "Rotation", 0, -2 * kPi, 2 * kPi, -kPi, kPi, "Turns the tangent about the normal", "rad"});
    v(part, ChoiceSpec{"part", "Part", {"both", "specular", "diffuse"}, "Which terms of eq. 15 to use"});
    v(diffuse, ChoiceSpec{"diffuse",
                          "Diffuse Term",
                          {"paper", "tabulated"},
                          "paper: eq. 14, which loses light; tabulated: eq. 12, which loses none at rd = 1"});
  }

  /// The half vector in the rotated frame.
  HalfVector<T> half(const Vec3<T>& wi, const Vec3<T>& wo) const {
    HalfVector<T> k(wi, wo);
    k.h = rotate_z(k.h, cos(rotation), sin(rotation));
    return k;
  }

  /// p_h(h), eq. 5.
  T p_h(const Vec3<T>& h) const {
    const T hu2 = h.x * h.x, hv2 = h.y * h.y;
    const T s2 = named("sin2_h", hu2 + hv2);
    // log(h.n) / (1 - (h.n)^2): near the pole from s2, near the horizon from h.n itself.
    const T near_pole = select(s2 < T(1e-12), T(-0.5), T(0.5) * log1p(-minimum(s2, T(0.75))) / maximum(s2, T(1e-12)));
    const T near_horizon = log(maximum(h.z, tiny<T>())) / maximum(s2, T(0.25));
    const T log_ratio = named("log_ratio", select(s2 < T(0.5), near_pole, near_horizon));
    return named("p_h", sqrt((nu + T(1)) * (nv + T(1))) / (T(2) * pi<T>()) * exp((nu * hu2 + nv * hv2) * log_ratio));
  }

  /// F(k.h), eq. 11.
  Rgb<T> fresnel(const HalfVector<T>& k) const {
    return named("F", rs + (Rgb<T>(T(1)) - rs) * named("one_minus_kh5", pow5(k.one_minus_oh)));
  }

  /// Specular term, eq. 16.
  Rgb<T> specular(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k = half(wi, wo);
    return fresnel(k) * (p_h(k.h) / (T(4) * k.oh * maximum(wi.z, wo.z)));
  }

  T specular_pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k = half(wi, wo);
    return p_h(k.h) / (T(4) * k.oh);
  }

  /// The light that the specular term leaves to the diffuse one, from 1 - A and 1 - B of a lobe or from their means.
  template <class Lobe> Rgb<T> rest(const Lobe& lobe) const {
    return rs * lobe.loss() + (Rgb<T>(T(1)) - rs) * lobe.matte();
  }
  /// 1 - R(k)
  Rgb<T> rest_at(const Vec3<T>& k) const {
    return rest(LobeAtView<T>(rotate_z(k, cos(rotation), sin(rotation)), nu, nv));
  }

  /// 1 - (1 - c/2)^5 of eq. 14, as a polynomial: no cancellation for small c.
  static T fade(const T& c) {
    const T x = c / T(2);
    return x * (T(5) - x * (T(10) - x * (T(10) - x * (T(5) - x))));
  }

  /// Diffuse term, eq. 14 or 12.
  Rgb<T> substrate(const Vec3<T>& wi, const Vec3<T>& wo) const {
    if (diffuse == Tabulated) {
      const Rgb<T> mean = named("rest_mean", rest(MeanWidth<T>(nu, nv)));
      return rd * named("rest_i", rest_at(wi)) * (named("rest_o", rest_at(wo)) / (mean * pi<T>()));
    }
    return rd * (Rgb<T>(T(1)) - rs) * (T(28) / (T(23) * pi<T>()) * fade(wi.z) * fade(wo.z));
  }

  /// The diffuse term's albedo; the cosine-weighted mean of fade() is 23/28.
  Rgb<T> substrate_albedo(const Vec3<T>& wo) const {
    if (diffuse == Tabulated) return rd * named("rest_o", rest_at(wo));
    return rd * (Rgb<T>(T(1)) - rs) * fade(wo.z);
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    Rgb<T> f(T(0));
    if (part != Diffuse) f += specular(wi, wo);
    if (part != Specular) f += substrate(wi, wo);
    return select(above(wi, wo), f, Rgb<T>(T(0)));
  }

  /// The probability with which sample() chooses the specular lobe.
  T specular_share() const { return part == Specular ? T(1) : part == Diffuse ? T(0) : T(0.5); }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T share = specular_share();
    T p(0);
    if (part != Diffuse) p = p + share * specular_pdf(wi, wo);
    if (part != Specular) p = p + (T(1) - share) * cosine_pdf(wi);
    return select(above(wi, wo), p, T(0));
  }

  /// Samples a half vector with the pdf p_h, eqs. 19 and 20, and reflects wo about it, eq. 17.
  Vec3<T> sample_specular(const Vec3<T>& wo, const T& u1, const T& u2) const {
    const T angle = T(2) * pi<T>() * u1;
    const T cu = sqrt(nv + T(1)) * cos(angle), cv = sqrt(nu + T(1)) * sin(angle);
    const T norm = sqrt(cu * cu + cv * cv);
    const T cosPhi = named("cosPhi", cu / norm), sinPhi = named("sinPhi", cv / norm);
    const T exponent = nu * cosPhi * cosPhi + nv * sinPhi * sinPhi;
    const T one_minus_cos = named("one_minus_cos_h", -expm1(log1p(-u2) / (exponent + T(1))));
    const T sinTheta = named("sinTheta_h", sqrt(one_minus_cos * (T(2) - one_minus_cos)));
    const Vec3<T> h =
        rotate_z(Vec3<T>{sinTheta * cosPhi, sinTheta * sinPhi, T(1) - one_minus_cos}, cos(rotation), -sin(rotation));
    return h * (T(2) * dot(wo, h)) - wo;
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    if (part == Diffuse) {
      const Vec3<T> wi = sample_cosine(u.y, u.z);
      const T p = cosine_pdf(wi);
      return sample_if(above(wi, wo), wi, substrate(wi, wo) * pi<T>(), p);
    }
    if (part == Specular) {
      // f cos / pdf = F min(1, cos_i / cos_o): the power cancels.
      const Vec3<T> wi = sample_specular(wo, u.y, u.z);
      const HalfVector<T> k = half(wi, wo);
      const T ratio = wi.z / maximum(maximum(wi.z, wo.z), tiny<T>());
      return sample_if(above(wi, wo), wi, fresnel(k) * ratio, p_h(k.h) / (T(4) * k.oh));
    }
    const auto specular_lobe = u.x < specular_share();
    const Vec3<T> glossy = sample_specular(wo, u.y, u.z), matte = sample_cosine(u.y, u.z);
    const Vec3<T> wi = select(specular_lobe, glossy, matte);
    const T p = pdf(wi, wo);
    return sample_if(p > T(0), wi, eval(wi, wo) * (wi.z / maximum(p, tiny<T>())), p);
  }

  /// Beckmann microfacets of about the lobe's width. For the diffuse term a ramp: exact for eq. 14 except for the
  /// ramp's resolution, and an approximation for eq. 12.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const Rgb<T> none(T(0));
    // At normal incidence f cos falls off as cos^(n + 3); microfacets fall off 4 powers more slowly than their slopes'
    // density. 5 serves wide lobes better than 7. The ratio of the normalisations then gives both the same peak.
    const T au2 = named("au2", T(2) / (nu + T(5))), av2 = named("av2", T(2) / (nv + T(5)));
    const T size = sqrt((nu + T(1)) * (nv + T(1)) * au2 * av2) / T(2);
    // How far the lobe extends towards the horizon.
    const Vec3<T> k = rotate_z(wo, cos(rotation), sin(rotation));
    const T reach2 = named("reach2", au2 * sqr(k.x) + av2 * sqr(k.y));
    const Rgb<T> F = rs + (Rgb<T>(T(1)) - rs) * schlick_weight(lobe_height(wo.z, T(0.7) * reach2));
    // Eq. 16 loses more light near the horizon than microfacets do.
    const Rgb<T> glossy = F * (size * wo.z / (wo.z + T(0.3) * sqrt(reach2)));
    Closure<T> matte(ClosureKind::DiffuseRamp, part == Specular ? none : substrate_albedo(wo));
    for (int i = 0; i < kRampSize; ++i) {
      const T c = T(i) / T(kRampSize - 1);
      // For eq. 12 the fade is that of the Fresnel term and of the light lost to the lobe. Both fades have the
      // cosine-weighted mean 1.
      const T faded = diffuse == Paper ? T(28. / 23) * fade(c) : T(21. / 20) * one_minus_schlick_weight(c);
      matte.ramp[std::size_t(i)] = Rgb<T>(faded * c);
    }
    return {facets(ClosureKind::Beckmann, part == Diffuse ? none : glossy, sqrt(au2), sqrt(av2), rotation), matte};
  }

  /// The diffuse term of eq. 14 by two cones, which have 96 % of it.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const bool none = part == Specular || diffuse == Tabulated;
    const Rgb<T> all = none ? Rgb<T>(T(0)) : rd * (Rgb<T>(T(1)) - rs) * (T(28) / (T(23) * pi<T>()) * fade(wo.z));
    return cones_under(all, {0.968, 0.7445}, {0.4033, 0.9222});
  }
};

#if BRDFC_BASELINE  // tables are made once
namespace {

constexpr double kNarrowest = 1e-4;  // the width of a lobe with the largest exponents

/// Rounds to a number of digits, as printed in a shader's text. The rounding error is less than a tenth of the
/// interpolation error.
double rounded(double v, int digits) {
  if (v == 0) return 0;
  const double unit = std::pow(10, std::floor(std::log10(std::abs(v))) + 1 - digits);
  return std::round(v / unit) * unit;
}

/// A table of at(coordinates in [0, 1]) over evenly spaced axes. To record the formulas, as `brdfc list` does, its
/// values are not needed.
template <class F>
std::shared_ptr<const Table> tabulate(const char* name, std::vector<TableAxis> axes, int precision, const F& at) {
  const auto compute = [axes, precision, at] {
    std::size_t count = 1;
    for (const TableAxis& a : axes) count *= a.values.size();
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) {
      std::array<double, 4> x{};
      std::size_t digits = i;
      for (std::size_t d = axes.size(); d-- > 0; digits /= axes[d].values.size())
        x[d] = axes[d].values[digits % axes[d].values.size()];
      values.push_back(rounded(at(x), precision));
    }
    return values;
  };
  return make_table_later(name, std::move(axes), compute);
}

/// A and B for a lobe with these slopes; the axes are rotated so that u is the wider one.
Rgb<double> specular_albedos(double along, double across, double correlation2, double cosTheta) {
  const double a2 = sqr(std::max(along, kNarrowest)), c2 = sqr(std::max(across, kNarrowest));
  // s_u^2 and s_v^2 from their sum and their product.
  const double sum = a2 + c2, product = a2 * c2 * (1 - std::min(correlation2, 1 - 1e-6));
  const double apart = std::sqrt(std::max(0., sum * sum - 4 * product));
  const double su2 = (sum + apart) / 2, sv2 = product / su2;
  const double cosPhi2 = apart > 0 ? std::clamp((a2 - sv2) / apart, 0., 1.) : 1;
  const double c = std::max(cosTheta, 1e-9), s = std::sqrt((1 - c) * (1 + c));
  const Vec3<double> wo{s * std::sqrt(cosPhi2), s * std::sqrt(1 - cosPhi2), c};

  AshikhminShirley<double> m{};
  m.rs = {1, 0, 0};
  m.nu = 1 / su2 - 1;
  m.nv = 1 / sv2 - 1;
  m.part.index = AshikhminShirley<double>::Specular;
  // Sampling by eqs. 19, 20 cancels the power; squaring the random number puts more samples at low half vectors.
  constexpr int kAngles = 24, kHeights = 24;
  Rgb<double> albedos(0);
  for (int i = 0; i < kAngles; ++i)
    for (int j = 0; j < kHeights; ++j) {
      const double q = (j + 0.5) / kHeights;
      albedos += m.sample(wo, {0, (i + 0.5) / kAngles, 1 - q * q}).weight * (2 * q / (kAngles * kHeights));
    }
  return albedos;
}

/// The cosine-weighted mean of value(view) over all views.
template <class F> double mean_over_views(double width, double roundness, const F& value) {
  constexpr int kAzimuths = 16, kCosines = 64;
  const double w2 = sqr(std::max(width, kNarrowest)), apart = std::sqrt(1 - sqr(std::max(roundness, 1e-6)));
  const double nu = 1 / (w2 * (1 + apart)) - 1, nv = 1 / (w2 * (1 - apart)) - 1;
  double sum = 0;
  for (int i = 0; i < kAzimuths; ++i)
    for (int j = 0; j < kCosines; ++j) {
      const double phi = kPi / 2 * (i + 0.5) / kAzimuths, root = (j + 0.5) / kCosines;
      const double c = root * root, s = std::sqrt((1 - c) * (1 + c));
      sum += 4 * c * root * value(LobeAtView<double>({s * std::cos(phi), s * std::sin(phi), c}, nu, nv));
    }
  return sum / (kAzimuths * kCosines);
}

}  // namespace

const LobeTables& lobe_tables() {
  static const LobeTables tables = {
      .loss = tabulate(
          "specular_loss",
          {even_axis("sunk", 12), even_axis("along2", 13), even_axis("across2", 10), even_axis("correlation2", 4)}, 4,
          [](const std::array<double, 4>& x) {
            const double along = std::sqrt(x[1]), across = std::sqrt(x[2]);
            // sunk = reach / (cosTheta + reach) with reach = 2 along sinTheta
            const double cotTheta = x[0] > 0 ? 2 * std::max(along, kNarrowest) * (1 - x[0]) / x[0] : HUGE_VAL;
            return 1 - specular_albedos(along, across, x[3], 1 / std::hypot(1, 1 / cotTheta)).r;
          }),
      .softness = tabulate("specular_softness",
                           {even_axis("sqrt_cosTheta", 18), even_axis("sqrt_along", 13), even_axis("sqrt_across", 7),
                            even_axis("correlation2", 4)},
                           3, [](const std::array<double, 4>& x) {
                             const Rgb<double> a = specular_albedos(sqr(x[1]), sqr(x[2]), x[3], sqr(x[0]));
                             return 1 - a.g / a.r;
                           })};
  return tables;
}

const MeanTables& mean_tables() {
  static const MeanTables tables = {
      .loss = tabulate("mean_loss", {even_axis("width", 17), even_axis("roundness", 17)}, 4,
                       [](const std::array<double, 4>& x) {
                         return mean_over_views(x[0], x[1], [](const LobeAtView<double>& lobe) { return lobe.loss(); });
                       }),
      .matte = tabulate(
          "mean_matte", {even_axis("width", 17), even_axis("roundness", 17)}, 4, [](const std::array<double, 4>& x) {
            return mean_over_views(x[0], x[1], [](const LobeAtView<double>& lobe) { return lobe.matte(); });
          })};
  return tables;
}
#endif

BRDFC_MODEL(AshikhminShirley)
BRDFC_UNDER(AshikhminShirley)

}  // namespace brdfc
