#include "hm/sim/office/office_simulation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "hm/core/check.hpp"
#include "hm/core/rng.hpp"
#include "hm/sim/office/office_drive.hpp"
#include "hm/sim/office/office_floor.hpp"
#include "hm/sim/office/wheel_errors.hpp"

namespace hm {
namespace {

constexpr double kFirstScan_s = 1.0;  // the stamp of the first scan
constexpr std::uint64_t kWheelStream = 2, kOfficeScanStream = 1ull << 32;

constexpr std::size_t kBeams = 181;
constexpr double kFirst_rad = -std::numbers::pi / 2, kIncrement_rad = std::numbers::pi / (kBeams - 1);
constexpr double kRangeMin_m = 0.05, kSigma_m = 0.01, kSigmaRatio = 0.001, kRangeStep_m = 0.01;
/// Probability that glass returns a beam: at any angle, and so much more at a right angle.
constexpr double kGlassAlways = 0.08, kGlassUpright = 0.7;
constexpr int kGlassPower = 12;
/// Share of the scans with people; distance of their legs.
constexpr double kPeopleRatio = 0.25, kNearest_m = 1, kFarthest_m = 5, kLeg_m = 0.07, kStride_m = 0.25;
constexpr std::uint32_t kMostPeople = 3;

struct Hit {
  double range_m;
  double upright;  // cosine between the beam and the surface's normal
  bool glass;
};
using BeamHits = std::array<std::vector<Hit>, kBeams>;

/// Adds what the beams from the origin meet of a wall, both in the laser's frame.
void add_hits(const OfficeWall& wall, double range_max_m, BeamHits& hits) {
  const Vec2 along = wall.b - wall.a;
  const double length_m = along.norm();
  if (length_m <= 0) return;
  const Vec2 normal(-along.y() / length_m, along.x() / length_m);
  const double distance_m = normal.dot(wall.a);  // of its line
  if (std::abs(distance_m) > range_max_m) return;
  const double begin = std::atan2(wall.a.y(), wall.a.x());
  const double turn = std::remainder(std::atan2(wall.b.y(), wall.b.x()) - begin, 2 * std::numbers::pi);
  const double low = std::min(begin, begin + turn), high = std::max(begin, begin + turn);
  for (const double shift : {-2 * std::numbers::pi, 0.0, 2 * std::numbers::pi}) {
    const int first = std::max(0, static_cast<int>(std::ceil((low + shift - kFirst_rad) / kIncrement_rad)));
    const int last = std::min(static_cast<int>(kBeams) - 1,
                              static_cast<int>(std::floor((high + shift - kFirst_rad) / kIncrement_rad)));
    for (int beam = first; beam <= last; ++beam) {
      const double angle = kFirst_rad + beam * kIncrement_rad;
      const double upright = normal.dot(Vec2(std::cos(angle), std::sin(angle)));
      const double range_m = distance_m / upright;
      if (!(range_m > kRangeMin_m && range_m < range_max_m)) continue;
      hits[static_cast<std::size_t>(beam)].push_back({range_m, std::abs(upright), wall.glass});
    }
  }
}

}  // namespace

struct OfficeSimulation::Impl {
  OfficeSimulationOptions options;
  OfficeFloor floor;
  Trajectory truth, odometry;
  std::vector<SE2> scan_poses;

  [[nodiscard]] Rng rng(std::uint64_t stream) const {
    return Rng(static_cast<std::uint64_t>(options.seed), stream);
  }
  void drive();
  [[nodiscard]] double range_of(std::vector<Hit>& hits, Rng& rng) const;
  void add_people(BeamHits& hits, Rng& rng) const;
};

void OfficeSimulation::Impl::drive() {
  WheelErrors wheels(rng(kWheelStream));
  SE2 T_odom_base;
  std::optional<SE2> before;
  std::size_t posed = 0;
  for (const DrivePose& pose :
       make_office_drive(floor, static_cast<std::uint64_t>(options.seed), options.scan_every_m)) {
    if (before) {
      const SE2 motion = before->inverse() * pose.T_world_base;
      T_odom_base = T_odom_base * (options.perfect ? motion : wheels.measure(motion));
    }
    before = pose.T_world_base;
    const Time stamp = Time::from_seconds(kFirstScan_s + pose.time_s);
    truth.push_back({stamp, pose.T_world_base.to_se3()});
    if (!pose.scans) continue;
    odometry.push_back({stamp, T_odom_base.to_se3()});
    scan_poses.push_back(pose.T_world_base);
    posed = truth.size();
    if (options.scan_limit > 0 && scan_poses.size() >= static_cast<std::size_t>(options.scan_limit)) break;
  }
  truth.resize(posed);
}

/// Legs in front of the robot; those behind a wall are not seen.
void OfficeSimulation::Impl::add_people(BeamHits& hits, Rng& rng) const {
  if (rng.uniform() >= kPeopleRatio) return;
  for (std::uint32_t person = rng.below(kMostPeople) + 1; person > 0; --person) {
    const double angle = rng.uniform(-1.2, 1.2), range_m = rng.uniform(kNearest_m, kFarthest_m);
    const Vec2 middle(range_m * std::cos(angle), range_m * std::sin(angle));
    const double stance = rng.uniform(-std::numbers::pi, std::numbers::pi);
    const Vec2 stride(kStride_m / 2 * std::cos(stance), kStride_m / 2 * std::sin(stance));
    for (const Vec2& leg : {Vec2(middle + stride), Vec2(middle - stride)}) {
      const Vec2 across = Vec2(-leg.y(), leg.x()).normalized() * kLeg_m;
      add_hits({leg - across, leg + across, false}, options.range_max_m, hits);
    }
  }
}

/// The range that is measured along a beam; infinite where nothing returns it.
double OfficeSimulation::Impl::range_of(std::vector<Hit>& hits, Rng& rng) const {
  std::ranges::sort(hits, {}, &Hit::range_m);
  const double noise = rng.normal();
  for (const Hit& hit : hits) {
    if (hit.glass && (options.perfect ||
                      rng.uniform() >= kGlassAlways + kGlassUpright * std::pow(hit.upright, kGlassPower)))
      continue;
    if (options.perfect) return hit.range_m;
    const double range_m = hit.range_m + noise * (kSigma_m + kSigmaRatio * hit.range_m);
    return std::round(range_m / kRangeStep_m) * kRangeStep_m;
  }
  return static_cast<double>(LaserScan::kNoReturn);
}

OfficeSimulation::OfficeSimulation(const OfficeSimulationOptions& options) : impl_(std::make_unique<Impl>()) {
  impl_->options = options;
  impl_->floor =
      make_office_floor(options.width_m, options.depth_m, static_cast<std::uint64_t>(options.seed));
  impl_->drive();
}
OfficeSimulation::~OfficeSimulation() = default;
OfficeSimulation::OfficeSimulation(OfficeSimulation&&) noexcept = default;
OfficeSimulation& OfficeSimulation::operator=(OfficeSimulation&&) noexcept = default;

std::size_t OfficeSimulation::scan_count() const { return impl_->scan_poses.size(); }

LaserScan OfficeSimulation::scan(std::size_t index) const {
  HM_CHECK(index < scan_count(), "scan {} of {}", index, scan_count());
  const SE2 T_base_world = impl_->scan_poses[index].inverse();
  BeamHits hits;
  for (const OfficeWall& wall : impl_->floor.walls)
    add_hits({T_base_world * wall.a, T_base_world * wall.b, wall.glass}, impl_->options.range_max_m, hits);
  Rng rng = impl_->rng(kOfficeScanStream + index);
  if (impl_->options.people && !impl_->options.perfect) impl_->add_people(hits, rng);
  LaserScan scan;
  scan.stamp = impl_->odometry[index].stamp;
  scan.angle_min_rad = kFirst_rad, scan.angle_increment_rad = kIncrement_rad;
  scan.range_min_m = kRangeMin_m, scan.range_max_m = impl_->options.range_max_m;
  for (std::vector<Hit>& beam : hits) scan.ranges_m.push_back(static_cast<float>(impl_->range_of(beam, rng)));
  return scan;
}

const Trajectory& OfficeSimulation::odometry() const { return impl_->odometry; }
const Trajectory& OfficeSimulation::truth() const { return impl_->truth; }

}  // namespace hm
