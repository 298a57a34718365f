#include "hm/pipeline/flight/testing/fail_safe_provocation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "hm/sim/sensor/laser_sensor.hpp"

namespace hm {
namespace {

constexpr double kProvoked_s = 7;  ///< since the start
constexpr double kLongestFlight_s = 45;
constexpr double kBatteryPerMetre = 0.001;  ///< charge that a metre of the way home takes
constexpr double kStart_s = 1;              ///< stamp of a flight's first moment

std::size_t index_of(FailSafe which) { return static_cast<std::size_t>(which); }

void narrow_fence(FlightRunParams& params) { params.autopilot.guidance.fence_radius_m = 1; }

/// When each fail-safe must act: the first step at which its condition has lasted for its time-out.
/// Conditions are those of the table, on the inputs and the estimate of the core; the first time of each is
/// kept.
class DueTimes {
 public:
  explicit DueTimes(const AutopilotParams& params) : params_(params), limits_(params.fail_safes) {}

  /// Takes a step: its inputs, whether they hold a pose that is wrong, and the core before and after it.
  void note(const AutopilotInputs& in, bool wrong_pose, AutopilotState state_before, FlightPhase phase_before,
            const CascadeOutput& flown, const Vec3f& stop_m, const Autopilot& core) {
    now_s_ = in.now.seconds();
    take(in, wrong_pose, core);
    if (!in_air(state_before)) {
      lasting_s_.fill(kNever);
      if (phase_before == FlightPhase::kGround) home_m_ = core.estimate().position_m;
      return;
    }
    note_ages(phase_before);
    note_place(in, core, stop_m, phase_before);
    note_vehicle(core, flown);
  }
  [[nodiscard]] double due_s(FailSafe which) const { return due_s_[index_of(which)]; }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  void take(const AutopilotInputs& in, bool wrong_pose, const Autopilot& core) {
    if (in.pose && !wrong_pose) pose_s_ = in.pose->stamp.seconds();
    if (in.pose && wrong_pose) refused_s_ = std::min(refused_s_, now_s_);
    if (in.height) height_s_ = in.height->stamp.seconds();
    if (in.imu && (!last_imu_ || in.imu->angular_velocity_rad_s != last_imu_->angular_velocity_rad_s ||
                   in.imu->specific_force_m_s2 != last_imu_->specific_force_m_s2))
      imu_s_ = now_s_;
    if (in.imu) last_imu_ = in.imu;
    if (in.computer_alive) computer_s_ = now_s_;
    if (in.battery_ratio) battery_ratio_ = static_cast<double>(*in.battery_ratio);
    if (!in.command) return;
    const FlightCommand& command = *in.command;
    pilot_s_ = command.stamp.seconds();
    if (command.kind == CommandKind::kEStop) acts(FailSafe::kEStop, now_s_);
    if (core.outputs().refusal != Refusal::kNone) return;
    if (command.kind == CommandKind::kMode) set_point_s_ = now_s_;
    if (command.kind == CommandKind::kVelocity || command.kind == CommandKind::kDirect)
      set_point_s_ = pilot_s_;
  }

  void acts(FailSafe which, double at_s) {
    due_s_[index_of(which)] = std::min(due_s_[index_of(which)], at_s);
  }
  void aged(FailSafe which, double since_s, float after_s) {
    const double due_s =
        since_s + std::round(1e6 * static_cast<double>(after_s)) * 1e-6;  // as it was written
    if (now_s_ >= due_s - 1e-7) acts(which, due_s);
  }
  void lasts(FailSafe which, bool condition, float after_s) {
    double& since_s = lasting_s_[index_of(which)];
    since_s = condition ? std::min(since_s, now_s_) : kNever;
    if (condition) aged(which, since_s, after_s);
  }

  void note_ages(FlightPhase phase) {
    aged(FailSafe::kPoseStale, pose_s_, limits_.pose_stale_s);
    aged(FailSafe::kPoseLost, pose_s_, limits_.pose_lost_s);
    aged(FailSafe::kPoseRefused, refused_s_, limits_.pose_refused_s);
    aged(FailSafe::kHeightStale, height_s_, limits_.height_stale_s);
    aged(FailSafe::kImuGap, imu_s_, limits_.imu_gap_s);
    aged(FailSafe::kImuLost, imu_s_, limits_.imu_lost_s);
    aged(FailSafe::kComputerSilent, computer_s_, limits_.computer_silent_s);
    aged(FailSafe::kPilotLost, pilot_s_, limits_.pilot_lost_s);
    aged(FailSafe::kPilotGone, pilot_s_, limits_.pilot_gone_s);
    if (phase == FlightPhase::kVelocity)
      aged(FailSafe::kSetpointStale, set_point_s_, limits_.velocity_stale_s);
    if (phase == FlightPhase::kDirect) aged(FailSafe::kSetpointStale, set_point_s_, limits_.direct_stale_s);
  }

  [[nodiscard]] float outside_m(const Vec3f& position_m) const {
    const Vec3f from_home = position_m - home_m_;
    return std::max({0.0F, std::hypot(from_home.x(), from_home.y()) - params_.guidance.fence_radius_m,
                     from_home.z() - params_.guidance.fence_height_m});
  }

  void note_place(const AutopilotInputs& in, const Autopilot& core, const Vec3f& stop_m, FlightPhase phase) {
    const Vec3f& position_m = core.estimate().position_m;
    if (phase != FlightPhase::kTakeOff && outside_m(stop_m) > 0) acts(FailSafe::kFenceAhead, now_s_);
    if (outside_m(position_m) >= limits_.fence_return_m) acts(FailSafe::kFenceLeft, now_s_);
    if (outside_m(position_m) >= limits_.fence_land_m) acts(FailSafe::kFenceFarOutside, now_s_);
    const float stopping_m = (stop_m - position_m).norm();
    if (in.obstacle_m && *in.obstacle_m <= stopping_m + limits_.obstacle_margin_m)
      acts(FailSafe::kObstacleAhead, now_s_);
  }

  void note_vehicle(const Autopilot& core, const CascadeOutput& flown) {
    const BasicVehicleState<float>& state = core.estimate();
    const double empty = static_cast<double>(limits_.battery_empty_ratio);
    const double home = kBatteryPerMetre * static_cast<double>(core.guidance().way_home_m(state.position_m));
    lasts(FailSafe::kBatteryForReturn, battery_ratio_ < empty + home, limits_.battery_after_s);
    lasts(FailSafe::kBatteryEmpty, battery_ratio_ < empty, limits_.battery_after_s);
    lasts(FailSafe::kNoLift, flown.thrust_limited && state.velocity_m_s.z() < -limits_.no_lift_sink_m_s,
          limits_.no_lift_s);
    const Vec3f& angles = state.roll_pitch_yaw_rad;
    const float tilt_rad = std::acos(std::clamp(std::cos(angles.x()) * std::cos(angles.y()), -1.0F, 1.0F));
    lasts(FailSafe::kOverturned, tilt_rad > limits_.overturned_rad, limits_.overturned_s);
    lasts(FailSafe::kUncontrolled, tilt_error_rad(angles, flown) > limits_.uncontrolled_rad,
          limits_.uncontrolled_s);
    const std::optional<float>& mismatch = core.outputs().tilt_mismatch_rad;
    lasts(FailSafe::kTiltMismatch, mismatch && std::abs(*mismatch) > limits_.tilt_mismatch_rad,
          limits_.tilt_mismatch_s);
  }

  static float tilt_error_rad(const Vec3f& roll_pitch_yaw_rad, const CascadeOutput& flown) {
    const Vec3f& wanted = flown.specific_force_m_s2;
    if (wanted.norm() < 1) return 0;
    const Vec3f up = Eigen::AngleAxisf(roll_pitch_yaw_rad.z(), Vec3f::UnitZ()) *
                     (Eigen::AngleAxisf(roll_pitch_yaw_rad.y(), Vec3f::UnitY()) *
                      (Eigen::AngleAxisf(roll_pitch_yaw_rad.x(), Vec3f::UnitX()) * Vec3f::UnitZ()));
    return std::acos(std::clamp(up.dot(wanted.normalized()), -1.0F, 1.0F));
  }

  AutopilotParams params_;
  FailSafeParams limits_;
  std::array<double, kFailSafeCount> due_s_ = never(), lasting_s_ = never();
  double now_s_ = 0, pose_s_ = kNever, refused_s_ = kNever, height_s_ = kNever, imu_s_ = kNever,
         computer_s_ = kNever, pilot_s_ = kNever, set_point_s_ = kNever, battery_ratio_ = 1;
  std::optional<InertialReading<float>> last_imu_;
  Vec3f home_m_ = Vec3f::Zero();

  static std::array<double, kFailSafeCount> never() {
    std::array<double, kFailSafeCount> all{};
    all.fill(kNever);
    return all;
  }
};

/// Fail-safes observed in a flight.
struct Observed {
  explicit Observed(const AutopilotParams& params) : due(params) {}
  DueTimes due;
  std::array<std::optional<double>, kFailSafeCount> acted_s{};
};

/// The autopilot of this host, with poses as they are told to be, and an observer of its steps.
class ObservedCore : public FlightCore {
 public:
  ObservedCore(const AutopilotParams& params, Poses poses, Observed& observed)
      : autopilot_(std::make_unique<Autopilot>(params)), poses_(poses), observed_(observed) {}

  AutopilotOutputs step(const AutopilotInputs& given) override {
    AutopilotInputs inputs = given;
    const bool wrong_pose = inputs.pose && spoil(*inputs.pose, inputs.now);
    const AutopilotState state = autopilot_->machine().state();
    const FlightPhase phase = autopilot_->machine().phase();
    const CascadeOutput flown = autopilot_->cascade().output();
    const Vec3f stop_m = autopilot_->cascade().stopping_point();
    const AutopilotOutputs& outputs = autopilot_->step(inputs);
    observed_.due.note(inputs, wrong_pose, state, phase, flown, stop_m, *autopilot_);
    for (std::size_t i = 0; i < kFailSafeCount; ++i)
      if (!observed_.acted_s[i] && outputs.safety.has(static_cast<FailSafe>(i)))
        observed_.acted_s[i] = inputs.now.seconds();
    return outputs;
  }
  [[nodiscard]] BasicVehicleState<float> estimate() const override { return autopilot_->estimate(); }

 private:
  /// Shifts a pose by 0.4 m or turns it by 90 degrees about the place where this began.
  bool spoil(PoseReading<float>& pose, Time now) {
    if (poses_ == Poses::kGood || now.seconds() - kStart_s < kProvoked_s) return false;
    if (!centre_) centre_ = pose.x_y_yaw;
    const Vec3f from_centre = pose.x_y_yaw - *centre_;
    if (poses_ == Poses::kShifted)
      pose.x_y_yaw.x() += 0.4F;
    else
      pose.x_y_yaw = *centre_ + Vec3f(-from_centre.y(), from_centre.x(), from_centre.z());
    return true;
  }

  std::unique_ptr<Autopilot> autopilot_;
  Poses poses_;
  Observed& observed_;
  std::optional<Vec3f> centre_;
};

/// Takes off, then does what a provocation asks for.
class ProvokingPilot {
 public:
  explicit ProvokingPilot(ProvokingBehaviour pilot) : pilot_(pilot) {}

  std::optional<FlightCommand> step(const FlightMoment& moment, double elapsed_s) {
    const AutopilotState state = moment.autopilot.state;
    if (!took_off_) {
      took_off_ = state == AutopilotState::kFlying;
      if (state == AutopilotState::kOff && elapsed_s < kProvoked_s)
        return every(1, elapsed_s, of(CommandKind::kToggleEngage), moment);
      if (state == AutopilotState::kIdle) return every(0.2, elapsed_s, of(CommandKind::kTakeOff), moment);
      return {};
    }
    if (elapsed_s < kProvoked_s || pilot_ == ProvokingBehaviour::kHovers)
      return every(0.2, elapsed_s, of(CommandKind::kSignOfLife), moment);
    if (pilot_ == ProvokingBehaviour::kFallsSilent) return {};
    if (pilot_ == ProvokingBehaviour::kEStops) return every(1, elapsed_s, of(CommandKind::kEStop), moment);
    if (pilot_ == ProvokingBehaviour::kFliesAway) return fly_away(moment, elapsed_s);
    return steer(moment, elapsed_s);
  }

 private:
  static FlightCommand of(CommandKind kind) {
    FlightCommand command;
    command.kind = kind;
    return command;
  }
  std::optional<FlightCommand> every(double period_s, double elapsed_s, FlightCommand command,
                                     const FlightMoment& moment) {
    if (elapsed_s - sent_s_ < period_s - 1e-9) return {};
    sent_s_ = elapsed_s;
    command.stamp = moment.stamp;
    command.pilot = 1;
    return command;
  }
  std::optional<FlightCommand> fly_away(const FlightMoment& moment, double elapsed_s) {
    FlightCommand command = of(CommandKind::kSignOfLife);
    if (!sent_goal_) {
      command = of(CommandKind::kGoTo);
      command.position_m = {1, 0, 1.4F};
    }
    const auto sent = every(0.2, elapsed_s, command, moment);
    sent_goal_ = sent_goal_ || sent;
    return sent;
  }
  /// Forward by velocity or attitude, long enough to come to a wall; those that stop do so after a second.
  std::optional<FlightCommand> steer(const FlightMoment& moment, double elapsed_s) {
    const bool stops =
        pilot_ == ProvokingBehaviour::kStopsVelocity || pilot_ == ProvokingBehaviour::kStopsDirect;
    const bool by_velocity =
        pilot_ == ProvokingBehaviour::kStopsVelocity || pilot_ == ProvokingBehaviour::kForwardByVelocity;
    const FlightPhase mode = by_velocity ? FlightPhase::kVelocity : FlightPhase::kDirect;
    entered_ = entered_ || moment.autopilot.phase == mode;
    const double commands_s = stops ? 1 : 14;
    const bool over = entered_ && (moment.autopilot.phase != mode || elapsed_s > kProvoked_s + commands_s);
    if (over || stopped_) {
      stopped_ = true;
      return every(0.2, elapsed_s, of(CommandKind::kSignOfLife), moment);
    }
    FlightCommand command = of(by_velocity ? CommandKind::kVelocity : CommandKind::kDirect);
    if (!entered_) {
      command = of(CommandKind::kMode);
      command.mode = mode;
    }
    command.velocity_m_s = {stops ? 0.2F : 0.6F, 0, 0};
    // Fast enough to leave the fence, slow enough to stop within a metre; keeps height and line, as a pilot
    // does by sight.
    const Vec3 seen_m_s = moment.truth.T_world_base.rotation().inverse() * moment.truth.velocity_world_m_s;
    command.pitch_rad = stops ? 0.0F : 0.05F;
    command.roll_rad = std::clamp(0.2F * static_cast<float>(seen_m_s.y()), -0.07F, 0.07F);
    const auto climb_m_s = static_cast<float>(moment.truth.velocity_world_m_s.z());
    command.thrust_ratio = std::clamp(0.485F - 0.1F * climb_m_s, 0.4F, 0.6F);
    return every(entered_ ? 0.05 : 0.2, elapsed_s, command, moment);
  }

  ProvokingBehaviour pilot_;
  bool took_off_ = false, sent_goal_ = false, entered_ = false, stopped_ = false;
  double sent_s_ = -1;
};

bool has_ended(const Provocation& provocation, const FlightMoment& moment, double elapsed_s, double acted_s) {
  switch (provocation.end) {
    case ProvokedEnd::kLands:
    case ProvokedEnd::kFalls:
      return moment.autopilot.state == AutopilotState::kIdle ||
             moment.autopilot.state == AutopilotState::kOff;
    case ProvokedEnd::kHolds:
      return moment.autopilot.phase == FlightPhase::kHold && elapsed_s > acted_s + 3;
    case ProvokedEnd::kCuts:
      return moment.autopilot.state == AutopilotState::kError;
  }
  return false;
}

/// When the fail-safe acted that decides the end.
std::optional<double> decision_s(const Provocation& provocation, const Observed& observed) {
  if (!provocation.first_decides) return observed.acted_s[index_of(provocation.judged.back())];
  std::optional<double> first_s;
  for (const FailSafe which : provocation.judged) {
    const std::optional<double>& acted_s = observed.acted_s[index_of(which)];
    if (acted_s && (!first_s || *acted_s < *first_s)) first_s = acted_s;
  }
  return first_s;
}

/// Steps of 1 ms between an action and the moment at which it was due; infinite if there was only one of
/// them. Where there was neither: 0 if the fail-safe `may_rest`.
double off_steps(const Observed& observed, FailSafe which, bool may_rest) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const std::optional<double>& acted_s = observed.acted_s[index_of(which)];
  const double due_s = observed.due.due_s(which);
  if (!acted_s) return may_rest && due_s == kNever ? 0 : kNever;
  return 1e3 * std::abs(*acted_s - due_s);
}

}  // namespace

std::vector<Provocation> fail_safe_provocations() {
  using F = FailSafe;
  return {
      {"laser off",
       "fault laser_off at 7 for 60",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kLands,
       {F::kPoseStale, F::kHeightStale, F::kPoseLost}},
      {"link cut",
       "fault link_cut at 7 for 60",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kLands,
       {F::kPoseStale, F::kPoseLost, F::kComputerSilent}},
      {"poses shifted",
       "",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kLands,
       {F::kPoseRefused},
       nullptr,
       Poses::kShifted},
      {"poses turned",
       "",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kLands,
       {F::kTiltMismatch},
       nullptr,
       Poses::kTurned},
      {"IMU gap",
       "fault imu_gap at 7 for 0.05",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kHolds,
       {F::kImuGap}},
      {"IMU off",
       "fault imu_gap at 7 for 60",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kCuts,
       {F::kImuGap, F::kImuLost}},
      {"IMU stuck",
       "fault imu_stuck at 7 for 60",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kCuts,
       {F::kImuGap, F::kImuLost}},
      {"motor lost",
       "fault motor_lost at 7 for 60",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kCuts,
       {F::kOverturned, F::kUncontrolled},
       nullptr,
       Poses::kGood,
       true},
      {"velocity stops", "", ProvokingBehaviour::kStopsVelocity, ProvokedEnd::kHolds, {F::kSetpointStale}},
      {"attitude stops", "", ProvokingBehaviour::kStopsDirect, ProvokedEnd::kHolds, {F::kSetpointStale}},
      {"pilot silent",
       "",
       ProvokingBehaviour::kFallsSilent,
       ProvokedEnd::kLands,
       {F::kPilotLost, F::kPilotGone}},
      {"charge for the way home",
       "",
       ProvokingBehaviour::kFliesAway,
       ProvokedEnd::kLands,
       {F::kBatteryForReturn},
       [](FlightRunParams& params) {
         params.vehicle.battery.initial_charge_ratio = 0.908;
         params.autopilot.fail_safes.battery_empty_ratio = 0.9F;
       }},
      {"cell lost",
       "fault cell_lost at 7 for 60",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kLands,
       {F::kBatteryForReturn, F::kBatteryEmpty}},
      {"velocity to the fence",
       "",
       ProvokingBehaviour::kForwardByVelocity,
       ProvokedEnd::kHolds,
       {F::kFenceAhead},
       narrow_fence},
      {"attitude over the fence",
       "",
       ProvokingBehaviour::kForwardByAttitude,
       ProvokedEnd::kHolds,
       {F::kFenceLeft},
       narrow_fence},
      {"far over the fence",
       "",
       ProvokingBehaviour::kForwardByAttitude,
       ProvokedEnd::kLands,
       {F::kFenceLeft, F::kFenceFarOutside},
       [](FlightRunParams& params) {
         narrow_fence(params);
         params.autopilot.fail_safes.fence_land_m = 0.3F;
       }},
      {"velocity to a wall",
       "",
       ProvokingBehaviour::kForwardByVelocity,
       ProvokedEnd::kHolds,
       {F::kObstacleAhead}},
      {"no lift",
       "fault cell_lost at 7 for 60",
       ProvokingBehaviour::kHovers,
       ProvokedEnd::kFalls,
       {F::kNoLift},
       [](FlightRunParams& params) {
         params.vehicle.rotor.speed_governed = false;
         params.vehicle.battery.initial_charge_ratio = 0.3;
         params.autopilot.fail_safes.battery_after_s = 60;  // the battery's own fail-safe would land it
       }},
      {"emergency stop", "", ProvokingBehaviour::kEStops, ProvokedEnd::kCuts, {F::kEStop}},
  };
}

ProvocationOutcome provoke(const FlightSite& site, const Provocation& provocation, int seed) {
  FlightRunParams params;
  params.run.seed = seed;
  params.run.start_x_m = 4, params.run.start_y_m = 3;  // in the largest room
  if (provocation.change != nullptr) provocation.change(params);
  const AutopilotParams core =
      core_aboard(params, city_flyer_rig(static_cast<std::size_t>(params.laser.beams)));
  Observed observed(core);
  FlightRun run(site, params, FaultSchedule::parse(provocation.faults, "faults").value(), nullptr,
                std::make_unique<ObservedCore>(core, provocation.poses, observed));
  ProvokingPilot pilot(provocation.pilot);
  ProvocationOutcome outcome;
  while (run.elapsed().seconds() < kLongestFlight_s && !outcome.ended_well) {
    const double elapsed_s = run.elapsed().seconds();
    run.step(pilot.step(run.moment(), elapsed_s));
    const std::optional<double> decided_s = decision_s(provocation, observed);
    outcome.ended_well = decided_s && has_ended(provocation, run.moment(), elapsed_s, *decided_s - kStart_s);
  }
  const bool may_rest = provocation.first_decides && decision_s(provocation, observed);
  for (const FailSafe which : provocation.judged)
    outcome.off_steps.push_back(off_steps(observed, which, may_rest));
  outcome.collisions = run.collisions().size();
  return outcome;
}

}  // namespace hm
