#include "hm/mvog/column_runs.hpp"

#include <algorithm>
#include <limits>

namespace hm::mvog {
namespace {
constexpr int kEnd = std::numeric_limits<int>::max();
}

/// Both lists side by side, cut at the walls of either. Returns whether any place has changed.
bool ColumnUpdater::overlay(ColumnUnits old, std::span<const SayingStart> sayings, bool same_view) {
  const auto& steps = tables_.steps(same_view);
  std::size_t next_unit = 0, next_saying = 0;
  RunCode code = kUnknownCode;
  int code_end = old.empty() ? kEnd : base_level(old[0]);
  const CodeTables::Step* step = &steps[0];
  int saying_end = sayings.front().level;
  int level = start_ = std::min(code_end, saying_end);
  runs_.clear();
  bool changes = false;
  while (true) {
    if (code_end == level) {
      ++next_unit;
      const bool more = next_unit < old.size();
      code = more ? run_code(old[next_unit]) : kUnknownCode;
      code_end = more ? level + run_length(old[next_unit]) : kEnd;
    }
    if (saying_end == level) {
      step = &steps[static_cast<std::size_t>(sayings[next_saying].saying)];
      ++next_saying;
      saying_end = next_saying < sayings.size() ? sayings[next_saying].level : kEnd;
    }
    const int end = std::min(code_end, saying_end);
    if (end == kEnd) return changes;
    const RunCode now = (*step)[code];
    changes |= now != code;
    if (!runs_.empty() && runs_.back().code == now)
      runs_.back().end = end;
    else
      runs_.push_back({end, now});
    level = end;
  }
}

/// An unknown gap of one level between free places is free as far as beams of this density can tell.
bool ColumnUpdater::is_sliver(std::size_t i) const {
  return runs_[i].code == kUnknownCode && i > 0 && i + 1 < runs_.size() &&
         runs_[i].end - runs_[i - 1].end == 1 && tables_.state(runs_[i - 1].code) == Occupancy::kFree &&
         tables_.state(runs_[i + 1].code) == Occupancy::kFree;
}

/// Joins similar neighbours, slivers filled, and packs what comes out.
void ColumnUpdater::pack(std::vector<std::uint16_t>& out) const {
  out.push_back(static_cast<std::uint16_t>(start_));
  int begin = start_;
  Run last = runs_.front();
  const auto write = [&] {
    for (int left = last.end - begin; left > 0; left -= 255)
      out.push_back(static_cast<std::uint16_t>(last.code << 8 | std::min(left, 255)));
  };
  for (std::size_t i = 1; i < runs_.size(); ++i) {
    Run run = runs_[i];
    if (fill_slivers_ && is_sliver(i)) run.code = kNearFreeCode;
    if (tables_.similar(last.code, run.code)) {
      last = {run.end, tables_.merged(last.code, last.end - begin, run.code, run.end - last.end)};
      continue;
    }
    write();
    begin = last.end;
    last = run;
  }
  write();
}

bool ColumnUpdater::update(ColumnUnits old, std::span<const SayingStart> sayings, bool same_view,
                           std::vector<std::uint16_t>& out) {
  if (!overlay(old, sayings, same_view)) return false;
  pack(out);
  return true;
}

}  // namespace hm::mvog
