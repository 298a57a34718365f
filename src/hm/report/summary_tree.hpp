#pragma once
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/statistics.hpp"

namespace hm {

/// Description of one value of a summary. The key ends with the unit of the value (_m, _ms, _ratio ...),
/// `format` contains the unit of the printed number. An integer with the format "{}" is a count: 1,234,567.
/// Integers that are not counts (a frame number, a width in pixels) use "{:d}".
struct SummaryDoc {
  std::string_view key;
  std::string_view label = {};     ///< row or column label in a table; empty: not in a table
  std::string_view format = "{}";  ///< fmt format with unit: "{:.1f} mm"
  double scale = 1;                ///< factor from the value to the printed number
};

/// Values of a summary, described once for JSON, console and report, as ParamList does for parameters.
///
/// A summary has one function visit() that lists its values, and sentences refer to them by key:
///
///     void visit(const MapFacts& map, SummaryTree& v) {
///       v({"volumes", "blocks of 8^3 voxels"}, map.volumes);
///       v({"map_bytes", "memory", "{:.1f} MB", 1e-6}, map.bytes);
///       v.spread({"mesh_ms", "meshing", "{:.2f} ms"}, map.mesh_ms, {"median", "p99"});
///       v.group("loops", map.loops);  // visit(map.loops) below the key "loops"
///     }
///     const SummaryTree tree = describe(map);
///     tree.json();
///     tree.sentence("{volumes|block}, {map_bytes}[; {loops.accepted|loop}]");  // "1 block, 4.1 kB; 2 loops"
class SummaryTree {
 public:
  using Quantities = std::initializer_list<std::string_view>;

  void operator()(const SummaryDoc& doc, double value) { add_number(doc, value, value); }
  void operator()(const SummaryDoc& doc, int value) { (*this)(doc, std::int64_t{value}); }
  void operator()(const SummaryDoc& doc, std::int64_t value);
  void operator()(const SummaryDoc& doc, std::uint64_t value) {
    (*this)(doc, static_cast<std::int64_t>(value));
  }
  void operator()(const SummaryDoc& doc, bool value) { add(doc, value, value ? "yes" : "no"); }
  void operator()(const SummaryDoc& doc, std::string_view value);
  void operator()(const SummaryDoc& doc, const char* value) { (*this)(doc, std::string_view(value)); }
  /// Without a value the key is omitted from the JSON, as are sentences that refer to it.
  template <class T>
  void operator()(const SummaryDoc& doc, const std::optional<T>& value) {
    if (value)
      (*this)(doc, *value);
    else
      add_absent(doc);
  }
  /// The same, but without a value the key is null in the JSON.
  template <class T>
  void or_null(const SummaryDoc& doc, const std::optional<T>& value) {
    json(doc.key, {});
    (*this)(doc, value);
  }
  /// Adds statistics of a set of numbers as an object: "median", "mean", "rmse", "p95", "p99", "min", "max".
  /// The label becomes "label, median" ...
  void spread(const SummaryDoc& doc, const Summary& values,
              Quantities names = {"median", "p99", "mean", "max"}) {
    object(doc.key, [&](SummaryTree& below) { below.quantities(doc, values, names); });
  }
  /// Adds the same statistics directly among the other values; the key is not used.
  void quantities(const SummaryDoc& doc, const Summary& values, Quantities names);
  /// Adds a value to the JSON only.
  void json(std::string_view key, JsonValue value);
  /// Adds text for sentences and tables only, not to the JSON.
  void shown(std::string_view key, std::string_view label, std::string text);
  /// The same of a count.
  void shown(std::string_view key, std::string_view label, std::integral auto count) {
    shown_count(key, label, static_cast<std::int64_t>(count));
  }

  /// Adds several values as an object: `describe(SummaryTree&)` lists them.
  template <class Describe>
  void object(std::string_view key, Describe&& describe) {
    SummaryTree below;
    describe(below);
    adopt(key, std::move(below));
  }
  /// Adds the values of a part as an object, using its visit().
  template <class Part>
  void group(std::string_view key, const Part& part) {
    SummaryTree below;
    visit(part, below);
    adopt(key, std::move(below));
  }
  /// The same for an optional part; without it the key is omitted.
  template <class Part>
  void group(std::string_view key, const std::optional<Part>& part) {
    if (part) group(key, *part);
  }
  template <class Part>
  void group_or_null(std::string_view key, const std::optional<Part>& part) {
    json(key, {});
    group(key, part);
  }
  /// Adds the values of a list of items as an array, and a table with one row each.
  template <class Range>
  void list(std::string_view key, const Range& items) {
    std::vector<SummaryTree> rows;
    for (const auto& item : items) visit(item, rows.emplace_back());
    adopt_list(key, std::move(rows));
  }

  /// The same for items without visit(): `describe(i, row)` lists the values of the i-th.
  template <class Describe>
  void list_of(std::string_view key, std::size_t count, Describe&& describe) {
    std::vector<SummaryTree> rows(count);
    for (std::size_t i = 0; i < count; ++i) describe(i, rows[i]);
    adopt_list(key, std::move(rows));
  }

  [[nodiscard]] const JsonValue& json() const { return json_; }
  /// Text with each {key} replaced by its formatted value; keys of a group: {loops.accepted}. A count with
  /// its noun is {key|noun}, or {key|vertex|vertices} for an irregular plural. A part in [brackets] that
  /// contains a key without value is omitted; elsewhere such a key makes the result empty.
  [[nodiscard]] std::optional<std::string> sentence(std::string_view text) const;
  /// Sentences that have all their values, one per line.
  [[nodiscard]] std::string lines(std::initializer_list<std::string_view> sentences) const;

  using Rows = std::vector<std::vector<std::string>>;
  /// Labels and values of a group, where both exist; the top level without a key.
  [[nodiscard]] Rows rows(std::string_view group = {}) const;
  struct Table {
    std::vector<std::string> header;
    Rows rows;
  };
  /// Table of a list: one column per label, "-" without a value.
  [[nodiscard]] Table table(std::string_view list) const;

 private:
  struct Entry {
    std::string key, label;
    std::optional<std::string> text;
    std::optional<std::int64_t> count = {};  ///< of a whole number
  };
  void add_number(const SummaryDoc& doc, double number, JsonValue value);
  void add(const SummaryDoc& doc, JsonValue value, std::string text);
  void add_absent(const SummaryDoc& doc);
  void shown_count(std::string_view key, std::string_view label, std::int64_t count);
  void adopt(std::string_view key, SummaryTree below);
  void adopt_list(std::string_view key, std::vector<SummaryTree> rows);
  [[nodiscard]] std::optional<std::string> value_of(std::string_view key_and_noun) const;
  [[nodiscard]] std::optional<std::string> replaced(std::string_view text) const;

  JsonValue json_ = JsonValue::object();
  std::vector<Entry> entries_;
  std::vector<std::pair<std::string, Table>> tables_;
};

/// Describes a summary using its visit().
template <class Described>
SummaryTree describe(const Described& summary) {
  SummaryTree tree;
  visit(summary, tree);
  return tree;
}

/// JSON of any type with a visit().
template <class Described>
requires requires(const Described& summary, SummaryTree& tree) { visit(summary, tree); }
JsonValue to_json(const Described& summary) { return describe(summary).json(); }

}  // namespace hm
