#include "hm/mvog/run_code.hpp"

#include <algorithm>
#include <cmath>

namespace hm::mvog {
namespace {

/// Mean and variance of the share of hits, after a uniform prior.
struct Belief {
  double mean, variance;
};
Belief belief_of(RunCode code) {
  const double a = hits_of(code) + 1, b = misses_of(code) + 1, n = a + b;
  return {a / n, a * b / (n * n * (n + 1))};
}

/// Adds one observation, at most `limit` in total: beyond it, it replaces a contradicting one.
RunCode observed(RunCode code, bool hit, int limit) {
  int hits = hits_of(code), misses = misses_of(code);
  int& own = hit ? hits : misses;
  int& other = hit ? misses : hits;
  if (hits + misses < limit) {
    ++own;
  } else if (other > 0) {
    --other;
    ++own;
  }
  return make_code(hits, misses);
}

}  // namespace

CodeTables::CodeTables(const MvogParams& params) {
  make_states(params.occupied_ratio);
  make_steps(params);
  make_similar(params.merge_sigmas);
}

void CodeTables::make_states(double occupied_ratio) {
  for (int code = 1; code < 256; ++code) {
    const auto c = static_cast<RunCode>(code);
    if (is_counter(c))
      state_[c] = hits_of(c) >= occupied_ratio * (hits_of(c) + misses_of(c)) - 1e-9 ? Occupancy::kOccupied
                                                                                    : Occupancy::kFree;
  }
  state_[kNearFreeCode] = Occupancy::kFree;
  state_[kNearOccupiedCode] = Occupancy::kOccupied;
}

void CodeTables::make_steps(const MvogParams& params) {
  for (const bool same_view : {false, true}) {
    for (int code = 0; code < 256; ++code) {
      const auto c = static_cast<RunCode>(code);
      const RunCode counters = is_counter(c) ? c : kUnknownCode;
      const int total = hits_of(counters) + misses_of(counters);
      const int limit = same_view ? std::min(params.evidence_cap, std::max(params.same_view_cap, total))
                                  : params.evidence_cap;
      Steps& steps = step_[same_view];
      steps[0][c] = c;
      steps[1][c] = c == kUnknownCode ? kNearFreeCode : c;
      steps[2][c] = counters == kUnknownCode ? kNearOccupiedCode : c;
      steps[3][c] = observed(counters, false, limit);
      steps[4][c] = observed(counters, true, limit);
    }
  }
}

void CodeTables::make_similar(double sigmas) {
  for (int a = 0; a < 256; ++a) {
    for (int b = 0; b < 256; ++b) {
      const auto ca = static_cast<RunCode>(a), cb = static_cast<RunCode>(b);
      bool similar = a == b;
      // Runs with both hits and misses are not merged: a mean would undo the latest observation.
      const bool agree = hits_of(ca) + hits_of(cb) == 0 || misses_of(ca) + misses_of(cb) == 0;
      if (a != b && a != 0 && b != 0 && is_counter(ca) && is_counter(cb) && agree) {
        const Belief p = belief_of(ca), q = belief_of(cb);
        similar = std::abs(p.mean - q.mean) < sigmas * std::sqrt(p.variance + q.variance);
      }
      if (similar) similar_[ca][cb >> 6] |= std::uint64_t{1} << (cb & 63);
    }
  }
}

RunCode CodeTables::merged(RunCode a, int length_a, RunCode b, int length_b) const {
  if (a == b) return a;
  // Similar runs have either no hits or no misses.
  const bool hit = hits_of(a) + hits_of(b) > 0;
  const int length = length_a + length_b, x = hit ? hits_of(a) : misses_of(a),
            y = hit ? hits_of(b) : misses_of(b);
  const int mean = (2 * (x * length_a + y * length_b) + length) / (2 * length);
  const int hits = hit ? mean : 0, misses = hit ? 0 : mean;
  const RunCode code = make_code(hits, misses);
  // Rounding may push the sum over the cap or the state over its threshold: the longer run's code is used
  // then.
  const bool good = hits + misses <= std::max(hits_of(a) + misses_of(a), hits_of(b) + misses_of(b)) &&
                    code != kUnknownCode && state_[code] == state_[a];
  return good ? code : length_a >= length_b ? a : b;
}

double CodeTables::probability(RunCode code) {
  if (code == kNearOccupiedCode) return 1;
  if (code == kNearFreeCode || code == kUnknownCode) return 0;
  return static_cast<double>(hits_of(code)) / (hits_of(code) + misses_of(code));
}

}  // namespace hm::mvog
