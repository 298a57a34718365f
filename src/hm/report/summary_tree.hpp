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

/// Description of one value of a summary. The key's end names the unit of the value (_m, _ms, _ratio ...),
/// `format` that of the printed number. A whole number with the format "{}" is a count: 1,234,567. One that
/// is a name (the number of a frame, a width in pixels) has "{:d}".
struct SummaryDoc {
  std::string_view key;
  std::string_view label = {};     ///< its row or column in a table; empty: none
  std::string_view format = "{}";  ///< of fmt, with the unit: "{:.1f} mm"
  double scale = 1;                ///< from the value to the printed number
};

/// The values of a summary, described once for JSON, console and report, as ParamList does for parameters.
///
/// A summary has one function that names its values, and its sentences refer to them by key:
///
///     void visit(const MapFacts& map, SummaryTree& v) {
///       v({"volumes", "blocks of 8^3 voxels"}, map.volumes);
///       v({"map_bytes", "memory", "{:.1f} MB", 1e-6}, map.bytes);
///       v.spread({"mesh_ms", "meshing", "{:.2f} ms"}, map.mesh_ms, {"median", "p99"});
///       v.group("loops", map.loops);  // visit(map.loops) below the key "loops"
///     }
///     const SummaryTree tree = describe(map);
///     tree.json();
///     tree.sentence("{volumes|block}, {map_bytes}[; {loops.accepted|loop}]");  // "1 block, 4.1 kB; 2,310
///     loops"
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
  /// Without a value the key is left out of the JSON, and sentences that refer to it are left out too.
  template <class T>
  void operator()(const SummaryDoc& doc, const std::optional<T>& value) {
    if (value)
      (*this)(doc, *value);
    else
      add_absent(doc);
  }
  /// The same, but without a value the key is null.
  template <class T>
  void or_null(const SummaryDoc& doc, const std::optional<T>& value) {
    json(doc.key, {});
    (*this)(doc, value);
  }
  /// The named quantities of a set of numbers, as an object: "median", "mean", "rmse", "p95", "p99", "min",
  /// "max". The label becomes "label, median" ...
  void spread(const SummaryDoc& doc, const Summary& values,
              Quantities names = {"median", "p99", "mean", "max"}) {
    object(doc.key, [&](SummaryTree& below) { below.quantities(doc, values, names); });
  }
  /// The same quantities among the other values; the key is not used.
  void quantities(const SummaryDoc& doc, const Summary& values, Quantities names);
  /// A value that no sentence and no table shows.
  void json(std::string_view key, JsonValue value);
  /// Text that is not in the JSON.
  void shown(std::string_view key, std::string_view label, std::string text);
  /// The same of a count.
  void shown(std::string_view key, std::string_view label, std::integral auto count) {
    shown_count(key, label, static_cast<std::int64_t>(count));
  }

  /// Values that stand together, as an object: `describe(SummaryTree&)` names them.
  template <class Describe>
  void object(std::string_view key, Describe&& describe) {
    SummaryTree below;
    describe(below);
    adopt(key, std::move(below));
  }
  /// The values of a part, as an object, by its visit().
  template <class Part>
  void group(std::string_view key, const Part& part) {
    SummaryTree below;
    visit(part, below);
    adopt(key, std::move(below));
  }
  /// The same of a part that may be missing: the key is left out then.
  template <class Part>
  void group(std::string_view key, const std::optional<Part>& part) {
    if (part) group(key, *part);
  }
  template <class Part>
  void group_or_null(std::string_view key, const std::optional<Part>& part) {
    json(key, {});
    group(key, part);
  }
  /// The values of equal items, as an array; a table with a row each.
  template <class Range>
  void list(std::string_view key, const Range& items) {
    std::vector<SummaryTree> rows;
    for (const auto& item : items) visit(item, rows.emplace_back());
    adopt_list(key, std::move(rows));
  }

  /// The same of items that have no visit(): `describe(i, row)` names the values of the i-th.
  template <class Describe>
  void list_of(std::string_view key, std::size_t count, Describe&& describe) {
    std::vector<SummaryTree> rows(count);
    for (std::size_t i = 0; i < count; ++i) describe(i, rows[i]);
    adopt_list(key, std::move(rows));
  }

  [[nodiscard]] const JsonValue& json() const { return json_; }
  /// The text with each {key} replaced by its value as `format` has it; keys of a group: {loops.accepted}. A
  /// count with its noun is {key|noun}, with a plural that is not made with an s {key|vertex|vertices}. A
  /// part in [brackets] with a key that has no value is left out; elsewhere such a key leaves nothing.
  [[nodiscard]] std::optional<std::string> sentence(std::string_view text) const;
  /// The sentences that have all of their values, a line each.
  [[nodiscard]] std::string lines(std::initializer_list<std::string_view> sentences) const;

  using Rows = std::vector<std::vector<std::string>>;
  /// Label and value of everything in a group that has both; the top without a key.
  [[nodiscard]] Rows rows(std::string_view group = {}) const;
  struct Table {
    std::vector<std::string> header;
    Rows rows;
  };
  /// The table of a list: a column for each label, "-" where there is no value.
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

/// The description of a summary by its visit().
template <class Described>
SummaryTree describe(const Described& summary) {
  SummaryTree tree;
  visit(summary, tree);
  return tree;
}

/// The JSON of whatever has a visit().
template <class Described>
requires requires(const Described& summary, SummaryTree& tree) { visit(summary, tree); }
JsonValue to_json(const Described& summary) { return describe(summary).json(); }

}  // namespace hm
