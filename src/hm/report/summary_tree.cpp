#include "hm/report/summary_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "hm/core/check.hpp"
#include "hm/core/text/counted.hpp"

namespace hm {
namespace {

struct Quantity {
  std::string_view name;
  double Summary::*member;
};
constexpr std::array<Quantity, 7> kQuantities{{{"median", &Summary::median},
                                               {"mean", &Summary::mean},
                                               {"rmse", &Summary::rmse},
                                               {"p95", &Summary::p95},
                                               {"p99", &Summary::p99},
                                               {"min", &Summary::min},
                                               {"max", &Summary::max}}};

double quantity_of(const Summary& values, std::string_view name) {
  for (const Quantity& quantity : kQuantities)
    if (quantity.name == name) return values.*quantity.member;
  HM_CHECK(false, "no quantity is called {}", name);
  return 0;
}

}  // namespace

void SummaryTree::add(const SummaryDoc& doc, JsonValue value, std::string text) {
  json_[doc.key] = std::move(value);
  entries_.push_back({std::string(doc.key), std::string(doc.label), std::move(text)});
}

void SummaryTree::add_absent(const SummaryDoc& doc) {
  entries_.push_back({std::string(doc.key), std::string(doc.label), std::nullopt});
}

void SummaryTree::add_number(const SummaryDoc& doc, double number, JsonValue value) {
  add(doc, std::move(value), fmt::format(fmt::runtime(doc.format), doc.scale * number));
}

void SummaryTree::operator()(const SummaryDoc& doc, std::int64_t value) {
  if (doc.scale != 1) return add_number(doc, static_cast<double>(value), value);
  add(doc, value, doc.format == "{}" ? with_thousands(value) : fmt::format(fmt::runtime(doc.format), value));
  entries_.back().count = value;
}

void SummaryTree::operator()(const SummaryDoc& doc, std::string_view value) {
  add(doc, value, fmt::format(fmt::runtime(doc.format), value));
}

void SummaryTree::quantities(const SummaryDoc& doc, const Summary& values, Quantities names) {
  for (const std::string_view name : names) {
    const std::string label = doc.label.empty() ? std::string() : fmt::format("{}, {}", doc.label, name);
    (*this)({name, label, doc.format, doc.scale}, quantity_of(values, name));
  }
}

void SummaryTree::json(std::string_view key, JsonValue value) { json_[key] = std::move(value); }

void SummaryTree::shown(std::string_view key, std::string_view label, std::string text) {
  entries_.push_back({std::string(key), std::string(label), std::move(text)});
}

void SummaryTree::shown_count(std::string_view key, std::string_view label, std::int64_t count) {
  entries_.push_back({std::string(key), std::string(label), with_thousands(count), count});
}

void SummaryTree::adopt(std::string_view key, SummaryTree below) {
  json_[key] = std::move(below.json_);
  const std::string prefix = std::string(key) + ".";
  for (Entry& entry : below.entries_)
    entries_.push_back({prefix + entry.key, std::move(entry.label), std::move(entry.text), entry.count});
  for (auto& [name, table] : below.tables_) tables_.emplace_back(prefix + name, std::move(table));
}

void SummaryTree::adopt_list(std::string_view key, std::vector<SummaryTree> rows) {
  JsonValue array = JsonValue::array();
  Table table;
  for (SummaryTree& row : rows) {
    array.push_back(std::move(row.json_));
    std::vector<std::string> cells;
    for (const Entry& entry : row.entries_) {
      if (entry.label.empty()) continue;
      if (table.rows.empty()) table.header.push_back(entry.label);
      cells.push_back(entry.text.value_or("-"));
    }
    table.rows.push_back(std::move(cells));
  }
  json_[key] = std::move(array);
  tables_.emplace_back(key, std::move(table));
}

/// Value of "key", or count with noun of "key|noun" or "key|noun|plural".
std::optional<std::string> SummaryTree::value_of(std::string_view key_and_noun) const {
  const std::size_t bar = std::min(key_and_noun.find('|'), key_and_noun.size());
  const auto entry = std::ranges::find(entries_, key_and_noun.substr(0, bar), &Entry::key);
  if (entry == entries_.end() || !entry->text) return std::nullopt;
  if (bar == key_and_noun.size()) return entry->text;
  HM_CHECK(entry->count, "{} is not a count", key_and_noun);
  const std::string_view nouns = key_and_noun.substr(bar + 1);
  const std::size_t second = nouns.find('|');
  const std::string noun = second == std::string_view::npos
                               ? noun_for(*entry->count, nouns)
                               : noun_for(*entry->count, nouns.substr(0, second), nouns.substr(second + 1));
  return *entry->text + " " + noun;
}

/// A text without brackets; nothing where a value is missing.
std::optional<std::string> SummaryTree::replaced(std::string_view text) const {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t open = std::min(text.find('{', at), text.size());
    result += text.substr(at, open - at);
    if (open == text.size()) break;
    const std::size_t close = text.find('}', open);
    HM_CHECK(close != std::string_view::npos, "no }} in: {}", text);
    const auto value = value_of(text.substr(open + 1, close - open - 1));
    if (!value) return std::nullopt;
    result += *value;
    at = close + 1;
  }
  return result;
}

std::optional<std::string> SummaryTree::sentence(std::string_view text) const {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t open = std::min(text.find('[', at), text.size());
    const auto plain = replaced(text.substr(at, open - at));
    if (!plain) return std::nullopt;
    result += *plain;
    if (open == text.size()) break;
    const std::size_t close = text.find(']', open);
    HM_CHECK(close != std::string_view::npos, "no ] in: {}", text);
    result += replaced(text.substr(open + 1, close - open - 1)).value_or("");
    at = close + 1;
  }
  return result;
}

std::string SummaryTree::lines(std::initializer_list<std::string_view> sentences) const {
  std::string text;
  for (const std::string_view one : sentences)
    if (const auto line = sentence(one)) text += *line + "\n";
  return text;
}

SummaryTree::Rows SummaryTree::rows(std::string_view group) const {
  const std::string prefix = group.empty() ? std::string() : std::string(group) + ".";
  Rows rows;
  for (const Entry& entry : entries_)
    if (entry.key.starts_with(prefix) && !entry.label.empty() && entry.text)
      rows.push_back({entry.label, *entry.text});
  return rows;
}

SummaryTree::Table SummaryTree::table(std::string_view list) const {
  for (const auto& [name, table] : tables_)
    if (name == list) return table;
  return {};
}

}  // namespace hm
