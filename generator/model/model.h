// SPDX-License-Identifier: GPL-3.0-or-later
// The definition of a reflection model: a schema and formulas over a scalar type, registered under one name.
//
// Conventions. Directions are unit vectors that point away from the surface, in a local frame whose z axis is the
// normal: wi points to the light, wo to the viewer. eval() is the BRDF in 1/sr, without the cosine and without delta
// terms. pdf() is the pdf of sample() per solid angle at wi, for the same wo, without delta terms. mirror() is the
// weight of the delta term in the direction of ideal reflection. The albedo is the integral of f cos(theta_i) over wi,
// plus the mirror weight. Colours are linear scene-referred RGB.
//
// A model defines all of eval(), pdf() and sample(), or none of them. With none it has only delta terms: f and pdf are
// 0, and every sample is lost.
//
// Transmission. A transmissive model separates two media, and z is the normal that points out of the object: a
// direction with z < 0 is inside. wo may be on either side. mirror(wo) reflects on wo's side. transmit(wo) is the
// weight of the delta term in the direction of ideal refraction; for a dispersive model each channel has its own
// direction (channel_iors()). ior() is the index inside divided by the one outside. If scatters_through() is true, f,
// pdf and samples are also defined for wi on either side, cosines are absolute values, and the albedo is an integral
// over the sphere. Weights and f count energy: a lossless boundary has albedo 1 from both sides, and f is reciprocal up
// to the squared index, f(wi, wo) n(wo)^2 = f(wo, wi) n(wi)^2. Radiance is not scaled by the squared index, as in
// Cycles.
#pragma once

#include <array>
#include <functional>
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

/// A sampled direction. pdf == 0 means that there is none (it would be below the horizon); the weight is then 0.
template <class T> struct Sample {
  Vec3<T> wi;
  Rgb<T> weight;  ///< f cos(theta_i) / pdf
  T pdf;          ///< per solid angle
};

/// A model with its parameters bound.
template <class T> class Brdf {
 public:
  virtual ~Brdf() = default;
  /// The BRDF in 1/sr; 0 unless both directions are above the surface.
  virtual Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const = 0;
  /// The pdf of sample(), per solid angle.
  virtual T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const = 0;
  /// `u` has three random numbers in [0, 1): one for the choice of lobe, and two for the direction.
  virtual Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const = 0;
  /// The weight of ideal reflection; 0 for a model without a mirror term.
  virtual Rgb<T> mirror(const Vec3<T>& wo) const = 0;
  /// The weight of ideal refraction; 0 for a model without that term, and beyond the critical angle.
  virtual Rgb<T> transmit(const Vec3<T>& wo) const = 0;
  /// The refractive index inside divided by the one outside; 1 for a model without transmission.
  virtual T ior() const = 0;
  /// The same for ideal refraction of red, green and blue, which differ in a dispersive model.
  virtual std::array<T, 3> channel_iors() const = 0;
  /// The share of the light that remains after a distance inside.
  virtual Rgb<T> transmittance(const T& distance) const = 0;
  /// True if, with the choices bound, f connects directions on different sides.
  virtual bool scatters_through() const = 0;
  /// Closures whose sum equals the model; nullopt if no such sum is known. For delta terms alone it is always known.
  virtual std::optional<ClosureSum<T>> exact(const Vec3<T>& wo) const = 0;
  /// Closures that cover most of f cos(theta_i) for any parameters; empty if the model declares none. No error is
  /// claimed: the caller adds what they lack. Their weights are not negative, and none is a delta term.
  virtual ClosureSum<T> base(const Vec3<T>& wo) const = 0;
  /// Sets a number (from the first element) or a colour to a new value. The value is not checked. Other names are
  /// ignored.
  virtual void assign(const std::string& name, const std::array<double, 3>& value) = 0;
};

inline namespace BRDFC_INSTRUCTION_SET {

/// The BRDF and the pdf.
struct PackedEvaluation {
  Rgb<Pack> f;
  Pack pdf;
};

/// A model with its parameters bound that evaluates eight directions at once; its functions are those of Brdf.
class PackedBrdf {
 public:
  virtual ~PackedBrdf() = default;
  /// eval() and pdf() together, because they share much computation.
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

/// The formulas of a model over Pack, compiled for one instruction set. Arguments and results are passed as void
/// pointers, because each instruction set has its own type Pack; the layouts are the same. `model` is an M<Pack>. A
/// pointer is null if the model lacks the term.
struct PackedFormulas {
  void (*evaluate)(const void* model, const void* wi, const void* wo, void* evaluation);  ///< to a PackedEvaluation
  void (*sample)(const void* model, const void* wo, const void* u, void* sample);         ///< to a Sample<Pack>
  void (*mirror)(const void* model, const void* wo, void* weight);                        ///< to an Rgb<Pack>
  void (*transmit)(const void* model, const void* wo, void* weight);                      ///< to an Rgb<Pack>
  void (*transmittance)(const void* model, const void* distance, void* share);            ///< to an Rgb<Pack>
};
/// The formulas that are fastest on this machine's processor; null if it can run neither.
const PackedFormulas* fastest(const PackedFormulas* x86_64_v3, const PackedFormulas* x86_64_v4);
/// A model that evaluates eight directions one after the other, each with a model of its own that `make` returns.
std::unique_ptr<PackedBrdf> one_by_one(const std::function<std::unique_ptr<Brdf<double>>()>& make);

/// A registered model.
class Model {
 public:
  virtual ~Model() = default;
  virtual const ModelInfo& info() const = 0;
  /// Reason why the members that parameters() binds are wrong, as a clause; nullopt if each is bound exactly once.
  virtual std::optional<std::string> misbound() const { return std::nullopt; }
  /// False for a model with only delta terms.
  virtual bool has_scatter() const = 0;
  virtual bool has_mirror() const = 0;
  virtual bool has_exact() const = 0;
  /// The kinds of a base's closures, their orientation and their tangents must be the same for all choices that have a
  /// base.
  virtual bool has_base() const { return false; }
  virtual bool has_transmit() const { return false; }
  /// True if the inside absorbs light.
  virtual bool has_medium() const { return false; }
  /// True if f connects directions on different sides for some choice.
  virtual bool has_through() const { return false; }
  /// True if views from inside (wo.z < 0) are supported.
  bool two_sided() const { return has_transmit() || has_through(); }
  /// Throws InputError naming model, parameter and what was expected.
  virtual std::unique_ptr<Brdf<double>> make_double(const ParamValues&) const = 0;
  virtual std::unique_ptr<Brdf<float>> make_float(const ParamValues&) const = 0;
  virtual std::unique_ptr<Brdf<Wide>> make_wide(const ParamValues&) const = 0;
  virtual std::unique_ptr<PackedBrdf> make_packed(const ParamValues&) const = 0;
  /// Parameters in `fixed` become constants; other numbers and colours become inputs with their names. A choice that is
  /// not fixed has its default. A Recorder must be active.
  virtual std::unique_ptr<Brdf<Expr>> record(const ParamValues& fixed) const = 0;
};

/// The largest number of lobes in a material that adds models up: with more, renders take longer, and the errors of
/// fitted sums hardly fall. A fitted sum has at most the second number unless another one is asked for.
inline constexpr int kMostLobes = 12, kFittedLobes = 4;

/// Throws InputError naming the model if parameters() omits a member, which would be uninitialised.
void require_bound(const Model&);

/// All models by name, in alphabetical order. Throws InputError if one is declared wrongly (model/registry.h), as do
/// the two functions below.
const std::map<std::string, std::unique_ptr<Model>>& models();
/// Throws InputError that lists the known names.
const Model& find_model(const std::string& name);
/// The model with this name, or all models if the name is empty.
std::vector<const Model*> models_named(const std::string& name);

/// Called by BRDFC_MODEL before main(), so it does not throw, because nobody could catch that. models() reports errors.
bool register_model(std::unique_ptr<Model>, const char* file);

namespace detail {

/// `values` must be complete, so that every look-up succeeds.
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

/// Sets one number or colour.
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

/// Binds fixed parameters to constants and the others to inputs.
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

/// The range of bytes that a parameter's member takes in its model.
struct BoundMember {
  std::size_t first, end;
  std::string name;
};
/// Collects these ranges; `begin` is the address of the model.
struct PlaceVisitor {
  const void* begin;
  std::vector<BoundMember>& out;
  template <class Member, class Spec> void operator()(const Member& member, const Spec& s) const {
    const std::size_t first = std::size_t(reinterpret_cast<const char*>(&member) - static_cast<const char*>(begin));
    out.push_back({first, first + sizeof(Member), s.name});
  }
};
/// The result of Model::misbound() for a model of `size` bytes; 0 for one without members.
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
/// The channels have different indices if disperses() is true.
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
      // One closure per channel if the channels differ; otherwise one for all, which takes the place of green.
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
  /// `formulas` are null if the model is compiled for further instruction sets, and the processor has none of them.
  explicit ModelOf(const PackedFormulas* formulas = &kPackedFormulas<M>)
      : info_(M<double>::info()), packed_formulas_(formulas) {
    M<double> prototype;
    prototype.parameters(SchemaVisitor{info_.params});
  }
  const ModelInfo& info() const override { return info_; }
  std::optional<std::string> misbound() const override {
    // Tested with floats, whose members have no padding between them.
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
    if (packed_formulas_ == nullptr) return one_by_one([&] { return make_double(v); });
    return std::make_unique<PackedOf<M>>(bind<Pack>(v), *packed_formulas_);
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
  const PackedFormulas* packed_formulas_;
};

}  // namespace detail

/// Registers the class template M at start-up. The models are linked as object files, so the linker keeps the variable.
/// The variable also makes the linker report two models with the same class name; otherwise it would silently use one
/// class for both.
#if !BRDFC_BASELINE
#define BRDFC_MODEL(M)                                                                           \
  namespace packed::BRDFC_INSTRUCTION_SET {                                                      \
  extern constinit const PackedFormulas M = ::brdfc::model::detail::kPackedFormulas<::brdfc::M>; \
  }
#elif BRDFC_FURTHER_INSTRUCTION_SETS
#define BRDFC_MODEL(M)                                                                             \
  namespace packed::x86_64_v3 {                                                                    \
  extern const PackedFormulas M;                                                                   \
  }                                                                                                \
  namespace packed::x86_64_v4 {                                                                    \
  extern const PackedFormulas M;                                                                   \
  }                                                                                                \
  bool only_one_model_has_the_class_##M =                                                          \
      ::brdfc::register_model(std::make_unique<::brdfc::model::detail::ModelOf<M>>(                \
                                  ::brdfc::fastest(&packed::x86_64_v3::M, &packed::x86_64_v4::M)), \
                              __FILE_NAME__);
#else
#define BRDFC_MODEL(M)                    \
  bool only_one_model_has_the_class_##M = \
      ::brdfc::register_model(std::make_unique<::brdfc::model::detail::ModelOf<M>>(), __FILE_NAME__);
#endif

}  // namespace brdfc::inline model
