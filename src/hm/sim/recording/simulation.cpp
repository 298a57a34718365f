#include "hm/sim/recording/simulation.hpp"

#include <algorithm>
#include <array>

#include "hm/sim/motion/walk.hpp"
#include "hm/sim/recording/flawed_camera.hpp"
#include "hm/sim/recording/reported_poses.hpp"

namespace hm {
namespace {

Walk make_walk(WorldKind world) {
  switch (world) {
    case WorldKind::kHouse:
      return house_walk();
    case WorldKind::kRoom:
      return room_walk();
    case WorldKind::kCorridor:
      break;
  }
  return corridor_walk();
}

Flaws checked_flaws(const std::string& names) {
  const auto flaws = Flaws::parse(names);
  HM_CHECK(flaws.has_value(), "{}", flaws ? std::string() : to_string(flaws.error()));
  return *flaws;
}

SensorModel flawed(SensorModel sensor, const FlawSizes& sizes) {
  sensor.bias_at_3m_m += sizes.bend_at_3m_m;
  sensor.short_at_1m_ratio += sizes.short_at_1m_ratio;
  sensor.correlated_noise = sizes.flaws.has(Flaw::kDepthGrain);
  return sensor;
}

}  // namespace

struct Simulation::Impl {
  explicit Impl(const SimulationParams& p)
      : params(p),
        sizes(draw_flaws(checked_flaws(p.flaws), seed())),
        sensor(flawed(sensor_model(p.sensor), sizes)),
        world(make_world(p.world, seed())),
        renderer(world),
        walk(make_walk(p.world)),
        flawed_camera({world, renderer, walk, p.duration_scale_ratio, sensor.camera, sizes, seed()}) {
    const double period_s = p.frame_stride / sensor.rate_hz;
    const double duration_s = walk.duration_s() * p.duration_scale_ratio;
    auto count = static_cast<std::size_t>(duration_s / period_s) + 1;
    if (p.frame_limit > 0) count = std::min(count, static_cast<std::size_t>(p.frame_limit));
    for (std::size_t i = 0; i < count; ++i) {
      stamps.push_back(Time::from_seconds(1.0 + static_cast<double>(i) * period_s));
      truth.push_back(flawed_camera.T_world_camera(static_cast<double>(i) * period_s));
    }
    reported = reported_poses();
  }

  [[nodiscard]] std::uint64_t seed() const { return static_cast<std::uint64_t>(params.seed); }

  [[nodiscard]] std::vector<SE3> reported_poses() const {
    if (sizes.flaws.has(Flaw::kWheelSlip)) return poses_of_wheels(truth, seed());
    if (!params.pose_drift) return truth;
    return poses_of_visual_inertial_odometry(truth, {params.drift_ratio, params.drift_yaw_rad_m}, seed());
  }

  /// The colour image is taken by another camera than depth, or at another time.
  [[nodiscard]] bool has_own_color() const {
    constexpr std::array kOfColor = {Flaw::kBlur,         Flaw::kRollingShutter, Flaw::kExposure,
                                     Flaw::kRegistration, Flaw::kTimeOffset,     Flaw::kUnregistered};
    return std::ranges::any_of(kOfColor, [&](Flaw flaw) { return sizes.flaws.has(flaw); });
  }

  SimulationParams params;
  FlawSizes sizes;
  SensorModel sensor;
  World world;
  Renderer renderer;
  Walk walk;
  FlawedCamera flawed_camera;
  std::vector<Time> stamps;
  std::vector<SE3> truth, reported;
};

Simulation::Simulation(const SimulationParams& params) : impl_(std::make_unique<Impl>(params)) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

std::size_t Simulation::frame_count() const { return impl_->truth.size(); }

RgbdFrame Simulation::frame(std::size_t index, const ParallelLoop& loop) const {
  HM_CHECK(index < frame_count(), "frame {} of {}", index, frame_count());
  const Impl& self = *impl_;
  const double elapsed_s = (self.stamps[index] - self.stamps.front()).seconds();
  RenderedView view = self.flawed_camera.view(self.truth[index], elapsed_s, loop);
  Rng rng(static_cast<std::uint64_t>(self.params.seed), index);
  RgbdFrame frame;
  frame.index = index;
  frame.stamp = frame.color_stamp = self.stamps[index];
  frame.depth = sense_depth(self.sensor, self.params.effects, view, rng);
  frame.T_world_camera = self.reported[index];
  frame.color = self.has_own_color() ? self.flawed_camera.color(elapsed_s, loop) : std::move(view.color);
  return frame;
}

Time Simulation::stamp(std::size_t index) const { return impl_->stamps.at(index); }
SE3 Simulation::true_pose(std::size_t index) const { return impl_->truth.at(index); }
SE3 Simulation::reported_pose(std::size_t index) const { return impl_->reported.at(index); }
std::vector<ImuSample> Simulation::imu() const {
  const Impl& self = *impl_;
  if (!self.params.imu) return {};
  return carried_imu([&](double elapsed_s) { return self.flawed_camera.T_world_camera(elapsed_s); },
                     self.stamps.front(), (self.stamps.back() - self.stamps.front()).seconds(),
                     self.params.imu_sensor, {}, static_cast<std::uint64_t>(self.params.seed));
}
const PinholeCamera& Simulation::camera() const { return impl_->sensor.camera; }
const SensorModel& Simulation::sensor() const { return impl_->sensor; }
const FlawSizes& Simulation::flaws() const { return impl_->sizes; }
bool Simulation::has_reported_poses() const {
  return impl_->params.pose_drift || impl_->sizes.flaws.has(Flaw::kWheelSlip);
}
const World& Simulation::world() const { return impl_->world; }
const SimulationParams& Simulation::params() const { return impl_->params; }

SurfacePoints Simulation::visible_truth(const ParallelLoop& loop) const {
  constexpr std::size_t kMaxPoses = 2000;
  const Impl& self = *impl_;
  const std::size_t stride = (self.truth.size() + kMaxPoses - 1) / kMaxPoses;
  std::vector<SE3> poses;
  for (std::size_t i = 0; i < self.truth.size(); i += stride) poses.push_back(self.truth[i]);
  VisibilityParams visibility;
  visibility.camera = true_camera(self.sensor.camera, self.sizes);
  visibility.min_depth_m = self.sensor.min_depth_m;
  visibility.max_depth_m = self.sensor.max_depth_m;
  if (self.params.truth_far_m > 0)
    visibility.max_depth_m = std::min(visibility.max_depth_m, self.params.truth_far_m);
  visibility.grazing_limit_rad = self.params.effects.grazing_limit_rad;
  visibility.spacing_m = self.params.truth_spacing_m;
  visibility.seed = static_cast<std::uint64_t>(self.params.seed);
  return visible_surface_points(self.world, poses, visibility, loop);
}

}  // namespace hm
