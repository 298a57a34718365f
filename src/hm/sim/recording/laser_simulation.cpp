#include "hm/sim/recording/laser_simulation.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr double kStart_s = 1.0;  ///< the stamp of the first scan
constexpr std::uint64_t kScanStream = 1ull << 32, kScanLatencyStream = 2ull << 32,
                        kImuLatencyStream = 3ull << 32, kOdometryStream = 4ull << 32;

Flight make_flight(const LaserSimulationParams& params) {
  const auto seed = static_cast<std::uint64_t>(params.seed);
  switch (params.world) {
    case WorldKind::kHouse:
      return house_flight(params.flight, seed);
    case WorldKind::kRoom:
      return room_flight(params.flight, seed);
    case WorldKind::kCorridor:
      break;
  }
  return corridor_flight(params.flight, seed);
}

double yaw_of(const Mat3& rotation) { return std::atan2(rotation(1, 0), rotation(0, 0)); }

SE3 planar(double x, double y, double yaw_rad) { return {so3_exp({0, 0, yaw_rad}), {x, y, 0}}; }

}  // namespace

struct LaserSimulation::Impl {
  explicit Impl(const LaserSimulationParams& p)
      : params(p),
        world(make_world(p.world, static_cast<std::uint64_t>(p.seed))),
        renderer(world),
        flight(make_flight(p)),
        laser(world, renderer,
              {p.laser, p.laser_effects, city_flyer_rig(static_cast<std::size_t>(p.laser.beams))}),
        rig(city_flyer_rig(static_cast<std::size_t>(p.laser.beams))) {
    const double scanned_s = flight.duration_s() - laser.sweep_s();
    scans = static_cast<std::size_t>(std::max(0.0, scanned_s * p.laser.kScanRate_hz)) + 1;
    if (p.scan_limit > 0) scans = std::min(scans, static_cast<std::size_t>(p.scan_limit));
    duration_s = static_cast<double>(scans - 1) / p.laser.kScanRate_hz + laser.sweep_s();
  }

  [[nodiscard]] FlightState state_at(Time time) const { return flight.state(time.seconds() - kStart_s); }

  /// Stamps of a stream with this rate; the last one is not before the last beam.
  [[nodiscard]] std::vector<Time> stamps(double rate_hz) const {
    std::vector<Time> stamps;
    const auto steps = static_cast<std::size_t>(std::ceil(duration_s * rate_hz - 1e-9));
    for (std::size_t i = 0; i <= steps; ++i)
      stamps.push_back(Time::from_seconds(kStart_s + static_cast<double>(i) / rate_hz));
    return stamps;
  }

  /// Time of arrival of a measurement completed at `measured`.
  [[nodiscard]] Time arrival(Time measured, double latency_s, Rng& rng) const {
    const double jitter_s = params.kLatencyJitter_s * rng.uniform();
    return params.latency ? measured + Duration::from_seconds(latency_s + jitter_s) : measured;
  }
  [[nodiscard]] Rng rng(std::uint64_t stream) const {
    return Rng(static_cast<std::uint64_t>(params.seed), stream);
  }

  LaserSimulationParams params;
  World world;
  Renderer renderer;
  Flight flight;
  LaserSensor laser;
  LaserRig rig;
  std::size_t scans = 0;
  double duration_s = 0;
};

HeightTruth true_heights(const Renderer& renderer, Time stamp, const Vec3& base_world) {
  const Ray rays[] = {{base_world, -Vec3::UnitZ(), 0}, {base_world, Vec3::UnitZ(), 0}};
  RayHit hits[2];
  renderer.cast(rays, hits);
  const double z = base_world.z();
  return {stamp, z, z - hits[0].range_m, z + hits[1].range_m};
}

void LaserSimulationParams::make_perfect() {
  laser_effects = {false, false, false, false, true};
  imu_effects = {false, false, false};
  latency = false;
}

LaserSimulation::LaserSimulation(const LaserSimulationParams& params)
    : impl_(std::make_unique<Impl>(params)) {}
LaserSimulation::~LaserSimulation() = default;
LaserSimulation::LaserSimulation(LaserSimulation&&) noexcept = default;
LaserSimulation& LaserSimulation::operator=(LaserSimulation&&) noexcept = default;

std::size_t LaserSimulation::scan_count() const { return impl_->scans; }

Received<LaserScan> LaserSimulation::scan(std::size_t index) const {
  HM_CHECK(index < scan_count(), "scan {} of {}", index, scan_count());
  const Impl& self = *impl_;
  const double begin_s = static_cast<double>(index) / self.params.laser.kScanRate_hz;
  const auto pose_after = [&](double elapsed_s) { return self.flight.T_world_base(begin_s + elapsed_s); };
  LaserScan scan =
      self.laser.scan(Time::from_seconds(kStart_s + begin_s), pose_after, self.rng(kScanStream + index));
  Rng rng = self.rng(kScanLatencyStream + index);
  const Time complete = scan.stamp_of(scan.size() - 1);
  return {self.arrival(complete, self.params.kScanLatency_s, rng), std::move(scan)};
}

std::vector<Received<ImuSample>> LaserSimulation::imu() const {
  const Impl& self = *impl_;
  ImuErrors errors(self.params.imu, self.params.imu_effects, static_cast<std::uint64_t>(self.params.seed));
  Rng rng = self.rng(kImuLatencyStream);
  std::vector<Received<ImuSample>> samples;
  for (const Time stamp : self.stamps(self.params.imu.imu_rate_hz)) {
    ImuSample exact = exact_imu(self.state_at(stamp), self.rig.T_base_imu);
    exact.stamp = stamp;
    samples.push_back({self.arrival(stamp, self.params.kImuLatency_s, rng), errors.next(exact)});
  }
  return samples;
}

std::vector<Received<WheelOdometry>> LaserSimulation::odometry() const {
  const Impl& self = *impl_;
  std::vector<Received<WheelOdometry>> readings;
  if (!self.params.wheel_odometry) return readings;
  Rng rng = self.rng(kOdometryStream);
  SE3 T_odom_base, before;
  for (const Time stamp : self.stamps(self.params.kOdometryRate_hz)) {
    const FlightState state = self.state_at(stamp);
    const Vec3& p = state.T_world_base.translation();
    const SE3 here = planar(p.x(), p.y(), yaw_of(state.T_world_base.rotation()));
    const double noise = rng.normal(), yaw_noise = rng.normal();
    if (!readings.empty()) {
      const SE3 step = before.inverse() * here;
      const double root_m = std::sqrt(step.translation().norm());
      const Vec3 ahead = step.translation().normalized() * noise * root_m * self.params.odometry_drift_ratio;
      const double turned = yaw_of(step.rotation()) + yaw_noise * root_m * self.params.odometry_yaw_rad_m;
      const Vec3 moved = step.translation() + ahead;
      T_odom_base = T_odom_base * planar(moved.x(), moved.y(), turned);
    }
    before = here;
    const Vec3 v_base = here.rotation().transpose() * state.velocity_world_m_s;
    const Vec3 w_world = state.T_world_base.rotation() * state.angular_velocity_base_rad_s;
    readings.push_back({self.arrival(stamp, self.params.kImuLatency_s, rng),
                        {{stamp, T_odom_base}, {v_base.x(), v_base.y(), 0}, {0, 0, w_world.z()}}});
  }
  return readings;
}

Trajectory LaserSimulation::truth() const {
  Trajectory trajectory;
  for (const Time stamp : impl_->stamps(impl_->params.truth_rate_hz))
    trajectory.push_back({stamp, impl_->state_at(stamp).T_world_base});
  return trajectory;
}

std::vector<HeightTruth> LaserSimulation::heights() const {
  std::vector<HeightTruth> heights;
  for (const Time stamp : impl_->stamps(impl_->params.truth_rate_hz))
    heights.push_back(
        true_heights(impl_->renderer, stamp, impl_->state_at(stamp).T_world_base.translation()));
  return heights;
}

FlightState LaserSimulation::state_at(Time time) const { return impl_->state_at(time); }
const LaserRig& LaserSimulation::rig() const { return impl_->rig; }
const World& LaserSimulation::world() const { return impl_->world; }
const Renderer& LaserSimulation::renderer() const { return impl_->renderer; }
const LaserSimulationParams& LaserSimulation::params() const { return impl_->params; }

}  // namespace hm
