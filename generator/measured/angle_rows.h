// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of text, a row for every combination of four angles, whatever their order: rows become a grid.
#pragma once

#include <map>
#include <optional>
#include <set>

#include "measured/grid_table.h"

namespace brdfc::measured {

/// Angles of unit vectors with six digits that differ by less, in steps, are the same.
inline constexpr long kRounding = 100;

/// Four angles in steps, in which angles are told apart: theta and phi of one direction, and of another.
using Angles = std::array<long, 4>;
long steps(double degrees);
double degrees(long steps);
/// Radians of a few digits in degrees: whole degrees stay whole.
double degrees_of_radians(double radians);
/// `theta` and `phi` in degrees as steps, phi in [0, 360).
std::array<long, 2> angles_of(double theta, double phi);
std::array<long, 2> angles_of(const Vec3<double>&);

struct AngleRow {
  Angles angles;
  std::array<float, 3> value;
  int line;
  bool wrapped = false;  ///< an azimuth is given as one below 0 or from 360 on
  bool vector = false;   ///< a direction along the normal has no azimuth: several may be given for it
};

class AngleRows {
 public:
  using Names = std::array<const char*, 4>;
  /// Names of angles, for messages. `poles`: where this theta, 0 or 2, is 0, the azimuth after it does not matter.
  AngleRows(std::string file, Names names, std::set<std::size_t> poles)
      : file_(std::move(file)), names_(names), poles_(std::move(poles)) {}
  void add(const AngleRow& row) { given_.push_back(row); }
  bool empty() const { return given_.empty(); }
  const std::vector<AngleRow>& given() const { return given_; }
  /// Gives angles that rounding made different the same steps.
  void remove_rounding();
  /// Ends with InputError if rows contradict each other, or there is none.
  void collect();
  /// The angles of an axis where they matter; after collect().
  const std::set<long>& axis(std::size_t k) const { return found_[k]; }
  /// The values of the whole grid, of which the last angle runs fastest. Where `may_lack` says so, rows may be left
  /// out, and values are NaN then; any other gap is an InputError.
  std::vector<std::array<float, 3>> values(bool (*may_lack)(const std::array<double, 4>& degrees) = nullptr) const;
  /// A sentence if rows of one place at a pole differ.
  std::optional<std::string> contradiction() const;
  const std::string& file() const { return file_; }

 private:
  /// Rows of one place. Only rows at a pole may be several, one an azimuth.
  struct Entry {
    std::array<double, 3> sum{}, least{}, most{};
    int count = 0;

    void add(const std::array<float, 3>& value);
    std::array<float, 3> mean() const;
    /// By which share of the mean the rows differ.
    double spread() const;
  };
  /// The same place with an azimuth of 0 where it does not matter.
  Angles without_poles(Angles) const;
  bool matters(const Angles&, std::size_t k) const;
  std::string say(const Angles&) const;

  std::string file_;
  Names names_;
  std::set<std::size_t> poles_;
  std::vector<AngleRow> given_;
  std::map<Angles, Entry> rows_;
  std::array<std::set<long>, 4> found_;
};

/// A BRDF over the angles of light and view, of which the first two are the light's, and what is assumed of it.
void read_grid_of_directions(const AngleRows&, Measurement&);
/// Whether the values of a grid with axes of these sizes change along one of them; NaN is
/// left out.
bool vary(const std::vector<std::array<float, 3>>& values, const std::array<std::size_t, 4>& sizes, std::size_t along);
/// Adds a sentence on what an axis of azimuths leaves out: a gap that is far wider than the others, and, where values
/// `vary` along the axis, gaps of more than a quarter of a circle. After `turn` degrees the first azimuth follows the
/// last one; 0: it does not.
void add_gaps(const char* name, const std::vector<double>& at, double turn, bool vary, std::vector<std::string>& notes);

}  // namespace brdfc::measured
