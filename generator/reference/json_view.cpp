// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/json_view.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include "core/nearest.h"
#include "core/text.h"

namespace brdfc::reference {

namespace {

constexpr int kMaxDepth = 32;
constexpr std::size_t kMaxBytes = std::size_t(64) << 20;

/// nlohmann's messages start with "[json.exception.parse_error.101] ". Only the rest is shown, without what it quotes
/// from a file that is not text.
std::string plain_message(const std::string& what) {
  const auto end = what.find("] ");
  std::string text = end == std::string::npos ? what : what.substr(end + 2);
  for (char& c : text)
    if (c < ' ' || c > '~') c = ' ';
  return text;
}

/// A key as a file writes it, on one line, without the surrounding quotes.
std::string shown(const std::string& key) {
  const std::string quoted = nlohmann::json(key).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return quoted.substr(1, quoted.size() - 2);
}

}  // namespace

nlohmann::json read_json(const std::filesystem::path& path) {
  const std::string name = path.string();
  if (!std::filesystem::exists(path)) input_error("{}: no such file", name);
  if (!std::filesystem::is_regular_file(path)) input_error("{}: not a file", name);
  if (std::filesystem::file_size(path) > kMaxBytes) input_error("{}: expected a JSON file of at most 64 MiB", name);
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  if (!in) input_error("{}: can't read this file", name);
  return parse_json(text.str(), name);
}

nlohmann::json parse_json(std::string_view text, const std::string& name) {
  // nlohmann takes a byte 0 for the end of the text.
  if (std::ranges::any_of(text, [](char c) { return c >= 0 && c < ' ' && c != '\t' && c != '\n' && c != '\r'; }))
    input_error("{}: expected JSON, found bytes that are no text", name);
  std::vector<std::set<std::string>> keys;
  const nlohmann::json::parser_callback_t check = [&](int depth, nlohmann::json::parse_event_t event,
                                                      nlohmann::json& value) {
    using Event = nlohmann::json::parse_event_t;
    if (depth >= kMaxDepth) input_error("{}: nested deeper than {} levels", name, kMaxDepth);
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(value.get<std::string>()).second)
      input_error("{}: key \"{}\" is given twice in one object", name, shown(value.get<std::string>()));
    return true;
  };
  try {
    return nlohmann::json::parse(text, check);
  } catch (const nlohmann::json::exception& e) {
    input_error("{}: not valid JSON: {}", name, plain_message(e.what()));
  }
}

void JsonView::error(const std::string& message) const {
  throw InputError(file_ + ": " + (key_.empty() ? "" : shown(key_) + ": ") + message);
}

std::string JsonView::found() const {
  const std::string found = value_->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return found.size() > 60 ? found.substr(0, 57) + "..." : found;
}

void JsonView::fail(const std::string& expected) const { error("expected " + expected + ", found " + found()); }

JsonView JsonView::child(const nlohmann::json& value, const std::string& key) const {
  return JsonView(value, file_, key_.empty() ? key : key_ + "." + key);
}

void JsonView::only(const std::vector<std::string>& keys) const {
  if (!value_->is_object()) fail("an object");
  for (const auto& [name, value] : value_->items())
    if (std::find(keys.begin(), keys.end(), name) == keys.end())
      child(value, name).error(fmt::format("unknown key, expected one of {}", join(keys, ", ")));
}

JsonView JsonView::at(const std::string& key) const {
  if (!value_->is_object()) fail("an object");
  if (!value_->contains(key)) error("missing key \"" + key + "\"");
  return child((*value_)[key], key);
}

std::optional<JsonView> JsonView::find(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  return child((*value_)[key], key);
}

std::vector<JsonView> JsonView::elements() const {
  if (!value_->is_array()) fail("a list");
  std::vector<JsonView> out;
  for (std::size_t i = 0; i < value_->size(); ++i)
    out.emplace_back((*value_)[i], file_, key_ + "[" + std::to_string(i) + "]");
  return out;
}

std::vector<std::pair<std::string, JsonView>> JsonView::members() const {
  if (!value_->is_object()) fail("an object");
  std::vector<std::pair<std::string, JsonView>> out;
  for (const auto& [name, value] : value_->items()) out.emplace_back(name, child(value, name));
  return out;
}

double JsonView::number(double min, double max) const {
  const auto expected = [&] { return fmt::format("a number in [{:g}, {:g}]", min, max); };
  if (!value_->is_number()) fail(expected());
  const double x = value_->get<double>();
  if (!(x >= min && x <= max)) fail(expected());
  return x;
}

int JsonView::integer(int min, int max) const {
  const auto expected = [&] { return fmt::format("a whole number in [{}, {}]", min, max); };
  if (!value_->is_number()) fail(expected());
  const double x = value_->get<double>();
  if (!(x >= min && x <= max) || x != std::floor(x)) fail(expected());
  return int(x);
}

bool JsonView::boolean() const {
  if (!value_->is_boolean()) fail("true or false");
  return value_->get<bool>();
}

std::string JsonView::text() const {
  if (!value_->is_string() || value_->get_ref<const std::string&>().empty()) fail("a text");
  return value_->get<std::string>();
}

std::string JsonView::choice(const std::vector<std::string>& choices) const {
  const auto expected = [&] { return fmt::format("one of {}", join(choices, ", ")); };
  if (!value_->is_string()) fail(expected());
  const std::string s = value_->get<std::string>();
  if (std::find(choices.begin(), choices.end(), s) == choices.end())
    error(fmt::format("{}expected {}, found {}", did_you_mean(s, choices), expected(), found()));
  return s;
}

}  // namespace brdfc::reference
