#include "hm/slam/laser/search/correlative_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "hm/core/check.hpp"

namespace hm {
namespace {

/// Alternatives beyond the window turn by so much more at most: pieces of a curved wall that look alike turn
/// by less, each from the next, and a window of 1 rad three times as wide would take three times as long.
constexpr double kMostOtherTurn_rad = 0.3;
constexpr int kMaxSteps = 4096;  // limit of the half width in cells or angle steps

/// Square of 2^level x 2^level translations at one angle, with an upper bound of their sums.
struct Candidate {
  int angle = 0, x = 0, y = 0;
  std::uint32_t sum = 0;
};

bool better(const Candidate& a, const Candidate& b) {
  if (a.sum != b.sum) return a.sum > b.sum;
  if (a.angle != b.angle) return a.angle < b.angle;
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}

int steps_of(double half_width, double step) {
  const double steps = std::ceil(half_width / step - 1e-9);
  return std::isfinite(steps) ? static_cast<int>(std::clamp(steps, 0.0, double{kMaxSteps})) : kMaxSteps;
}

class Search {
 public:
  Search(const CorrelativeMap& map, std::span<const Vec2> points_m, const SearchWindow& window,
         const CorrelativeSearchParams& params)
      : map_(map), centre_(window.centre), params_(params), scan_(points_m), points_(points_m.size()) {
    double reach_m = map.resolution_m();
    for (const Vec2& point : points_m) reach_m = std::max(reach_m, point.norm());
    angle_step_ = params.angle_step_rad > 0 ? params.angle_step_rad : map.resolution_m() / reach_m;
    angles_ = steps_of(window.half_angle_rad, angle_step_);
    columns_ = steps_of(window.half_x_m, map.resolution_m());
    rows_ = steps_of(window.half_y_m, map.resolution_m());
    for (int angle = -angles_; angle <= angles_; ++angle) {
      const SE2 T = pose({angle, 0, 0, 0});
      for (const Vec2& point : points_m) cells_.push_back(map.cell_of(T * point));
    }
  }

  /// Mean likelihood of the points in the observed area; 0 if they are too few.
  [[nodiscard]] double seen_score(const Candidate& c) const {
    if (map_.seen() == nullptr) return score_of(c.sum);
    const SE2 T = pose(c);
    const auto inside =
        std::ranges::count_if(scan_, [&](const Vec2& p) { return map_.seen()->contains(T * p); });
    if (static_cast<double>(inside) < params_.min_overlap_ratio * static_cast<double>(points_)) return 0;
    return c.sum / (255.0 * static_cast<double>(inside));
  }
  /// Least sum with which an alternative pose can make this one ambiguous.
  [[nodiscard]] std::uint32_t least_beside(const Candidate& c) const {
    const double overlap = map_.seen() == nullptr ? 1.0 : params_.min_overlap_ratio;
    return sum_of(overlap * params_.ambiguity_ratio * std::max(seen_score(c), score_of(c.sum)));
  }
  /// Returns the best pose with at least `min_sum`; with `beside`, the first pose found that is a different
  /// place.
  std::optional<Candidate> run(std::uint32_t min_sum, const std::optional<Candidate>& beside) {
    set_beside(beside);
    least_ = min_sum;
    best_.reset();
    int level = 0;
    while (level + 1 < map_.levels() && (2 << level) <= 2 * std::max(columns_, rows_) + 1) ++level;
    const int two_sides = 2 << level;
    std::vector<Candidate> roots;
    for (int angle = -angles_; angle <= angles_ && !limit_reached(); ++angle)
      for (int y = -rows_; y <= rows_; y += two_sides)
        for (int x = -columns_; x <= columns_; x += two_sides) add_four(level, angle, x, y, roots);
    std::sort(roots.begin(), roots.end(), better);
    for (const Candidate& root : roots) descend(level, root);
    return best_;
  }

  [[nodiscard]] SE2 pose(const Candidate& c) const {
    return {centre_.x() + c.x * map_.resolution_m(), centre_.y() + c.y * map_.resolution_m(),
            centre_.angle() + c.angle * angle_step_};
  }
  [[nodiscard]] std::uint32_t sum_of(double score) const {
    return static_cast<std::uint32_t>(std::ceil(score * 255.0 * static_cast<double>(points_)));
  }
  [[nodiscard]] double score_of(std::uint32_t sum) const {
    return sum / (255.0 * static_cast<double>(points_));
  }
  [[nodiscard]] std::size_t evaluations() const { return evaluations_; }
  [[nodiscard]] bool limit_reached() const { return evaluations_ > params_.max_evaluations; }

 private:
  void set_beside(const std::optional<Candidate>& beside) {
    beside_ = beside;
    angle_is_near_beside_.clear();
    if (!beside) return;
    least_seen_score_ = params_.ambiguity_ratio * seen_score(*beside);
    for (int angle = -angles_; angle <= angles_; ++angle)
      angle_is_near_beside_.push_back(std::abs(wrap_angle((angle - beside->angle) * angle_step_)) <=
                                      params_.other_angle_rad);
  }

  /// Adds the four squares of a level at an angle whose lower corners are (x, y), (x + side, y), (x, y +
  /// side) and (x + side, y + side), in one pass over the points; not those outside the window, and those
  /// that cannot reach the least sum.
  template <class List>
  void add_four(int level, int angle, int x, int y, List& list) {
    const int side = 1 << level;
    std::array<std::uint32_t, 4> sums{};
    for (const Eigen::Vector2i& cell : cells_at(angle))
      map_.add_bounds(level, cell.x() + x, cell.y() + y, sums);
    for (const int i : {0, 1, 2, 3}) {
      Candidate square{angle, x + (i % 2) * side, y + (i / 2) * side, sums[static_cast<std::size_t>(i)]};
      if (square.x > columns_ || square.y > rows_ || limit_reached() || is_same_place(level, square))
        continue;
      ++evaluations_;
      square.sum -= std::min(square.sum, least_penalty(level, square));
      if (square.sum >= least_ && may_be_alternative(level, square)) list.push_back(square);
    }
  }

  [[nodiscard]] std::span<const Eigen::Vector2i> cells_at(int angle) const {
    return std::span(cells_).subspan(static_cast<std::size_t>(angle + angles_) * points_, points_);
  }

  /// False if no pose of a square can reach the score of an alternative: so many points lie in the observed
  /// area at all of them.
  [[nodiscard]] bool may_be_alternative(int level, const Candidate& c) const {
    if (!beside_ || map_.seen() == nullptr) return true;
    std::size_t inside = 0;
    for (const Eigen::Vector2i& cell : cells_at(c.angle))
      inside += map_.all_seen(level, cell.x() + c.x, cell.y() + c.y);
    return static_cast<double>(inside) * least_seen_score_ * 255.0 <= c.sum + 1.0;  // 1: for rounding
  }

  /// Penalty of the pose in a square that is nearest to the window's centre.
  [[nodiscard]] std::uint32_t least_penalty(int level, const Candidate& c) const {
    if (params_.shift_penalty_per_m2 <= 0 && params_.turn_penalty_per_rad2 <= 0) return 0;
    const int last = (1 << level) - 1;
    const double dx = std::max({0, c.x, -(c.x + last)}), dy = std::max({0, c.y, -(c.y + last)});
    const double turn = c.angle * angle_step_;
    const double shift_m2 = (dx * dx + dy * dy) * map_.resolution_m() * map_.resolution_m();
    const double loss = params_.shift_penalty_per_m2 * shift_m2 + params_.turn_penalty_per_rad2 * turn * turn;
    return static_cast<std::uint32_t>(std::min(loss, 1.0) * 255.0 * static_cast<double>(points_));
  }

  void descend(int level, const Candidate& node) {
    if (limit_reached() || node.sum < least_ || (best_ && node.sum <= best_->sum)) return;
    if (level == 0) {
      if (beside_ && seen_score(node) < least_seen_score_) return;
      best_ = node;
      // One alternative is sufficient: ends the search.
      least_ = beside_ ? std::numeric_limits<std::uint32_t>::max() : node.sum;
      return;
    }
    struct Children {
      std::array<Candidate, 4> items;
      std::size_t count = 0;
      void push_back(const Candidate& c) {
        std::size_t at = count++;
        for (; at > 0 && better(c, items[at - 1]); --at) items[at] = items[at - 1];
        items[at] = c;
      }
    } children;
    add_four(level - 1, node.angle, node.x, node.y, children);
    for (std::size_t i = 0; i < children.count; ++i) descend(level - 1, children.items[i]);
  }

  /// True if all poses of a square are too close to `beside` to be an alternative.
  [[nodiscard]] bool is_same_place(int level, const Candidate& c) const {
    if (!beside_ || !angle_is_near_beside_[static_cast<std::size_t>(c.angle + angles_)]) return false;
    const int last = (1 << level) - 1;
    // The corner that is farthest away; with a free axis, farthest from the line along it.
    double most = 0;
    for (const int y : {c.y, c.y + last})
      for (const int x : {c.x, c.x + last}) {
        const Vec2 apart(x - beside_->x, y - beside_->y);
        most = std::max(most, params_.free_axis ? std::abs(params_.free_axis->unitOrthogonal().dot(apart))
                                                : apart.norm());
      }
    return most * map_.resolution_m() < params_.other_place_m;
  }

  const CorrelativeMap& map_;
  SE2 centre_;
  CorrelativeSearchParams params_;
  std::span<const Vec2> scan_;
  std::size_t points_;
  double angle_step_ = 0;
  int angles_ = 0, columns_ = 0, rows_ = 0;
  std::vector<Eigen::Vector2i> cells_;  // cells of the points for every angle, at the window's centre
  std::optional<Candidate> beside_, best_;
  std::vector<bool> angle_is_near_beside_;  // for every angle: by it alone, a pose is no alternative
  double least_seen_score_ = 0;             // of an alternative
  std::uint32_t least_ = 0;
  std::size_t evaluations_ = 0;
};

}  // namespace

std::string_view to_string(CorrelativeStatus status) {
  switch (status) {
    case CorrelativeStatus::kFound:
      return "found";
    case CorrelativeStatus::kNothing:
      return "nothing";
    case CorrelativeStatus::kAmbiguous:
      return "ambiguous";
    case CorrelativeStatus::kLimitReached:
      return "search limit reached";
  }
  return "";
}

CorrelativeMatch search_correlative(const CorrelativeMap& map, std::span<const Vec2> points_m,
                                    const SearchWindow& window, const CorrelativeSearchParams& params) {
  CorrelativeMatch match;
  match.T_map_scan = window.centre;
  std::vector<Vec2> usable;
  for (const Vec2& point : points_m)
    if (point.allFinite() && point.norm() < 1e4) usable.push_back(point);
  if (usable.empty() || map.empty() || !(window.centre.vector().cwiseAbs().maxCoeff() < 1e6)) return match;
  Search search(map, usable, window, params);
  const auto best = search.run(std::max(1U, search.sum_of(params.min_score)), {});
  match.evaluations = search.evaluations();
  if (search.limit_reached()) match.status = CorrelativeStatus::kLimitReached;
  if (search.limit_reached() || !best) return match;
  match.score = search.score_of(best->sum);
  match.T_map_scan = refine_on_map(map, usable, search.pose(*best));
  match.status = CorrelativeStatus::kFound;
  if (params.ambiguity_ratio > 1) return match;
  SearchWindow wide = window;
  wide.half_x_m *= params.other_window_ratio;
  wide.half_y_m *= params.other_window_ratio;
  wide.half_angle_rad += std::min((params.other_window_ratio - 1) * wide.half_angle_rad, kMostOtherTurn_rad);
  Search beside(map, usable, wide, params);
  const auto other = beside.run(beside.least_beside(*best), best);
  match.evaluations += beside.evaluations();
  if (beside.limit_reached()) match.status = CorrelativeStatus::kLimitReached;
  if (other) {
    match.status = CorrelativeStatus::kAmbiguous;
    match.other_score = search.score_of(other->sum);
  }
  return match;
}

SE2 refine_on_map(const CorrelativeMap& map, std::span<const Vec2> points_m, const SE2& T_map_scan) {
  double reach_m = map.resolution_m();
  for (const Vec2& point : points_m)
    if (point.allFinite()) reach_m = std::max(reach_m, point.norm());
  SE2 best = T_map_scan;
  double best_score = map.score(points_m, best);
  double step_m = map.resolution_m() / 2;
  for (int round = 0; round < 40 && step_m > map.resolution_m() / 40; ++round) {
    bool improved = false;
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        Vec3 moved = best.vector();
        moved[axis] += sign * (axis == 2 ? 2 * step_m / reach_m : step_m);
        const SE2 candidate(moved.x(), moved.y(), moved.z());
        const double score = map.score(points_m, candidate);
        if (score <= best_score) continue;
        best = candidate;
        best_score = score;
        improved = true;
      }
    if (!improved) step_m /= 2;
  }
  return best;
}

}  // namespace hm
