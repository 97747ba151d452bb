// SPDX-License-Identifier: GPL-3.0-or-later
// The values of a table. Formulas whose tables take long to compute can be recorded, and asked for their axes, without
// computing them.
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace brdfc::inline tables {

/// Numbers that are given, or computed when they are first read. Copies share what is computed. Reading from several
/// threads is safe.
class TableValues {
 public:
  TableValues() = default;
  TableValues(std::vector<double> numbers) : numbers_(std::move(numbers)) {}  // NOLINT: a table is made of numbers
  TableValues(std::initializer_list<double> numbers) : numbers_(numbers) {}
  explicit TableValues(std::function<std::vector<double>()> compute)
      : later_(std::make_shared<Later>(std::move(compute))) {}

  const std::vector<double>& numbers() const {
    if (!later_) return numbers_;
    std::call_once(later_->once, [this] { later_->numbers = later_->compute(); });
    return later_->numbers;
  }
  operator const std::vector<double>&() const { return numbers(); }  // NOLINT: read like a vector

  double operator[](std::size_t i) const { return numbers()[i]; }
  double at(std::size_t i) const { return numbers().at(i); }
  std::size_t size() const { return numbers().size(); }
  std::vector<double>::const_iterator begin() const { return numbers().begin(); }
  std::vector<double>::const_iterator end() const { return numbers().end(); }
  bool operator==(const TableValues& other) const { return numbers() == other.numbers(); }

 private:
  struct Later {
    explicit Later(std::function<std::vector<double>()> c) : compute(std::move(c)) {}
    std::function<std::vector<double>()> compute;
    std::once_flag once;
    std::vector<double> numbers;
  };
  std::vector<double> numbers_;
  std::shared_ptr<Later> later_;
};

}  // namespace brdfc::inline tables
