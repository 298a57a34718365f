#include "hm/pipeline/flight/onboard_computer.hpp"

#include <algorithm>
#include <cmath>

#include "hm/sim/motion/flight.hpp"

namespace hm {
namespace {

/// How much larger than by the noise of ranges the variances are: with the residuals of the match. A match
/// that fits badly (a place seen anew, a wrong minimum) is uncertain in proportion.
double variance_scale(const ScanMatch& match) {
  constexpr double kMeanPerSigma = 0.798;  // mean of |x| of a normal distribution
  if (match.range_sigma_m <= 0) return 1;
  const double excess = match.mean_error_m / (kMeanPerSigma * match.range_sigma_m);
  return std::max(1.0, excess * excess);
}

PoseMessage pose_message(const LaserStep& step) {
  PoseMessage message;
  message.pose.stamp = step.stamp;
  message.pose.x_y_yaw = step.odometry.T_odom_base->vector().cast<float>();
  if (step.planar_covariance) {
    FilterMatrix<float, 3> covariance =
        (variance_scale(step.odometry.match) * *step.planar_covariance).cast<float>();
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < row; ++column) covariance(row, column) = covariance(column, row);
    message.pose.covariance = covariance;
  }
  return message;
}

HeightMessage height_message(const HeightEstimate& height) {
  HeightMessage message;
  message.height = {height.stamp, static_cast<float>(height.height_m),
                    static_cast<float>(height.height_std_m)};
  message.clearance_m = static_cast<float>(height.clearance_m);
  return message;
}

constexpr double kJump_m = 0.1, kJump_rad = 0.05;

/// Whether a place that was searched for lies so far from the prediction that the way there is no motion.
bool jumps(const OdometryStep& odometry) {
  if (odometry.status != OdometryStatus::kFound || !odometry.T_odom_base) return false;
  const SE2 jump = odometry.T_odom_base_predicted.inverse() * *odometry.T_odom_base;
  return jump.translation().norm() > kJump_m || std::abs(jump.angle()) > kJump_rad;
}

}  // namespace

OnboardComputer::OnboardComputer(const LaserParameters& params, const LaserPlatform& platform,
                                 Duration perception, double hull_m, FlightObserver* observer)
    : perception_(params, platform),
      rig_(platform.rigs.front()),
      delay_(perception),
      hull_m_(hull_m),
      observer_(observer) {}

void OnboardComputer::add_scan(const Received<LaserScan>& scan) {
  if (observer_ != nullptr) observer_->on_scan(scan);
  ++scans_.in;
  sweep_ = scan.measured.stamp_of(scan.measured.size() - 1) - scan.measured.stamp;
  perception_.add_scan(scan.measured);
  process(scan.at);
  send_obstacles(scan);
}

/// Needs the core's tilt and height, not a pose: also where scan matching finds none.
void OnboardComputer::send_obstacles(const Received<LaserScan>& scan) {
  if (!state_) return;
  const Vec3& angles = state_->roll_pitch_yaw_rad;
  const HullPose hull{angles.x(), angles.y(), state_->position_m.z(), hull_m_};
  const Time middle = scan.measured.stamp_of(scan.measured.size() / 2);
  outbox_.push_back({scan.at + delay_, ObstacleMessage{middle, free_distances(scan.measured, rig_, hull)}});
}

FlightCommand in_odom(const FlightCommand& command, const SE2& T_map_odom) {
  if (command.kind != CommandKind::kGoTo && command.kind != CommandKind::kPath) return command;
  FlightCommand result = command;
  const SE2 T_odom_map = T_map_odom.inverse();
  const auto turned = [&](const Vec3f& v) -> Eigen::Vector2f {
    return (T_odom_map.rotation() * v.head<2>().cast<double>()).cast<float>();
  };
  result.position_m.head<2>() =
      (T_odom_map * Vec2(command.position_m.head<2>().cast<double>())).cast<float>();
  result.velocity_m_s.head<2>() = turned(command.velocity_m_s);
  result.acceleration_m_s2.head<2>() = turned(command.acceleration_m_s2);
  result.yaw_rad = static_cast<float>(wrap_angle(static_cast<double>(command.yaw_rad) + T_odom_map.angle()));
  return result;
}

void OnboardComputer::add_command(const FlightCommand& command) {
  outbox_.push_back({Time{INT64_MIN}, in_odom(command, T_map_odom_)});
}

void OnboardComputer::add(Time now, const DownMessage& message) {
  if (const auto* sample = std::get_if<ImuSample>(&message)) return add_imu(now, *sample);
  if (const auto* state = std::get_if<StateMessage>(&message)) return add_state(now, *state);
  const auto& answer = std::get<TimeAnswer>(message);
  sync_.add(answer.sent, answer.remote, now);
}

/// A plausible stamp of the board on the computer's clock.
std::optional<Time> OnboardComputer::on_computer(Time now, Time remote) const {
  const std::optional<Time> stamp = sync_.to_local(remote);
  if (!stamp || now - *stamp > kMostImuAge || now - *stamp < kLeastImuAge) return std::nullopt;
  return stamp;
}

void OnboardComputer::add_state(Time now, const StateMessage& state) {
  const std::optional<Time> stamp = on_computer(now, state.stamp);
  if (!stamp) return;
  state_ = state;
  perception_.add_odometry(
      {*stamp, SE3(rotation_from_roll_pitch_yaw(state.roll_pitch_yaw_rad), state.position_m)});
  process(now);
}

void OnboardComputer::add_imu(Time now, const ImuSample& sample) {
  ++imu_.in;
  const std::optional<Time> stamp = on_computer(now, sample.stamp);
  if (!stamp) {
    ++imu_.dropped;
    return;
  }
  ++imu_.out;
  Received<ImuSample> received{now, sample};
  received.measured.stamp = *stamp;
  if (observer_ != nullptr) observer_->on_imu(received);
  perception_.add_imu(received.measured);
  process(now);
}

void OnboardComputer::process(Time now) {
  for (const LaserStep& step : perception_.take_steps()) {
    if (observer_ != nullptr) observer_->on_laser_step(step);
    if (step.matched_scan) T_map_odom_ = step.map_frame.T_map_odom;
    send_results(step, now + delay_);
  }
}

/// Scan matching that begins anew at a predicted pose, or takes the few points that pair by chance, goes on
/// with poses as smooth as before, though their sensor may have turned on its mounting: the motion they show
/// is then turned too, and position control on them spirals outwards. Such poses are not sent until the place
/// is found in earlier scans, or the vehicle stands on the ground.
void OnboardComputer::judge_tracking(const LaserStep& step) {
  const OdometryStep& odometry = step.odometry;
  const bool poorly_paired =
      odometry.status == OdometryStatus::kTracking && odometry.searched &&
      static_cast<double>(odometry.match.pairs) <
          ScanOdometryParams::kFindMinPairsRatio * static_cast<double>(odometry.match.sensed_points);
  const bool standing = stands(step);
  if (odometry.status == OdometryStatus::kRestarted || poorly_paired) tracking_lost_ = true;
  const bool was_lost = tracking_lost_;
  if (odometry.status == OdometryStatus::kFound || standing) tracking_lost_ = false;
  if ((was_lost && !tracking_lost_) || (!was_lost && jumps(odometry))) ++restarts_;
}

/// Whether the vehicle has stood on the ground for kStandingFor, by the last height.
bool OnboardComputer::stands(const LaserStep& step) {
  if (!step.height || step.height->status != HeightStatus::kOk) return false;
  if (step.height->clearance_m > kBaseOverGround_m + kStanding_m)
    standing_since_.reset();
  else if (!standing_since_)
    standing_since_ = step.height->stamp;
  return standing_since_ && step.height->stamp - *standing_since_ > kStandingFor;
}

void OnboardComputer::send_results(const LaserStep& step, Time ready) {
  if (step.matched_scan) judge_tracking(step);
  const bool posed = step.matched_scan && step.odometry.T_odom_base && !tracking_lost_;
  ++(posed ? scans_.out : scans_.dropped);
  if (posed) {
    PoseMessage message = pose_message(step);
    message.restarts = restarts_;
    message.scan_end = step.scan_stamp + sweep_;
    outbox_.push_back({ready, message});
  }
  if (step.height && step.height->status == HeightStatus::kOk)
    outbox_.push_back({ready, height_message(*step.height)});
}

std::vector<UpMessage> OnboardComputer::take_messages(Time now) {
  std::vector<UpMessage> messages;
  std::erase_if(outbox_, [&](Pending& pending) {
    if (pending.ready > now) return false;
    if (auto* pose = std::get_if<PoseMessage>(&pending.message)) {
      scan_to_pose_s_.add((now - pose->scan_end).seconds());
      pose->pose.stamp = on_board(pose->pose.stamp);
    }
    if (auto* height = std::get_if<HeightMessage>(&pending.message))
      height->height.stamp = on_board(height->height.stamp);
    if (auto* obstacle = std::get_if<ObstacleMessage>(&pending.message))
      obstacle->stamp = on_board(obstacle->stamp);
    messages.push_back(std::move(pending.message));
    return true;
  });
  if (is_due(sync_sent_, kSyncPeriod, now)) messages.emplace_back(TimeQuestion{now});
  if (is_due(life_sent_, kLifePeriod, now)) messages.emplace_back(std::monostate{});
  return messages;
}

void OnboardComputer::finish() {
  perception_.finish();
  for (const LaserStep& step : perception_.take_steps())
    if (observer_ != nullptr) observer_->on_laser_step(step);
}

std::vector<StageCounts> OnboardComputer::counts() const { return {imu_, scans_}; }

}  // namespace hm
