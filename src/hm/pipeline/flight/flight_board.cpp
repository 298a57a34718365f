#include "hm/pipeline/flight/flight_board.hpp"

#include <algorithm>
#include <cmath>

#include "hm/sim/motion/flight.hpp"

namespace hm {
namespace {

template <class T>
void enqueue(std::deque<T>& queue, T value, StageCounts& counts) {
  ++counts.in;
  queue.push_back(std::move(value));
  if (queue.size() <= FlightBoard::kWaiting) return;
  queue.pop_front();
  ++counts.dropped;
}

template <class T>
std::optional<T> dequeue(std::deque<T>& queue, StageCounts& counts) {
  if (queue.empty()) return std::nullopt;
  T value = std::move(queue.front());
  queue.pop_front();
  ++counts.out;
  return value;
}

InertialReading<float> reading_of(const ImuSample& sample) {
  InertialReading<float> reading;
  reading.stamp = sample.stamp;
  reading.angular_velocity_rad_s = sample.angular_velocity_rad_s.cast<float>();
  reading.specific_force_m_s2 = sample.specific_force_m_s2.cast<float>();
  if (sample.R_world_imu) reading.R_world_imu = sample.R_world_imu->cast<float>();
  return reading;
}

/// Mean of samples, with stamp and orientation of the last.
ImuSample mean_of(const std::vector<ImuSample>& samples) {
  ImuSample mean = samples.back();
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    mean.angular_velocity_rad_s += samples[i].angular_velocity_rad_s;
    mean.specific_force_m_s2 += samples[i].specific_force_m_s2;
  }
  mean.angular_velocity_rad_s /= static_cast<double>(samples.size());
  mean.specific_force_m_s2 /= static_cast<double>(samples.size());
  return mean;
}

}  // namespace

FlightBoard::FlightBoard(std::unique_ptr<FlightCore> core, double imu_down_hz, FlightObserver* observer)
    : core_(std::move(core)),
      observer_(observer),
      imu_period_(std::max(1, static_cast<int>(std::lround(1000 / imu_down_hz)))) {}

void FlightBoard::receive(Time now, const UpMessage& message) {
  heard_ = true;
  if (const auto* pose = std::get_if<PoseMessage>(&message)) {
    enqueue(poses_, {now, *pose}, measured_);
    if (observer_ != nullptr) observer_->on_pose({now, *pose});
  } else if (const auto* height = std::get_if<HeightMessage>(&message)) {
    enqueue(heights_, {now, *height}, measured_);
    if (observer_ != nullptr) observer_->on_height({now, *height});
  } else if (const auto* obstacles = std::get_if<ObstacleMessage>(&message)) {
    obstacles_ = *obstacles;
    if (observer_ != nullptr) observer_->on_obstacles({now, *obstacles});
  } else if (const auto* command = std::get_if<FlightCommand>(&message)) {
    enqueue(commands_, *command, commanded_);
  } else if (const auto* question = std::get_if<TimeQuestion>(&message)) {
    questions_.push_back(*question);
  }
}

/// Distance of the first obstacle on the way that the vehicle flies, less what it flew since the scan. Only
/// where a pilot steers by velocity or attitude: whoever gives goals knows how near to things they are.
std::optional<float> FlightBoard::obstacle_ahead_m(Time now) const {
  const bool steered = outputs_.phase == FlightPhase::kVelocity || outputs_.phase == FlightPhase::kDirect;
  if (!steered || !obstacles_ || now - obstacles_->stamp > kObstaclesValid) return std::nullopt;
  const BasicVehicleState<float> estimate = core_->estimate();
  const float speed_m_s = norm_f(estimate.velocity_m_s.x(), estimate.velocity_m_s.y());
  if (!(speed_m_s > kLeastSpeed_m_s)) return std::nullopt;
  const float course_rad = atan2_f(estimate.velocity_m_s.y(), estimate.velocity_m_s.x());
  const auto free_m =
      obstacles_->free.towards(static_cast<double>(course_rad - estimate.roll_pitch_yaw_rad.z()));
  if (!free_m) return std::nullopt;
  const float flown_m = speed_m_s * static_cast<float>((now - obstacles_->stamp).seconds());
  return max_f(static_cast<float>(*free_m) - flown_m, 0);
}

AutopilotInputs FlightBoard::gather(const BoardReadings& readings) {
  AutopilotInputs inputs;
  inputs.now = readings.now;
  inputs.motors_on = readings.motors_on;
  inputs.battery_ratio = readings.battery_ratio;
  inputs.computer_alive = std::exchange(heard_, false);
  if (readings.imu) inputs.imu = reading_of(*readings.imu);
  if (const auto pose = dequeue(poses_, measured_)) {
    inputs.pose = pose->measured.pose;
    core_->note_restarts(pose->measured.restarts);
    inputs.pose->stamp = inputs.pose->stamp - readings.clock_step;
    pose_age_s_.add((readings.now - inputs.pose->stamp).seconds());
    scan_to_core_s_.add((readings.now - pose->measured.scan_end).seconds());
  }
  if (const auto height = dequeue(heights_, measured_)) {
    inputs.height = height->measured.height;
    inputs.height->stamp = inputs.height->stamp - readings.clock_step;
    clearance_ = height;
  }
  if (clearance_ && readings.now - clearance_->at < kClearanceValid)
    inputs.clearance_m = clearance_->measured.clearance_m - static_cast<float>(kBaseOverGround_m);
  inputs.obstacle_m = obstacle_ahead_m(readings.now + readings.clock_step);
  inputs.command = dequeue(commands_, commanded_);
  return inputs;
}

void FlightBoard::pass_on(const BoardReadings& readings) {
  if (readings.imu) imu_.push_back(*readings.imu);
  if (imu_.size() >= static_cast<std::size_t>(imu_period_)) {
    outbox_.emplace_back(mean_of(imu_));
    imu_.clear();
    const BasicVehicleState<float> estimate = core_->estimate();
    // From the first on, while there is no pose yet too: perception waits for it.
    outbox_.emplace_back(StateMessage{estimate.stamp + readings.clock_step,
                                      estimate.position_m.cast<double>(),
                                      estimate.roll_pitch_yaw_rad.cast<double>()});
  }
  for (const TimeQuestion& question : questions_)
    outbox_.emplace_back(TimeAnswer{question.sent, readings.now + readings.clock_step});
  questions_.clear();
}

const AutopilotOutputs& FlightBoard::step(const BoardReadings& readings) {
  const AutopilotInputs inputs = gather(readings);
  outputs_ = core_->step(inputs);
  answer_.reset();
  if (inputs.command) {
    answer_ = CommandAnswer{*inputs.command, outputs_.refusal};
    if (outputs_.refusal != Refusal::kNone) ++commanded_.dropped;
  }
  if (observer_ != nullptr) observer_->on_core_step(recorder_.step(inputs, outputs_, core_->estimate()));
  pass_on(readings);
  return outputs_;
}

std::vector<StageCounts> FlightBoard::counts() const { return {measured_, commanded_}; }

}  // namespace hm
