#include "hm/sim/recording/simulation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/sim/motion/walk.hpp"

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

/// Ornstein-Uhlenbeck process over path length: an error correlated over some metres.
class SmoothError {
 public:
  explicit SmoothError(double sigma) : sigma_(sigma) {}
  double advance(double step_m, Rng& rng) {
    constexpr double kCorrelation_m = 8;
    const double keep = std::exp(-step_m / kCorrelation_m);
    value_ = keep * value_ + sigma_ * std::sqrt(1 - keep * keep) * rng.normal();
    return value_;
  }

 private:
  double sigma_;
  double value_ = 0;
};

/// Simulates the poses of a visual-inertial odometry: every step is rotated by the accumulated yaw error and
/// scaled; roll and pitch are observable from gravity and stay exact.
std::vector<SE3> drifted(const std::vector<SE3>& truth, const SimulationParams& params) {
  Rng rng(static_cast<std::uint64_t>(params.seed), 0x6472696674);
  SmoothError yaw_rate(params.drift_yaw_rad_m);
  std::array<SmoothError, 3> velocity = {SmoothError(params.drift_ratio), SmoothError(params.drift_ratio),
                                         SmoothError(params.drift_ratio)};
  std::vector<SE3> reported = {truth.front()};
  double yaw = 0;
  Vec3 position = truth.front().translation();
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Vec3 step = truth[i].translation() - truth[i - 1].translation();
    const double length = step.norm();
    const Vec3 error(velocity[0].advance(length, rng), velocity[1].advance(length, rng),
                     velocity[2].advance(length, rng));
    yaw += yaw_rate.advance(length, rng) * length;
    const Mat3 turn = so3_exp(Vec3(0, 0, yaw));
    position += turn * (step + error * length);
    reported.emplace_back(turn * truth[i].rotation(), position);
  }
  return reported;
}

}  // namespace

struct Simulation::Impl {
  explicit Impl(const SimulationParams& p)
      : params(p),
        sensor(sensor_model(p.sensor)),
        world(make_world(p.world, static_cast<std::uint64_t>(p.seed))),
        renderer(world),
        walk(make_walk(p.world)) {
    const double period_s = p.frame_stride / sensor.rate_hz;
    const double duration_s = walk.duration_s() * p.duration_scale_ratio;
    auto count = static_cast<std::size_t>(duration_s / period_s) + 1;
    if (p.frame_limit > 0) count = std::min(count, static_cast<std::size_t>(p.frame_limit));
    for (std::size_t i = 0; i < count; ++i) {
      stamps.push_back(Time::from_seconds(1.0 + static_cast<double>(i) * period_s));
      truth.push_back(pose_at(static_cast<double>(i) * period_s));
    }
    reported = p.pose_drift ? drifted(truth, p) : truth;
  }

  /// True pose at a time after the first frame.
  [[nodiscard]] SE3 pose_at(double elapsed_s) const {
    return walk.T_world_camera(elapsed_s / params.duration_scale_ratio);
  }

  [[nodiscard]] Image<Rgb8> rolling_color(double elapsed_s, const ParallelLoop& loop) const {
    std::vector<SE3> poses;
    for (int row = 0; row < sensor.camera.height; ++row) {
      const double share = static_cast<double>(row) / std::max(1, sensor.camera.height - 1) - 0.5;
      poses.push_back(pose_at(elapsed_s + share * params.readout_s));
    }
    return renderer.render_rolling_color(sensor.camera, poses, loop);
  }

  SimulationParams params;
  SensorModel sensor;
  World world;
  Renderer renderer;
  Walk walk;
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
  RenderedView view = self.renderer.render(self.sensor.camera, self.truth[index], loop);
  Rng rng(static_cast<std::uint64_t>(self.params.seed), index);
  RgbdFrame frame;
  frame.index = index;
  frame.stamp = frame.color_stamp = self.stamps[index];
  frame.depth = sense_depth(self.sensor, self.params.effects, view, rng);
  frame.T_world_camera = self.reported[index];
  const double elapsed_s = (self.stamps[index] - self.stamps.front()).seconds();
  frame.color = self.params.rolling_shutter ? self.rolling_color(elapsed_s, loop) : std::move(view.color);
  return frame;
}

Time Simulation::stamp(std::size_t index) const { return impl_->stamps.at(index); }
SE3 Simulation::true_pose(std::size_t index) const { return impl_->truth.at(index); }
SE3 Simulation::reported_pose(std::size_t index) const { return impl_->reported.at(index); }
std::vector<ImuSample> Simulation::imu() const {
  const Impl& self = *impl_;
  if (!self.params.imu) return {};
  return carried_imu([&](double elapsed_s) { return self.pose_at(elapsed_s); }, self.stamps.front(),
                     (self.stamps.back() - self.stamps.front()).seconds(), self.params.imu_sensor, {},
                     static_cast<std::uint64_t>(self.params.seed));
}
const PinholeCamera& Simulation::camera() const { return impl_->sensor.camera; }
const SensorModel& Simulation::sensor() const { return impl_->sensor; }
const World& Simulation::world() const { return impl_->world; }
const SimulationParams& Simulation::params() const { return impl_->params; }

SurfacePoints Simulation::visible_truth(const ParallelLoop& loop) const {
  constexpr std::size_t kMaxPoses = 2000;
  const Impl& self = *impl_;
  const std::size_t stride = (self.truth.size() + kMaxPoses - 1) / kMaxPoses;
  std::vector<SE3> poses;
  for (std::size_t i = 0; i < self.truth.size(); i += stride) poses.push_back(self.truth[i]);
  VisibilityParams visibility;
  visibility.camera = self.sensor.camera;
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
