// SPDX-License-Identifier: GPL-3.0-or-later
// Measured BRDFs: what a file holds, and its values for any pair of directions.
//
// Formats:
//   MERL .binary    W. Matusik, H. Pfister, M. Brand, L. McMillan: A Data-Driven Reflectance Model, SIGGRAPH 2003
//   RGL .bsdf       J. Dupuy, W. Jakob: An Adaptive Parameterization for Efficient Material Acquisition and Rendering,
//                   SIGGRAPH Asia 2018
//   UTIA .bin       J. Filip, R. Vavra: Template-Based Sampling of Anisotropic BRDFs, Pacific Graphics 2014
//   ALTA .alta .dat text of the BRDF library ALTA (measured/alta.h)
//   Radiance .xml   BSDFs of Radiance and WINDOW (measured/radiance.h)
//   CSV             a value for every combination of angles (measured/csv_grid.h)
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/vec.h"
#include "model/model.h"
#include "model/optical.h"

namespace brdfc::measured {

/// Importance sampling of a table.
class Sampler {
 public:
  virtual ~Sampler() = default;
  virtual double pdf(const Vec3<double>& wi, const Vec3<double>& wo) const = 0;
  /// A direction and its pdf; the weight is left at 0. `u` is as in Brdf::sample().
  virtual Sample<double> sample(const Vec3<double>& wo, const Vec3<double>& u) const = 0;
};

/// The values of a file. Directions and units are those of a model (model/model.h).
class Table {
 public:
  virtual ~Table() = default;
  /// The BRDF in 1/sr, in linear Rec.709; 0 unless both directions are above the surface. Finite and not negative.
  virtual Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const = 0;
  /// What the file's own tables tell of where light goes, if they do.
  virtual std::shared_ptr<const Sampler> sampler() const { return nullptr; }
};

struct Measurement {
  std::string file;
  std::string format;       ///< "MERL", "RGL", "UTIA", "ALTA", "Radiance" or "CSV"
  std::string description;  ///< text that the file has about itself, if any
  std::string grid;         ///< resolution, for people
  bool isotropic = true;    ///< unchanged when both directions are rotated about the normal
  double highest = 90;      ///< largest angle to the normal that was measured, in degrees
  double largest = 0;       ///< of the numbers that it was made of
  /// Pairs of directions in a table of rows; nullopt for formats of fixed resolution, which have many.
  std::optional<std::size_t> pairs = std::nullopt;
  std::vector<std::string> notes;  ///< a sentence for each thing that was assumed, left out or repaired
  std::shared_ptr<const Table> table;
};

/// Reads a file, whose name's extension says the format. Spectra are converted to X, Y and Z under D65, and by `to_rgb`
/// to linear Rec.709. Throws InputError that names the file, the field or line, and what was expected.
Measurement read_measurement(const std::filesystem::path&, const ToRgb& to_rgb);
/// Fewest pairs of directions to which something can be fitted: models have up to about a dozen parameters.
inline constexpr std::size_t kFewestPairs = 16;
/// Throws InputError if a measurement has fewer.
void require_enough_to_fit(const Measurement&);
/// The extensions that read_measurement() knows.
inline constexpr std::array<const char*, 7> kExtensions{".binary", ".bsdf", ".bin", ".alta", ".dat", ".xml", ".csv"};

/// "1 entry is" or "12 entries are"
std::string counted(std::size_t count, const std::string& one, const std::string& many);

/// The largest number of all channels, without NaN.
double largest(const std::vector<std::array<float, 3>>& values);

}  // namespace brdfc::measured
