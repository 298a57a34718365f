#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "hm/mvog/run_code.hpp"

namespace hm::mvog {

/// Stored column of 16-bit units: empty when nothing is known, else the lowest known level (two's complement)
/// followed by its runs upwards: length in levels (1 to 255) in the low byte, RunCode in the high byte. A
/// level is half a cell high; level k is [k, k + 1) * resolution / 2. The first and the last run are known;
/// runs longer than 255 are continued by one of the same code.
using ColumnUnits = std::span<const std::uint16_t>;
inline constexpr int kMinLevel = -32768, kMaxLevel = 32767;

constexpr int base_level(std::uint16_t unit) { return static_cast<std::int16_t>(unit); }
constexpr int run_length(std::uint16_t unit) { return unit & 255; }
constexpr RunCode run_code(std::uint16_t unit) { return static_cast<RunCode>(unit >> 8); }

/// Code at a level.
inline RunCode code_at(ColumnUnits column, int level) {
  if (column.empty()) return kUnknownCode;
  int below = level - base_level(column[0]);
  if (below < 0) return kUnknownCode;
  for (std::size_t i = 1; i < column.size(); ++i) {
    below -= run_length(column[i]);
    if (below < 0) return run_code(column[i]);
  }
  return kUnknownCode;
}

/// Calls visit(first level, level after the last, code) for every run of a column, bottom to top, including
/// unknown gaps; runs longer than 255 are visited in parts.
template <class Visit>
void for_each_run(ColumnUnits column, Visit&& visit) {
  if (column.empty()) return;
  int level = base_level(column[0]);
  for (const std::uint16_t unit : column.subspan(1)) {
    visit(level, level + run_length(unit), run_code(unit));
    level += run_length(unit);
  }
}

/// Observations of 64 levels of one column by a scan, as bit planes; bit i is level base + i. If several
/// planes have a bit set, the first one counts.
struct ObservationWord {
  std::int64_t base = 0;
  std::uint64_t hit = 0, miss = 0, beside = 0, brush = 0;
};

/// Updates columns with scans. Reuses its working memory from call to call.
class ColumnUpdater {
 public:
  explicit ColumnUpdater(const MvogParams& params) : tables_(params), fill_slivers_(params.fill_slivers) {}

  [[nodiscard]] const CodeTables& tables() const { return tables_; }
  /// Upper bound of the number of units that update() writes.
  [[nodiscard]] static std::size_t max_units(ColumnUnits old, std::span<const ObservationWord> scan_words) {
    return old.size() + 66 * scan_words.size() + (kMaxLevel - kMinLevel) / 255 + 4;
  }
  /// Writes the updated column to `out`, which must have room for max_units(), and returns its length; 0 when
  /// the scan changes nothing. `scan_words` must be ascending and not overlap.
  std::size_t update(ColumnUnits old, std::span<const ObservationWord> scan_words, bool same_view,
                     std::uint16_t* out);
  [[nodiscard]] std::size_t bytes() const { return (old_.capacity() + runs_.capacity()) * sizeof(Run); }

 private:
  /// Run up to the start of the next one.
  struct Run {
    int start;
    RunCode code;
  };
  void unpack(ColumnUnits old);
  bool overlay(std::span<const ObservationWord> scan_words, const CodeTables::Steps& steps);
  [[nodiscard]] bool is_sliver(std::size_t i) const;
  std::size_t pack(std::uint16_t* out) const;

  CodeTables tables_;
  bool fill_slivers_;
  std::vector<Run> old_;   ///< from unknown space below to unknown space above, and kEnd
  std::vector<Run> runs_;  ///< after the scan; neighbours differ, the last one is unknown space above
  std::size_t count_ = 0;  ///< number of runs_ in use, without the last one
};

}  // namespace hm::mvog
