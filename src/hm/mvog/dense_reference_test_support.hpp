#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/core/testing/drawn_vector.hpp"
#include "hm/mvog/multi_volume_grid.hpp"

namespace hm::test {

/// Scan that owns its points.
struct OwnedScan {
  Eigen::Vector3d origin;
  std::vector<Eigen::Vector3f> returns, no_returns;
  [[nodiscard]] BeamScan view() const { return {origin, returns, no_returns}; }
};

/// Random beams in all directions, some without return, some vertical, from a random origin around `centre`.
inline OwnedScan random_scan(Rng& rng, int beams, double reach_m, const Eigen::Vector3d& centre) {
  const auto around = [&](double r) {
    Eigen::Vector3d offset = drawn<3>([&] { return rng.uniform(-r, r); });
    offset.z() /= 2;
    return offset;
  };
  OwnedScan scan;
  scan.origin = centre + around(1);
  for (int i = 0; i < beams; ++i) {
    Eigen::Vector3d end = scan.origin + around(reach_m);
    if (i % 16 == 3) end.head<2>() = scan.origin.head<2>();
    if (i % 16 == 7) end.z() = scan.origin.z();
    (i % 8 == 5 ? scan.no_returns : scan.returns).push_back(end.cast<float>());
  }
  return scan;
}

/// Brute-force reference of the map: every half cell is stored separately, beams are clipped against each
/// column.
class DenseReference {
 public:
  using Key = std::array<int, 3>;
  explicit DenseReference(const MvogParams& params) : params_(params) {}

  void insert(const OwnedScan& scan) {
    const bool same_view = is_same_view(scan.origin);
    counts_glancing_ = ++scans_ % params_.glancing_period == 0;
    observations_.clear();
    for (const auto& p : scan.returns) add(scan.origin, p.cast<double>(), true);
    for (const auto& p : scan.no_returns) add(scan.origin, p.cast<double>(), false);
    for (const auto& [key, rank] : observations_) observe(cells_[key], rank, same_view);
    if (params_.fill_slivers) fill();
  }
  [[nodiscard]] const std::map<Key, Evidence>& cells() const { return cells_; }
  [[nodiscard]] Evidence at(const Key& key) const {
    const auto found = cells_.find(key);
    return found == cells_.end() ? Evidence{} : found->second;
  }
  [[nodiscard]] Occupancy state(const Evidence& e) const {
    if (e.hits + e.misses == 0) return e.assumed;
    return e.hits >= params_.occupied_ratio * (e.hits + e.misses) ? Occupancy::kOccupied : Occupancy::kFree;
  }
  [[nodiscard]] Eigen::Vector3d centre(const Key& key) const {
    return params_.resolution_m * Eigen::Vector3d(key[0] + 0.5, key[1] + 0.5, (key[2] + 0.5) / 2);
  }

 private:
  enum Rank { kBrushed = 1, kBeside = 2, kMissed = 3, kHit = 4 };

  bool is_same_view(const Eigen::Vector3d& origin) {
    auto found = std::ranges::find_if(views_, [&](const Eigen::Vector3d& v) {
      return (v - origin).norm() < params_.same_view_distance_cell * params_.resolution_m;
    });
    const bool known = found != views_.end();
    const Eigen::Vector3d view = known ? *found : origin;
    if (known) views_.erase(found);
    views_.insert(views_.begin(), view);
    if (views_.size() > 4) views_.pop_back();
    return known;
  }
  void record(const Key& key, int rank) { observations_[key] = std::max(observations_[key], rank); }

  void add(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, bool hit) {
    const Eigen::Vector3d scale = Eigen::Vector3d(1, 1, 2) / params_.resolution_m;
    const Eigen::Vector3d a = from_m.cwiseProduct(scale), b = to_m.cwiseProduct(scale), d = b - a;
    const auto cell = [](double v) { return static_cast<int>(std::floor(v)); };
    const int end_x = cell(b.x()), end_y = cell(b.y());
    const bool flat = std::abs(to_m.z() - from_m.z()) <= (to_m - from_m).head<2>().norm();
    for (int x = std::min(cell(a.x()), end_x); x <= std::max(cell(a.x()), end_x); ++x) {
      for (int y = std::min(cell(a.y()), end_y); y <= std::max(cell(a.y()), end_y); ++y) {
        double t0 = 0, t1 = 1;
        clip(a.x(), d.x(), x, t0, t1);
        clip(a.y(), d.y(), y, t0, t1);
        if (t0 > t1 || (hit && flat && x == end_x && y == end_y)) continue;
        const double low = std::min(a.z() + d.z() * t0, a.z() + d.z() * t1);
        const double high = std::max(a.z() + d.z() * t0, a.z() + d.z() * t1);
        const double out = a.z() + d.z() * t1;
        const bool crosses = std::floor(low + 0.5) != std::floor(high + 0.5);
        const bool glances =
            hit && std::abs(d.z()) >= 2 && !counts_glancing_ && std::abs(cell(out) - cell(b.z())) <= 2;
        for (int k = cell(low); k <= cell(high); ++k) {
          if (crosses ? k + 0.5 < low || k + 0.5 >= high : k != cell(out)) continue;
          record({x, y, k}, crosses || !glances ? kMissed : kBrushed);
        }
      }
    }
    if (!hit) return;
    for (const int k : {cell(b.z() + 0.5) - 1, cell(b.z() + 0.5)}) {
      for (const double dx : {-0.25, 0.0, 0.25})
        for (const double dy : {-0.25, 0.0, 0.25}) record({cell(b.x() + dx), cell(b.y() + dy), k}, kBeside);
      record({end_x, end_y, k}, kHit);
    }
  }
  static void clip(double a, double d, int cell, double& t0, double& t1) {
    if (d == 0) {
      if (a < cell || a >= cell + 1) t0 = 2;
      return;
    }
    const double u = (cell - a) / d, v = (cell + 1 - a) / d;
    t0 = std::max(t0, std::min(u, v));
    t1 = std::min(t1, std::max(u, v));
  }
  void observe(Evidence& e, int rank, bool same_view) const {
    const int total = e.hits + e.misses;
    if (rank < kMissed) {
      if (total > 0 || (rank == kBrushed && e.assumed != Occupancy::kUnknown)) return;
      e.assumed = rank == kBrushed ? Occupancy::kFree : Occupancy::kOccupied;
      return;
    }
    e.assumed = Occupancy::kUnknown;
    int& own = rank == kHit ? e.hits : e.misses;
    int& other = rank == kHit ? e.misses : e.hits;
    const int limit = same_view ? std::min(params_.evidence_cap, std::max(params_.same_view_cap, total))
                                : params_.evidence_cap;
    if (total < limit) {
      ++own;
    } else if (other > 0) {
      ++own;
      --other;
    }
  }
  void fill() {
    std::vector<Key> gaps;
    for (const auto& [key, evidence] : cells_) {
      const Key gap{key[0], key[1], key[2] + 1}, above{key[0], key[1], key[2] + 2};
      if (state(evidence) == Occupancy::kFree && !cells_.contains(gap) && cells_.contains(above) &&
          state(at(above)) == Occupancy::kFree)
        gaps.push_back(gap);
    }
    for (const Key& key : gaps) cells_[key].assumed = Occupancy::kFree;
  }

  MvogParams params_;
  std::map<Key, Evidence> cells_;
  std::map<Key, int> observations_;
  std::vector<Eigen::Vector3d> views_;
  int scans_ = 0;
  bool counts_glancing_ = false;
};

/// Parameters for which a grid keeps every cell's counters exactly.
inline MvogParams exact_params() {
  MvogParams params;
  params.merge_sigmas = 0;
  params.fill_slivers = false;
  return params;
}

}  // namespace hm::test
