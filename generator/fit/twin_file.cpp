// SPDX-License-Identifier: GPL-3.0-or-later
// Reads and writes twins as EXR files.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/error.h"
#include "core/json_text.h"
#include "fit/roles.h"
#include "fit/settings.h"
#include "fit/twin.h"
#include "tables/table_file.h"

namespace brdfc::fit {
namespace {

using Json = nlohmann::ordered_json;

const std::vector<std::pair<ClosureKind, const char*>> kKinds = {
    {ClosureKind::Ggx, "ggx"}, {ClosureKind::Beckmann, "beckmann"}, {ClosureKind::Diffuse, "diffuse"}};

ClosureKind kind_of(const std::string& name) {
  for (const auto& [kind, known] : kKinds)
    if (name == known) return kind;
  throw std::out_of_range(name);
}

TablePtr errors_table(const std::vector<ViewError>& errors) {
  std::vector<double> numbers;
  for (ViewError e : errors)
    for (const double* x : numbers_of(e)) numbers.push_back(*x);
  const int count = int(errors.size()), each = int(numbers.size()) / count;
  return make_table("errors", {even_axis("place", count), even_axis("number", each)}, std::move(numbers));
}

}  // namespace

std::vector<TablePtr*> Twin::all() {
  std::vector<TablePtr*> out;
  for (TwinClosure& part : parts_) {
    // The tables of a mirror are computed again, which takes no time.
    if (part.kind == ClosureKind::Reflection) continue;
    if (part.lean) out.insert(out.end(), {&part.lean, &part.roughness, &part.spread});
    for (Channels& channels : part.weight)
      for (TablePtr& table : channels) out.push_back(&table);
  }
  for (Channels& channels : albedo_)
    for (TablePtr& table : channels) out.push_back(&table);
  return out;
}

void Twin::store(const Model& model, const ParamValues& given) const {
  replace_stored(stored_twin(model, given), [&](const std::filesystem::path& path) { write(model, given, path); });
}

void Twin::write(const Model& model, const ParamValues& given, const std::filesystem::path& path) const {
  const StoreKey key = stored_twin(model, given);
  Twin copy = *this;
  std::vector<const Table*> rows;
  Json names = Json::array(), kinds = Json::array();
  const auto add = [&](const Table& table) {
    rows.push_back(&table);
    names.push_back(table.name);
  };
  for (const TablePtr* table : copy.all()) add(**table);
  const TablePtr errors = errors_table(errors_);
  add(*errors);
  for (const TwinClosure& part : parts_)
    for (const auto& [kind, name] : kKinds)
      if (kind == part.kind) kinds.push_back(name);
  const Json meta = {{"model", model.info().name},
                     {"quantity", axis_ ? "nodes that come close to a model, over a number and the view"
                                        : "nodes that come close to a model, over the view"},
                     {"axis", axis_ ? Json(axis_->parameter) : Json()},
                     {"hash", key.hash()},
                     {"kinds", kinds},
                     {"terms", terms_.terms.size()},
                     {"channels", albedo_.front().size()},
                     {"errors", errors_.size()},
                     {"tint", tint_ ? Json{tint_->r, tint_->g, tint_->b} : Json()},
                     {"layout", "a row a table: row-major, first axis slowest, padded with zeros"},
                     {"tables", names}};
  TableImage image = image_of(rows);
  image.meta = json_text(meta);
  write_table_image(image, path);
}

void Twin::read(const std::string& hash, const std::filesystem::path& path) {
  const TableImage image = read_table_image(path);
  try {
    const auto meta = json_of_text(image.meta);
    if (meta.at("hash") != hash)
      input_error("{}: hash: expected {}, got {}", path.string(), hash, json_text(meta.at("hash")));
    const auto names = meta.at("tables").get<std::vector<std::string>>();
    const std::size_t terms = meta.at("terms"), channels = meta.at("channels");
    if (terms != terms_.terms.size()) input_error("{}: terms: expected {}", path.string(), terms_.terms.size());
    if (const auto& tint = meta.at("tint"); !tint.is_null()) tint_ = Rgb<double>{tint.at(0), tint.at(1), tint.at(2)};
    std::vector<TwinClosure> scattering_parts;
    for (const std::string kind : meta.at("kinds")) {
      TwinClosure part{kind_of(kind), {}, {}, {}, std::vector<Channels>(terms, Channels(channels))};
      if (has_facets(part.kind)) part.lean = part.roughness = part.spread = std::make_shared<Table>();
      scattering_parts.push_back(std::move(part));
    }
    parts_.insert(parts_.begin(), scattering_parts.begin(), scattering_parts.end());
    albedo_.assign(terms, Channels(channels));
    std::size_t row = 0;
    const auto next = [&](const std::vector<TableAxis>& over) {
      std::size_t count = 1;
      for (const TableAxis& axis : over) count *= std::size_t(axis.size());
      std::optional<std::vector<double>> values = values_in(image, row, count, 1);
      if (!values) input_error("{}: tables: {} has more numbers than there are", path.string(), names.at(row));
      return make_table(names.at(row++), over, std::move(*values));
    };
    for (TablePtr* table : all()) *table = next(axes());
    const std::size_t count = meta.at("errors");
    const TablePtr errors = next({even_axis("place", int(count)), even_axis("number", 6)});
    for (std::size_t i = 0; i < errors->values.size();) {
      ViewError e;
      for (double* x : numbers_of(e)) *x = errors->values.at(i++);
      errors_.push_back(e);
    }
  } catch (const nlohmann::json::exception& e) {
    input_error("{}: expected a stored twin: {}", path.string(), e.what());
  } catch (const std::out_of_range&) {
    input_error("{}: expected a stored twin, a table or a kind is missing", path.string());
  }
}

}  // namespace brdfc::fit
