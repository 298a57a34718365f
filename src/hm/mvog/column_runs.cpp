#include "hm/mvog/column_runs.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace hm::mvog {
namespace {

constexpr int kEnd = std::numeric_limits<int>::max();

/// Bits where a plane changes its value.
std::uint64_t edges(std::uint64_t plane) { return plane ^ plane << 1; }

}  // namespace

inline void ColumnUpdater::unpack(ColumnUnits old) {
  if (old_.size() < old.size() + 3) old_.resize(2 * old.size() + 8);
  Run* to = old_.data();
  *to++ = {kEnd, kUnknownCode};
  if (!old.empty()) {
    int level = base_level(old[0]);
    for (const std::uint16_t unit : old.subspan(1)) {
      *to++ = {level, run_code(unit)};
      level += run_length(unit);
    }
    *to++ = {level, kUnknownCode};
  }
  *to = {kEnd, kUnknownCode};
}

/// Merges the old runs with the observations, split at the boundaries of either. Returns true if anything has
/// changed. Avoids data-dependent branches, which would be unpredictable.
inline bool ColumnUpdater::overlay(std::span<const ObservationWord> scan_words,
                                   const CodeTables::Steps& steps) {
  const Run* next = old_.data() + 1;
  Run* to = runs_.data();
  RunCode last = kUnknownCode;
  int changes = 0;
  const auto put = [&](int level, RunCode code) {
    *to = {level, code};
    to += code != last;
    last = code;
  };
  for (std::size_t i = 0; i < scan_words.size(); ++i) {
    const ObservationWord& word = scan_words[i];
    const int base = static_cast<int>(word.base);
    for (; next->start < base; ++next) put(next->start, next->code);
    std::uint64_t begins = 0;
    const Run* old = next - 1;
    for (; next->start < base + 64; ++next)
      begins |= std::uint64_t{1} << static_cast<unsigned>(next->start - base);
    // Rank of the strongest observation, in three bit planes.
    const std::uint64_t miss = word.miss & ~word.hit, beside = word.beside & ~(word.hit | miss);
    const std::uint64_t rank_4 = word.hit, rank_2 = miss | beside,
                        rank_1 = miss | (word.brush & ~(word.hit | beside));
    std::uint64_t walls = begins | edges(rank_4) | edges(rank_2) | edges(rank_1);
    if (i > 0 && scan_words[i - 1].base + 64 == word.base) walls |= 1u;
    for (; walls != 0; walls &= walls - 1) {
      const int bit = std::countr_zero(walls);
      const auto in = [&](std::uint64_t plane) { return static_cast<unsigned>(plane >> bit) & 1u; };
      old += in(begins);
      const RunCode code = steps[in(rank_4) << 2 | in(rank_2) << 1 | in(rank_1)][old->code];
      changes |= code ^ old->code;
      put(base + bit, code);
    }
    // No observations from here on, unless the next word follows immediately.
    if (i + 1 == scan_words.size() || scan_words[i + 1].base != word.base + 64) {
      if (next->start > base + 64) put(base + 64, old->code);
    }
  }
  for (; next->start != kEnd; ++next) put(next->start, next->code);
  count_ = static_cast<std::size_t>(to - runs_.data()) - 1;
  return changes != 0;
}

/// True for an unknown gap of one level between free levels.
bool ColumnUpdater::is_sliver(std::size_t i) const {
  return runs_[i].code == kUnknownCode && runs_[i + 1].start - runs_[i].start == 1 &&
         tables_.state(runs_[i - 1].code) == Occupancy::kFree &&
         tables_.state(runs_[i + 1].code) == Occupancy::kFree;
}

/// Fills slivers, merges similar neighbours and packs the result.
inline std::size_t ColumnUpdater::pack(std::uint16_t* out) const {
  const std::uint16_t* const first = out;
  Run last = runs_[0];
  *out++ = static_cast<std::uint16_t>(last.start);
  const auto write = [&](int end) {
    int left = end - last.start;
    for (; left > 255; left -= 255) *out++ = static_cast<std::uint16_t>(last.code << 8 | 255);
    *out++ = static_cast<std::uint16_t>(last.code << 8 | left);
  };
  for (std::size_t i = 1; i < count_; ++i) {
    Run run = runs_[i];
    if (run.code == kUnknownCode && fill_slivers_ && is_sliver(i)) run.code = kNearFreeCode;
    if (tables_.similar(last.code, run.code)) {
      last.code = tables_.merged(last.code, run.start - last.start, run.code, runs_[i + 1].start - run.start);
      continue;
    }
    write(run.start);
    last = run;
  }
  write(runs_[count_].start);
  return static_cast<std::size_t>(out - first);
}

std::size_t ColumnUpdater::update(ColumnUnits old, std::span<const ObservationWord> scan_words,
                                  bool same_view, std::uint16_t* out) {
  const std::size_t most = old.size() + 66 * scan_words.size() + 4;
  if (runs_.size() < most) runs_.resize(2 * most);
  unpack(old);
  return overlay(scan_words, tables_.steps(same_view)) ? pack(out) : 0;
}

}  // namespace hm::mvog
