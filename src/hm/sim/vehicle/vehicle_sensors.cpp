#include "hm/sim/vehicle/vehicle_sensors.hpp"

#include <algorithm>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr std::uint64_t kFlownScanStream = 7ull << 32;
constexpr std::int64_t kScanPeriod_ns =
    1'000'000'000 / static_cast<std::int64_t>(LaserSensorParams::kScanRate_hz);
constexpr Duration kPoseGap{2 * Vehicle::kStep.ns};  ///< poses are a step apart

/// Passes the next arrival of a link on.
template <class T>
std::optional<Received<T>> received_from(StreamLink<T>& link, Time now) {
  auto arrival = link.receive(now);
  if (!arrival) return std::nullopt;
  return Received<T>{arrival->at, std::move(arrival->message)};
}

}  // namespace

VehicleSensors::VehicleSensors(const World& world, const Renderer& renderer, const VehicleSensorsSetup& setup)
    : rig_(city_flyer_rig(static_cast<std::size_t>(setup.laser.beams))),
      laser_(world, renderer, {setup.laser, setup.laser_effects, rig_}),
      seed_(setup.seed),
      laser_link_(setup.laser_link, setup.seed),
      imu_link_(setup.imu_link, setup.seed + 1) {}

void VehicleSensors::update(const Vehicle& vehicle, const std::optional<ImuSample>& imu) {
  if (!start_) start_ = vehicle.now();
  HM_CHECK(poses_.empty() || vehicle.now() > poses_.back().stamp, "update() without a step before");
  poses_.push_back({vehicle.now(), vehicle.state().T_world_base});
  if (imu) imu_link_.send(vehicle.now(), *imu);
  sense_laser(vehicle);
}

void VehicleSensors::sense_laser(const Vehicle& vehicle) {
  const auto begin_of = [&](std::int64_t index) { return *start_ + Duration{index * kScanPeriod_ns}; };
  const Time begin = begin_of(scans_), end = begin + Duration::from_seconds(laser_.sweep_s());
  if (vehicle.now() < end) return;
  const SE3 turned(so3_exp({0, 0, vehicle.has_fault(FaultKind::kSensorTurned) ? kFaultTurn_rad : 0.0}),
                   Vec3::Zero());
  const auto pose_after = [&](double elapsed_s) {
    return *pose_at(poses_, begin + Duration::from_seconds(elapsed_s), kPoseGap, kPoseGap) * turned;
  };
  if (!vehicle.has_fault(FaultKind::kLaserOff)) {
    const Rng rng(seed_, kFlownScanStream + static_cast<std::uint64_t>(scans_));
    laser_link_.send(end, laser_.scan(begin, pose_after, rng));
  }
  ++scans_;
  const Time next = begin_of(scans_);
  const auto kept =
      std::ranges::find_if(poses_, [&](const StampedPose& p) { return p.stamp > next - kPoseGap; });
  poses_.erase(poses_.begin(), kept);
}

std::optional<Received<LaserScan>> VehicleSensors::next_scan(Time now) {
  return received_from(laser_link_, now);
}

std::optional<Received<ImuSample>> VehicleSensors::next_imu(Time now) {
  return received_from(imu_link_, now);
}

}  // namespace hm
