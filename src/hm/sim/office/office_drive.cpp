#include "hm/sim/office/office_drive.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kSpeed_m_s = 0.28, kTurn_rad_s = 0.34;
constexpr double kMostStep_m = 0.1, kMostStep_rad = 0.05, kStepsPerScan = 4;
constexpr double kScanEvery_rad_m = 0.5;
/// Length of the drive relative to that of all corridors.
constexpr double kDriveRatio = 1.5;
/// Distance between the points of a corridor that the robot heads for, and how far beside the middle they
/// lie.
constexpr double kAim_m = 6, kBeside_m = 0.35;
constexpr double kVisitRatio = 0.35;  // of the corridors between two crossings
constexpr double kOnLine_m = 0.1;

/// A crossing of two corridors: its column and its row.
using Crossing = std::pair<int, int>;

class RoutePlanner {
 public:
  RoutePlanner(const OfficeFloor& floor, std::uint64_t seed) : floor_(floor), rng_(seed, 1) {}

  std::vector<Vec2> plan() {
    Crossing here{0, 0};
    std::optional<Crossing> before;
    points_.push_back(place(here));
    double length_m = 0;
    while (length_m < kDriveRatio * corridors_m()) {
      const Crossing next = choose(here, before);
      ++visits_[std::minmax(here, next)];
      length_m += (place(next) - place(here)).norm();
      follow(place(here), place(next));
      before = here;
      here = next;
    }
    return std::move(points_);
  }

 private:
  [[nodiscard]] Vec2 place(const Crossing& crossing) const {
    return {floor_.columns_m[static_cast<std::size_t>(crossing.first)],
            floor_.rows_m[static_cast<std::size_t>(crossing.second)]};
  }
  [[nodiscard]] double corridors_m() const {
    const auto extent = [](const std::vector<double>& lines) { return lines.back() - lines.front(); };
    return static_cast<double>(floor_.rows_m.size()) * extent(floor_.columns_m) +
           static_cast<double>(floor_.columns_m.size()) * extent(floor_.rows_m);
  }
  Crossing choose(const Crossing& here, const std::optional<Crossing>& before);
  void follow(const Vec2& from, const Vec2& to);
  const OfficeRoom* room_to_visit(const Vec2& from, const Vec2& to);

  const OfficeFloor& floor_;
  Rng rng_;
  std::map<std::pair<Crossing, Crossing>, int> visits_;
  std::vector<Vec2> points_;
};

/// The neighbour whose corridor was driven least, and not back.
Crossing RoutePlanner::choose(const Crossing& here, const std::optional<Crossing>& before) {
  const int columns = static_cast<int>(floor_.columns_m.size()),
            rows = static_cast<int>(floor_.rows_m.size());
  std::vector<Crossing> best;
  int least = 0;
  for (const auto& [dx, dy] : {Crossing{1, 0}, Crossing{0, 1}, Crossing{-1, 0}, Crossing{0, -1}}) {
    const Crossing next{here.first + dx, here.second + dy};
    if (next.first < 0 || next.second < 0 || next.first >= columns || next.second >= rows || next == before)
      continue;
    const int visits = visits_[std::minmax(here, next)];
    if (best.empty() || visits < least) best.clear(), least = visits;
    if (visits == least) best.push_back(next);
  }
  return best[rng_.below(static_cast<std::uint32_t>(best.size()))];
}

/// An open room along the way, or none.
const OfficeRoom* RoutePlanner::room_to_visit(const Vec2& from, const Vec2& to) {
  if (rng_.uniform() >= kVisitRatio) return nullptr;
  const Vec2 along = (to - from).normalized();
  std::vector<const OfficeRoom*> rooms;
  for (const OfficeRoom& room : floor_.rooms) {
    const Vec2 door = room.before_door - from;
    const double at = along.dot(door);
    if (room.open && at > 2 && at < (to - from).norm() - 2 && (door - at * along).norm() < kOnLine_m)
      rooms.push_back(&room);
  }
  return rooms.empty() ? nullptr : rooms[rng_.below(static_cast<std::uint32_t>(rooms.size()))];
}

void RoutePlanner::follow(const Vec2& from, const Vec2& to) {
  const OfficeRoom* room = room_to_visit(from, to);
  const Vec2 along = (to - from).normalized(), beside(-along.y(), along.x());
  const double length_m = (to - from).norm();
  const double visit_at = room ? along.dot(room->before_door - from) : length_m;
  const int aims = std::max(1, static_cast<int>(std::lround(length_m / kAim_m)));
  const auto visit = [&] {
    for (const Vec2& point : {room->before_door, room->inside, room->before_door}) points_.push_back(point);
    room = nullptr;
  };
  for (int i = 1; i < aims; ++i) {
    const double at = length_m * i / aims;
    if (room && at > visit_at) visit();
    points_.push_back(from + at * along + beside * rng_.uniform(-kBeside_m, kBeside_m));
  }
  if (room) visit();
  points_.push_back(to + Vec2(rng_.uniform(-kBeside_m, kBeside_m), rng_.uniform(-kBeside_m, kBeside_m)));
}

/// Moves a robot, noting its poses.
class Driver {
 public:
  Driver(const SE2& start, double scan_every_m)
      : scan_every_m_(scan_every_m),
        scan_every_rad_(kScanEvery_rad_m * scan_every_m),
        step_m_(std::min(kMostStep_m, scan_every_m_ / kStepsPerScan)),
        step_rad_(std::min(kMostStep_rad, scan_every_rad_ / kStepsPerScan)),
        last_scan_(start) {
    poses_.push_back({0, start, true});
  }

  void turn_to(double angle_rad) {
    const double turn = wrap_angle(angle_rad - here().angle());
    const int steps = static_cast<int>(std::ceil(std::abs(turn) / step_rad_));
    for (int i = 0; i < steps; ++i) step(SE2(0, 0, turn / steps), std::abs(turn) / steps / kTurn_rad_s);
  }
  void drive_to(const Vec2& place) {
    const Vec2 way = place - here().translation();
    turn_to(std::atan2(way.y(), way.x()));
    const int steps = static_cast<int>(std::ceil(way.norm() / step_m_));
    for (int i = 0; i < steps; ++i) step(SE2(way.norm() / steps, 0, 0), way.norm() / steps / kSpeed_m_s);
  }
  std::vector<DrivePose> take() { return std::move(poses_); }

 private:
  [[nodiscard]] const SE2& here() const { return poses_.back().T_world_base; }
  void step(const SE2& motion, double time_s) {
    poses_.push_back({poses_.back().time_s + time_s, here() * motion, false});
    const SE2 since = last_scan_.inverse() * here();
    constexpr double kRounding = 1e-9;
    if (since.translation().norm() < scan_every_m_ - kRounding &&
        std::abs(since.angle()) < scan_every_rad_ - kRounding)
      return;
    poses_.back().scans = true;
    last_scan_ = here();
  }

  double scan_every_m_, scan_every_rad_, step_m_, step_rad_;
  std::vector<DrivePose> poses_;
  SE2 last_scan_;
};

}  // namespace

std::vector<DrivePose> make_office_drive(const OfficeFloor& floor, std::uint64_t seed, double scan_every_m) {
  const std::vector<Vec2> points = RoutePlanner(floor, seed).plan();
  const Vec2 way = points[1] - points[0];
  Driver driver(SE2(points[0], std::atan2(way.y(), way.x())), scan_every_m);
  for (std::size_t i = 1; i < points.size(); ++i) driver.drive_to(points[i]);
  return driver.take();
}

}  // namespace hm
