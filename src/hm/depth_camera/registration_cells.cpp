#include "hm/depth_camera/registration_cells.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "hm/core/check.hpp"
#include "hm/core/round_up.hpp"

namespace hm::detail {
namespace {

/// No depth camera of this kind reads less than the first; those far from the other camera may need more.
constexpr double kNearest_m[] = {0.2, 0.4, 0.8, 1.6};
constexpr double kMostCells = 1 << 24;
/// By how much single precision goes astray, and more; if no reading comes much nearer to the other camera.
constexpr double kAstray_px = 0.05, kLeastOfDepth = 0.25;
constexpr int kLine = 32;

/// The pixels that pixel (x, y) sees readings at: at infinity, at the nearest depth, and between the two.
class Seen {
 public:
  void add(const PixelMap& map, double nearest_m, int x, int y) {
    const Vec3 far = map.directions * Vec3(x, y, 1), near = nearest_m * far + map.origin_m;
    in_front_ = in_front_ && far.z() > 0 && near.z() > kLeastOfDepth * nearest_m * far.z();
    for (const Vec3& p : {far, near}) {
      low_ = low_.cwiseMin(p.hnormalized());
      high_ = high_.cwiseMax(p.hnormalized());
    }
  }
  [[nodiscard]] bool in_front() const { return in_front_; }
  [[nodiscard]] double first(int axis) const { return std::floor(low_[axis] + 0.5 - kAstray_px); }
  [[nodiscard]] double last(int axis) const { return std::floor(high_[axis] + 0.5 + kAstray_px); }

 private:
  bool in_front_ = true;
  Vec2 low_ = Vec2::Constant(HUGE_VAL), high_ = Vec2::Constant(-HUGE_VAL);
};

/// The image with a border of so many pixels.
std::optional<RegistrationCells> with_border(const PixelMap& map, const Vec2& before, const Vec2& after) {
  const double width = before.x() + map.to_width + after.x() + 2 * kLine;
  if (!(width * (before.y() + map.to_height + after.y()) < kMostCells)) return std::nullopt;
  RegistrationCells cells;
  cells.left = round_up(static_cast<int>(before.x()), kLine);
  cells.top = static_cast<int>(before.y());
  cells.stride = round_up(cells.left + map.to_width + static_cast<int>(after.x()), kLine);
  cells.rows = cells.top + map.to_height + static_cast<int>(after.y());
  return cells;
}

/// What is seen are quotients of linear functions: their extremes are at the ends of a row, and in the
/// corners of the image.
std::optional<RegistrationCells> cells_from(double nearest_m, const PixelMap& map) {
  const Vec2 image(map.to_width, map.to_height);
  Seen whole;
  double most_z = 0;
  for (const int y : {0, map.height - 1})
    for (const int x : {0, map.width - 1}) {
      whole.add(map, nearest_m, x, y);
      most_z = std::max(most_z, (map.directions * Vec3(x, y, 1)).z());
    }
  if (!whole.in_front()) return std::nullopt;
  // Below 0 a number has a fraction even when 2^23 is added: nothing may be rounded to 0 from there.
  const Vec2 before(1 - whole.first(0), 1 - whole.first(1)), end(whole.last(0) + 1, whole.last(1) + 1);
  auto cells = with_border(map, before.cwiseMax(1), (end - image).cwiseMax(1));
  if (!cells) return std::nullopt;
  cells->nearest_m = nearest_m, cells->most_z = most_z;
  for (int y = 0; y < map.height; ++y) {
    Seen row;
    for (const int x : {0, map.width - 1}) row.add(map, nearest_m, x, y);
    cells->reached.push_back(
        {cells->top + static_cast<int>(row.first(1)), cells->top + static_cast<int>(row.last(1))});
    if ((cells->reached[y].last - cells->reached[y].first + 1) * cells->stride >
        RegistrationCells::kMostWithinReach)
      return std::nullopt;
  }
  return cells;
}

}  // namespace

bool has_cells_for(int to_width, int to_height) {
  PixelMap map;
  map.to_width = to_width, map.to_height = to_height;
  return with_border(map, Vec2::Ones(), Vec2::Ones()).has_value();
}

RegistrationCells registration_cells(const PixelMap& map) {
  for (const double nearest_m : kNearest_m)
    if (auto cells = cells_from(nearest_m, map)) return std::move(*cells);
  auto cells = with_border(map, Vec2::Ones(), Vec2::Ones());
  HM_CHECK(cells.has_value(), "{} x {}", map.to_width, map.to_height);
  cells->reached.assign(static_cast<std::size_t>(map.height), {0, cells->rows - 1});
  return std::move(*cells);
}

}  // namespace hm::detail
