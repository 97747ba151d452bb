// SPDX-License-Identifier: GPL-3.0-or-later
// What a reflection model is: a schema and formulas over a scalar type, registered under one name.
//
// Conventions. Directions are unit vectors that leave the surface in a local frame whose z axis is the
// normal: wi points to the light, wo to the viewer. eval() is the BRDF in 1/sr without the cosine and
// without delta terms; pdf() is the density of sample() in solid angle at wi, for the same wo, delta terms
// left out; mirror() is the weight of the delta term in the direction of ideal reflection. Albedo is the
// integral of f cos(theta_i) over wi, plus the mirror weight. Colours are linear scene-referred RGB.
//
// A model has eval(), pdf() and sample(), or none of them: then it has delta terms alone, f and pdf are 0 and every
// sample is lost.
//
// Transmission. A model that lets light through separates two media, and z is the normal that leaves the object: a
// direction with z < 0 lies inside. Then wo may be on either side; mirror(wo) reflects on its side, transmit(wo) is the
// weight of the delta term in the direction of ideal refraction, channel by channel where they are bent apart
// (channel_iors()), ior() the index inside over the one outside. One whose scatters_through() holds has f, pdf and
// samples for wi on either side as well, cosines are absolute, and the albedo integrates over the sphere. Weights and f
// count energy: a lossless boundary has albedo 1 from both sides, and f is reciprocal up to the squared index,
// f(wi, wo) n(wo)^2 = f(wo, wi) n(wi)^2. Radiance is not scaled by it, as in Cycles.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "closures/closure.h"
#include "core/error.h"
#include "core/pack.h"
#include "core/vec.h"
#include "model/schema.h"
#include "trace/expr.h"

namespace brdfc::inline model {

/// A sampled direction. pdf == 0 means: no direction (below the horizon); weight is then 0.
template <class T> struct Sample {
  Vec3<T> wi;
  Rgb<T> weight;  ///< f cos(theta_i) / pdf
  T pdf;          ///< per solid angle
};

/// A model with its parameters bound.
template <class T> class Brdf {
 public:
  virtual ~Brdf() = default;
  /// BRDF in 1/sr; 0 unless both directions are above the surface.
  virtual Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const = 0;
  /// Density of sample() per solid angle.
  virtual T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const = 0;
  /// u: three numbers in [0, 1): lobe choice, and two for the direction.
  virtual Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const = 0;
  /// Weight of ideal reflection; 0 for a model without a mirror term.
  virtual Rgb<T> mirror(const Vec3<T>& wo) const = 0;
  /// Weight of ideal refraction; 0 for a model without that term and beyond the critical angle.
  virtual Rgb<T> transmit(const Vec3<T>& wo) const = 0;
  /// Refractive index inside over the one outside; 1 where nothing is let through.
  virtual T ior() const = 0;
  /// The same for ideal refraction of red, green and blue, which a model may bend apart.
  virtual std::array<T, 3> channel_iors() const = 0;
  /// Share of the light left after a distance inside.
  virtual Rgb<T> transmittance(const T& distance) const = 0;
  /// Does f join directions on different sides, with the choices bound?
  virtual bool scatters_through() const = 0;
  /// The closures that equal the model, or nothing if no such sum is known. Delta terms alone are always known.
  virtual std::optional<ClosureSum<T>> exact(const Vec3<T>& wo) const = 0;
  /// Closures that carry most of f cos(theta_i) for any parameters, none for a model that declares no such sum. No
  /// error is claimed: who uses them adds what they lack. Weights are not negative, nor is there a delta term among
  /// them.
  virtual ClosureSum<T> base(const Vec3<T>& wo) const = 0;
  /// Binds a number, the first element, or a colour anew. The value is not checked; another name than that of a number
  /// or colour does nothing.
  virtual void assign(const std::string& name, const std::array<double, 3>& value) = 0;
};

inline namespace BRDFC_INSTRUCTION_SET {

/// A BRDF and the density of sampling it.
struct PackedEvaluation {
  Rgb<Pack> f;
  Pack pdf;
};

/// A model with its parameters bound that takes eight directions at once; its functions are Brdf's.
class PackedBrdf {
 public:
  virtual ~PackedBrdf() = default;
  /// eval() and pdf(), which have much in common.
  virtual PackedEvaluation evaluate(const Vec3<Pack>& wi, const Vec3<Pack>& wo) const = 0;
  virtual Sample<Pack> sample(const Vec3<Pack>& wo, const Vec3<Pack>& u) const = 0;
  virtual Rgb<Pack> mirror(const Vec3<Pack>& wo) const = 0;
  virtual Rgb<Pack> transmit(const Vec3<Pack>& wo) const = 0;
  virtual Rgb<Pack> transmittance(const Pack& distance) const = 0;
  virtual Pack ior() const = 0;
  virtual std::array<Pack, 3> channel_iors() const = 0;
  virtual void assign(const std::string& name, const std::array<Pack, 3>& value) = 0;
};

}  // namespace BRDFC_INSTRUCTION_SET

/// The formulas of a model over Pack, compiled for one instruction set. Arguments and results are passed by address,
/// for each instruction set has a type Pack of its own; their layouts are the same. `model` is an M<Pack>. Null where
/// the model lacks the term.
struct PackedFormulas {
  void (*evaluate)(const void* model, const void* wi, const void* wo, void* evaluation);  ///< to a PackedEvaluation
  void (*sample)(const void* model, const void* wo, const void* u, void* sample);         ///< to a Sample<Pack>
  void (*mirror)(const void* model, const void* wo, void* weight);                        ///< to an Rgb<Pack>
  void (*transmit)(const void* model, const void* wo, void* weight);                      ///< to an Rgb<Pack>
  void (*transmittance)(const void* model, const void* distance, void* share);            ///< to an Rgb<Pack>
};
/// Those that this machine's processor runs fastest.
const PackedFormulas* fastest(const PackedFormulas* baseline, const PackedFormulas* x86_64_v3,
                              const PackedFormulas* x86_64_v4);

/// A registered model.
class Model {
 public:
  virtual ~Model() = default;
  virtual const ModelInfo& info() const = 0;
  /// What is wrong with the members that parameters() binds, as the rest of a sentence; nothing if each is bound once.
  virtual std::optional<std::string> misbound() const { return std::nullopt; }
  /// False for a model with delta terms alone.
  virtual bool has_scatter() const = 0;
  virtual bool has_mirror() const = 0;
  virtual bool has_exact() const = 0;
  /// The kinds of a base's closures, and what they are turned and stretched by, are the same for all choices
  /// that have any.
  virtual bool has_base() const { return false; }
  virtual bool has_transmit() const { return false; }
  /// Does the inside absorb?
  virtual bool has_medium() const { return false; }
  /// Does f join directions on different sides for some choice?
  virtual bool has_through() const { return false; }
  /// Views from inside (wo.z < 0) are meant as well.
  bool two_sided() const { return has_transmit() || has_through(); }
  /// Throws InputError naming model, parameter and what was expected.
  virtual std::unique_ptr<Brdf<double>> make_double(const ParamValues&) const = 0;
  virtual std::unique_ptr<Brdf<float>> make_float(const ParamValues&) const = 0;
  virtual std::unique_ptr<Brdf<Wide>> make_wide(const ParamValues&) const = 0;
  virtual std::unique_ptr<PackedBrdf> make_packed(const ParamValues&) const = 0;
  /// Parameters in `fixed` become constants, other numbers and colours become inputs named after them.
  /// A choice that is not fixed takes its default. A Recorder must be active.
  virtual std::unique_ptr<Brdf<Expr>> record(const ParamValues& fixed) const = 0;
};

/// Throws InputError naming the model if parameters() leaves out a member: it would hold what was in memory.
void require_bound(const Model&);

/// Name to model, in alphabetical order. Throws InputError if one is declared wrongly (model/registry.h), as the two
/// functions below do.
const std::map<std::string, std::unique_ptr<Model>>& models();
/// Throws InputError that lists the known names.
const Model& find_model(const std::string& name);
/// That one, or without a name all of them.
std::vector<const Model*> models_named(const std::string& name);

/// Called by BRDFC_MODEL, before main(): nobody could catch what it threw. models() tells what is wrong.
bool register_model(std::unique_ptr<Model>, const char* file);

namespace detail {

/// `values` is complete, so every look-up succeeds.
template <class T> struct BindVisitor {
  const ParamValues& values;
  void operator()(T& member, const NumberSpec& s) const { member = T(std::get<double>(values.at(s.name))); }
  void operator()(Rgb<T>& member, const ColorSpec& s) const {
    const auto& c = std::get<std::array<double, 3>>(values.at(s.name));
    member = Rgb<T>(T(c[0]), T(c[1]), T(c[2]));
  }
  void operator()(Choice& member, const ChoiceSpec& s) const {
    const auto& text = std::get<std::string>(values.at(s.name));
    for (std::size_t i = 0; i < s.choices.size(); ++i)
      if (s.choices[i] == text) member.index = int(i);
  }
};

/// Binds one number or colour.
template <class T, class Value> struct AssignVisitor {
  const std::string& name;
  const std::array<Value, 3>& value;
  void operator()(T& member, const NumberSpec& s) const {
    if (name == s.name) member = T(value[0]);
  }
  void operator()(Rgb<T>& member, const ColorSpec& s) const {
    if (name == s.name) member = Rgb<T>(T(value[0]), T(value[1]), T(value[2]));
  }
  void operator()(Choice&, const ChoiceSpec&) const {}
};

/// Binds what is fixed to constants and the rest to inputs.
struct RecordVisitor {
  const ParamValues& values;  // complete
  const ParamValues& fixed;
  void operator()(Expr& member, const NumberSpec& s) const {
    member = fixed.count(s.name) ? Expr(std::get<double>(values.at(s.name))) : Expr::input(s.name);
  }
  void operator()(Rgb<Expr>& member, const ColorSpec& s) const {
    if (fixed.count(s.name)) {
      const auto& c = std::get<std::array<double, 3>>(values.at(s.name));
      member = Rgb<Expr>(Expr(c[0]), Expr(c[1]), Expr(c[2]));
    } else {
      member = Rgb<Expr>::input(s.name);
    }
  }
  void operator()(Choice& member, const ChoiceSpec& s) const { BindVisitor<Expr>{values}(member, s); }
};

/// Where a parameter's member lies within its model, in bytes.
struct BoundMember {
  std::size_t first, end;
  std::string name;
};
/// Notes them; `begin` is the model.
struct PlaceVisitor {
  const void* begin;
  std::vector<BoundMember>& out;
  template <class Member, class Spec> void operator()(const Member& member, const Spec& s) const {
    const std::size_t first = std::size_t(reinterpret_cast<const char*>(&member) - static_cast<const char*>(begin));
    out.push_back({first, first + sizeof(Member), s.name});
  }
};
/// As Model::misbound(), of a model of so many bytes, 0 for one without members.
std::optional<std::string> misbound(std::vector<BoundMember>, std::size_t size);

template <class M>
concept HasScatter = requires(const M& m, const Vec3<double>& w) {
  m.eval(w, w);
  m.pdf(w, w);
  m.sample(w, w);
};
template <class M>
concept HasMirror = requires(const M& m, const Vec3<double>& w) {
  m.mirror(w);
};
template <class M>
concept HasTransmit = requires(const M& m, const Vec3<double>& w) {
  m.transmit(w);
  m.ior();
};
/// Bends channels apart where disperses() holds.
template <class M>
concept HasDispersion = HasTransmit<M> && requires(const M& m) {
  m.disperses();
  m.channel_iors();
};
template <class M>
concept HasMedium = requires(const M& m, double distance) {
  m.transmittance(distance);
};
template <class M>
concept HasThrough = requires(const M& m) {
  m.scatters_through();
  m.ior();
};
template <class M>
concept HasExact = requires(const M& m, const Vec3<double>& w) {
  m.exact(w);
};
template <class M>
concept HasBase = requires(const M& m, const Vec3<double>& w) {
  m.base(w);
};

template <template <class> class M, class T> class BrdfOf final : public Brdf<T> {
  static constexpr bool kScatters = HasScatter<M<double>>;
  static constexpr bool kTransmits = HasTransmit<M<double>>;
  static_assert(kScatters || HasMirror<M<double>> || kTransmits, "a model needs eval, pdf and sample, or a delta term");

 public:
  explicit BrdfOf(M<T> m) : m_(std::move(m)) {}
  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const override {
    if constexpr (kScatters)
      return m_.eval(wi, wo);
    else
      return Rgb<T>(T(0));
  }
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const override {
    if constexpr (kScatters)
      return m_.pdf(wi, wo);
    else
      return T(0);
  }
  void assign(const std::string& name, const std::array<double, 3>& value) override {
    m_.parameters(AssignVisitor<T, double>{name, value});
  }
  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const override {
    if constexpr (kScatters)
      return m_.sample(wo, u);
    else
      return {{T(0), T(0), T(1)}, Rgb<T>(T(0)), T(0)};
  }
  Rgb<T> mirror(const Vec3<T>& wo) const override {
    if constexpr (HasMirror<M<double>>)
      return m_.mirror(wo);
    else
      return Rgb<T>(T(0));
  }
  Rgb<T> transmit(const Vec3<T>& wo) const override {
    if constexpr (kTransmits)
      return m_.transmit(wo);
    else
      return Rgb<T>(T(0));
  }
  T ior() const override {
    if constexpr (kTransmits || HasThrough<M<double>>)
      return m_.ior();
    else
      return T(1);
  }
  std::array<T, 3> channel_iors() const override {
    if constexpr (HasDispersion<M<double>>)
      return m_.channel_iors();
    else
      return {ior(), ior(), ior()};
  }
  Rgb<T> transmittance(const T& distance) const override {
    if constexpr (HasMedium<M<double>>)
      return m_.transmittance(distance);
    else
      return Rgb<T>(T(1));
  }
  bool scatters_through() const override {
    if constexpr (HasThrough<M<double>>)
      return m_.scatters_through();
    else
      return false;
  }
  std::optional<ClosureSum<T>> exact(const Vec3<T>& wo) const override {
    if constexpr (HasExact<M<double>>)
      return m_.exact(wo);
    else if constexpr (!kScatters)
      return delta_terms(wo);
    else
      return std::nullopt;
  }
  ClosureSum<T> base(const Vec3<T>& wo) const override {
    if constexpr (HasBase<M<double>>)
      return m_.base(wo);
    else
      return {};
  }

 private:
  ClosureSum<T> delta_terms(const Vec3<T>& wo) const {
    ClosureSum<T> sum;
    if constexpr (HasMirror<M<double>>) sum.emplace_back(ClosureKind::Reflection, mirror(wo));
    const auto refract_by = [&](const T& ior, const Rgb<T>& weight) {
      sum.emplace_back(ClosureKind::Refraction, weight);
      sum.back().ior = select(wo.z > T(0), ior, T(1) / ior);
    };
    if constexpr (HasDispersion<M<double>>) {
      // One for each channel where they part, else one for all, in green's place.
      const Rgb<T> weight = transmit(wo), none(T(0));
      const std::array<T, 3> iors = m_.channel_iors();
      const auto parted = m_.disperses();
      refract_by(iors[0], select(parted, weight * Rgb<T>(T(1), T(0), T(0)), none));
      refract_by(iors[1], select(parted, weight * Rgb<T>(T(0), T(1), T(0)), weight));
      refract_by(iors[2], select(parted, weight * Rgb<T>(T(0), T(0), T(1)), none));
    } else if constexpr (kTransmits) {
      refract_by(m_.ior(), transmit(wo));
    }
    return sum;
  }

  M<T> m_;
};

inline namespace BRDFC_INSTRUCTION_SET {

template <template <class> class M> constexpr PackedFormulas packed_formulas() {
  using Of = M<Pack>;
  using V = Vec3<Pack>;
  using Color = Rgb<Pack>;
  PackedFormulas out{};
  if constexpr (HasScatter<M<double>>) {
    out.evaluate = [](const void* m, const void* wi, const void* wo, void* evaluation) {
      const Of& model = *static_cast<const Of*>(m);
      const V &in = *static_cast<const V*>(wi), &view = *static_cast<const V*>(wo);
      *static_cast<PackedEvaluation*>(evaluation) = {model.eval(in, view), model.pdf(in, view)};
    };
    out.sample = [](const void* m, const void* wo, const void* u, void* sample) {
      *static_cast<Sample<Pack>*>(sample) =
          static_cast<const Of*>(m)->sample(*static_cast<const V*>(wo), *static_cast<const V*>(u));
    };
  }
  if constexpr (HasMirror<M<double>>)
    out.mirror = [](const void* m, const void* wo, void* weight) {
      *static_cast<Color*>(weight) = static_cast<const Of*>(m)->mirror(*static_cast<const V*>(wo));
    };
  if constexpr (HasTransmit<M<double>>)
    out.transmit = [](const void* m, const void* wo, void* weight) {
      *static_cast<Color*>(weight) = static_cast<const Of*>(m)->transmit(*static_cast<const V*>(wo));
    };
  if constexpr (HasMedium<M<double>>)
    out.transmittance = [](const void* m, const void* distance, void* share) {
      *static_cast<Color*>(share) = static_cast<const Of*>(m)->transmittance(*static_cast<const Pack*>(distance));
    };
  return out;
}
template <template <class> class M> inline constexpr PackedFormulas kPackedFormulas = packed_formulas<M>();

}  // namespace BRDFC_INSTRUCTION_SET

template <template <class> class M> class PackedOf final : public PackedBrdf {
  using V = Vec3<Pack>;
  using Color = Rgb<Pack>;

 public:
  PackedOf(const M<Pack>& m, const PackedFormulas& formulas) : m_(m), formulas_(formulas) {}
  PackedEvaluation evaluate(const V& wi, const V& wo) const override {
    PackedEvaluation out{Color(Pack(0)), Pack(0)};
    if (formulas_.evaluate) formulas_.evaluate(&m_, &wi, &wo, &out);
    return out;
  }
  Sample<Pack> sample(const V& wo, const V& u) const override {
    Sample<Pack> out{{Pack(0), Pack(0), Pack(1)}, Color(Pack(0)), Pack(0)};
    if (formulas_.sample) formulas_.sample(&m_, &wo, &u, &out);
    return out;
  }
  Color mirror(const V& wo) const override {
    Color out(Pack(0));
    if (formulas_.mirror) formulas_.mirror(&m_, &wo, &out);
    return out;
  }
  Color transmit(const V& wo) const override {
    Color out(Pack(0));
    if (formulas_.transmit) formulas_.transmit(&m_, &wo, &out);
    return out;
  }
  Color transmittance(const Pack& distance) const override {
    Color out(Pack(1));
    if (formulas_.transmittance) formulas_.transmittance(&m_, &distance, &out);
    return out;
  }
  Pack ior() const override {
    if constexpr (HasTransmit<M<double>> || HasThrough<M<double>>)
      return m_.ior();
    else
      return Pack(1);
  }
  std::array<Pack, 3> channel_iors() const override {
    if constexpr (HasDispersion<M<double>>)
      return m_.channel_iors();
    else
      return {ior(), ior(), ior()};
  }
  void assign(const std::string& name, const std::array<Pack, 3>& value) override {
    m_.parameters(AssignVisitor<Pack, Pack>{name, value});
  }

 private:
  M<Pack> m_;
  const PackedFormulas& formulas_;
};

template <template <class> class M> class ModelOf final : public Model {
 public:
  /// `formulas`: for a further instruction set, if the model is compiled for any.
  explicit ModelOf(const PackedFormulas* formulas = &kPackedFormulas<M>)
      : info_(M<double>::info()), packed_formulas_(*formulas) {
    M<double> prototype;
    prototype.parameters(SchemaVisitor{info_.params});
  }
  const ModelInfo& info() const override { return info_; }
  std::optional<std::string> misbound() const override {
    // Of floats, whose members leave no bytes unused between them.
    M<float> prototype{};
    std::vector<BoundMember> members;
    prototype.parameters(PlaceVisitor{&prototype, members});
    return detail::misbound(std::move(members), std::is_empty_v<M<float>> ? 0 : sizeof(M<float>));
  }
  bool has_scatter() const override { return HasScatter<M<double>>; }
  bool has_mirror() const override { return HasMirror<M<double>>; }
  bool has_exact() const override { return HasExact<M<double>> || !has_scatter(); }
  bool has_base() const override { return HasBase<M<double>>; }
  bool has_transmit() const override { return HasTransmit<M<double>>; }
  bool has_medium() const override { return HasMedium<M<double>>; }
  bool has_through() const override { return HasThrough<M<double>>; }
  std::unique_ptr<Brdf<double>> make_double(const ParamValues& v) const override { return make<double>(v); }
  std::unique_ptr<Brdf<float>> make_float(const ParamValues& v) const override { return make<float>(v); }
  std::unique_ptr<Brdf<Wide>> make_wide(const ParamValues& v) const override { return make<Wide>(v); }
  std::unique_ptr<PackedBrdf> make_packed(const ParamValues& v) const override {
    return std::make_unique<PackedOf<M>>(bind<Pack>(v), packed_formulas_);
  }
  std::unique_ptr<Brdf<Expr>> record(const ParamValues& fixed) const override {
    const ParamValues values = complete(info_, fixed);
    M<Expr> m;
    m.parameters(RecordVisitor{values, fixed});
    return std::make_unique<BrdfOf<M, Expr>>(std::move(m));
  }

 private:
  template <class T> M<T> bind(const ParamValues& v) const {
    const ParamValues values = complete(info_, v);
    M<T> m;
    m.parameters(BindVisitor<T>{values});
    return m;
  }
  template <class T> std::unique_ptr<Brdf<T>> make(const ParamValues& v) const {
    return std::make_unique<BrdfOf<M, T>>(bind<T>(v));
  }
  ModelInfo info_;
  const PackedFormulas& packed_formulas_;
};

}  // namespace detail

/// Registers the class template M at start-up. The models are linked as objects, so the linker keeps this. It sees the
/// variable as well: of two models with one class name it would else keep one class for both, without a word.
#if !BRDFC_BASELINE
#define BRDFC_MODEL(M)                                                                           \
  namespace packed::BRDFC_INSTRUCTION_SET {                                                      \
  extern constinit const PackedFormulas M = ::brdfc::model::detail::kPackedFormulas<::brdfc::M>; \
  }
#elif BRDFC_FURTHER_INSTRUCTION_SETS
#define BRDFC_MODEL(M)                                                                                 \
  namespace packed::x86_64_v3 {                                                                        \
  extern const PackedFormulas M;                                                                       \
  }                                                                                                    \
  namespace packed::x86_64_v4 {                                                                        \
  extern const PackedFormulas M;                                                                       \
  }                                                                                                    \
  bool only_one_model_has_the_class_##M = ::brdfc::register_model(                                     \
      std::make_unique<::brdfc::model::detail::ModelOf<M>>(::brdfc::fastest(                           \
          &::brdfc::model::detail::kPackedFormulas<M>, &packed::x86_64_v3::M, &packed::x86_64_v4::M)), \
      __FILE_NAME__);
#else
#define BRDFC_MODEL(M)                    \
  bool only_one_model_has_the_class_##M = \
      ::brdfc::register_model(std::make_unique<::brdfc::model::detail::ModelOf<M>>(), __FILE_NAME__);
#endif

}  // namespace brdfc::inline model
