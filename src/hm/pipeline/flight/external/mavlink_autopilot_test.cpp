#include "hm/pipeline/flight/external/mavlink_autopilot.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <string>
#include <thread>

#include "hm/link/mavlink_key.hpp"
#include "hm/link/testing/pipe_transport.hpp"
#include "hm/link/transport/udp_socket.hpp"
#include "hm/pipeline/flight/flight_run.hpp"
#include "hm/pipeline/flight/mission/flight_log.hpp"
#include "hm/pipeline/flight/script_pilot.hpp"

namespace hm {
namespace {

/// An autopilot of its own behind MAVLink, which knows nothing but its messages: HIL_SENSOR and ODOMETRY in,
/// HIL_ACTUATOR_CONTROLS out. Either by the rules of PX4: ODOMETRY in LOCAL_FRD and BODY_FRD of the type
/// VISION, offboard mode (custom mode 6) after a second of set-points, arming in offboard mode, climbing to
/// the set-point. Or by those of ArduPilot: an estimate only after SET_GPS_GLOBAL_ORIGIN, guided mode (4) and
/// arming only with a position, climbing only when told to take off. The first order to arm gets lost, the
/// second is refused with a reason in words.
class PeerAutopilot {
 public:
  PeerAutopilot(UdpSocket& socket, MavAutopilot kind)
      : socket_(socket), kind_(kind), peer_(socket, options(kind)) {}

  static constexpr const char* kReason =
      "PreArm: Gyros inconsistent, calibrate or wait until they have settled";

  void run() {
    while (!stop) {
      if (!socket_.wait(Duration{5'000'000})) continue;
      peer_.step([this] { return now_; }, [this](const MavlinkFrame& frame) { receive(frame); });
    }
  }

  std::atomic<bool> stop = false;
  // Read when the thread has ended.
  std::uint64_t poses = 0, faulty_poses = 0, refused_early = 0, repeated_orders = 0, origins = 0;
  bool armed_in_offboard = false, told_to_take_off = false;
  double worst_clock_s = 0;

 private:
  static MavlinkPeerOptions options(MavAutopilot kind) {
    MavlinkPeerOptions options;
    options.address = {1, 1};
    options.heartbeat.type = kMavTypeQuadrotor;
    options.heartbeat.autopilot = kind;
    return options;
  }
  [[nodiscard]] bool is_px4() const { return kind_ == kMavAutopilotPx4; }

  void receive(const MavlinkFrame& frame) {
    if (const auto sensor = read_mavlink_message<MavHilSensor>(frame)) fly(*sensor);
    if (const auto pose = read_mavlink_message<MavOdometry>(frame)) take(*pose);
    if (const auto order = read_mavlink_message<MavCommandLong>(frame)) obey(*order, frame.from);
    if (const auto origin = read_mavlink_message<MavSetGpsGlobalOrigin>(frame))
      origins += origin->target_system == 1 && origin->latitude != 0 && origin->longitude != 0 ? 1U : 0U;
    if (const auto target = read_mavlink_message<MavSetPositionTargetLocalNed>(frame)) {
      if (!first_target_) first_target_ = now_;
      if (const auto point = from_position_target(*target, AutopilotWorld::kLocalFrd)) target_ = *point;
    }
  }

  void take(const MavOdometry& message) {
    ++poses;
    const auto state = from_odometry(message);
    if (!state || message.frame_id != kMavFrameLocalFrd || message.child_frame_id != kMavFrameBodyFrd ||
        message.estimator_type != kMavEstimatorVision) {
      ++faulty_poses;
      return;
    }
    if (!is_px4() && origins == 0) return;  // its estimator has not started
    const Vec3 p = state->T_odom_base.translation();
    const Mat3 R = state->T_odom_base.rotation();
    pose_.emplace();
    pose_->stamp = state->stamp;
    pose_->x_y_yaw = Vec3(p.x(), p.y(), std::atan2(R(1, 0), R(0, 0))).cast<float>();
    height_ = BasicHeightReading<float>{state->stamp, static_cast<float>(p.z()), {}};
  }

  std::uint8_t answer(const MavCommandLong& order) {
    switch (order.command) {
      case kMavCommandSetMode: {
        const bool streamed = first_target_ && now_ - *first_target_ >= Duration{1'000'000'000};
        const bool may = is_px4() ? streamed : core_.estimate().planar_ready;
        if (!may || order.param1 != 1 || order.param2 != (is_px4() ? 6 : 4)) {
          ++refused_early;
          return kMavDenied;
        }
        offboard_ = true;
        return kMavAccepted;
      }
      case kMavCommandTakeoff:
        if (is_px4() || !offboard_ || !is_on()) return kMavDenied;
        told_to_take_off = true;
        climb_m_ = order.param7;
        return kMavAccepted;
      case kMavCommandArmDisarm:
        if (order.param1 > 0 && !offboard_) return kMavDenied;
        if (order.param1 > 0 && !std::exchange(said_why_, true)) {
          peer_.send_text(kMavCritical, kReason);
          return kMavTemporarilyRejected;
        }
        armed_in_offboard = offboard_;
        if (is_on() != (order.param1 > 0)) give(CommandKind::kToggleEngage);
        return kMavAccepted;
      case kMavCommandLand:
        give(CommandKind::kLand);
        return kMavAccepted;
      default:
        return kMavAccepted;
    }
  }

  void obey(const MavCommandLong& order, MavlinkAddress from) {
    const bool arms = order.command == kMavCommandArmDisarm && order.param1 > 0;
    if (arms && !std::exchange(lost_, true)) return;
    repeated_orders += order.confirmation > 0 ? 1U : 0U;
    peer_.send(MavCommandAck{order.command, answer(order), 0, 0, from.system, from.component});
  }

  void give(CommandKind kind, const Vec3f& position = Vec3f::Zero(), float yaw_rad = 0) {
    command_.emplace();
    command_->kind = kind;
    command_->position_m = position;
    command_->yaw_rad = yaw_rad;
  }
  [[nodiscard]] bool is_on() const { return core_.outputs().state != AutopilotState::kOff; }

  /// Follows the position that offboard mode asks for.
  void follow_target() {
    if (!offboard_ || !target_.position_m || command_) return;
    const Vec3f goal = target_.position_m->cast<float>();
    const AutopilotOutputs& out = core_.outputs();
    const float up_m = goal.z() - core_.estimate().position_m.z();
    const bool climbs = is_px4() ? up_m > 0.2F : climb_m_ > 0;
    if (out.state == AutopilotState::kIdle && climbs && !landed_) {  // again until it is calibrated
      give(CommandKind::kTakeOff, {0, 0, is_px4() ? up_m : climb_m_});
    } else if (out.phase == FlightPhase::kPosition && (!goal_ || *goal_ != goal)) {
      goal_ = goal;
      give(CommandKind::kGoTo, goal, static_cast<float>(target_.yaw_rad.value_or(0)));
    }
    landed_ |= out.state == AutopilotState::kLanding;
    if (landed_ && out.state == AutopilotState::kIdle) give(CommandKind::kToggleEngage);  // disarms itself
  }

  void fly(const MavHilSensor& sensor) {
    const Time sensed{static_cast<std::int64_t>(sensor.time_usec) * 1000};
    constexpr int kSteps = 4;
    for (int i = 1; i <= kSteps; ++i) {
      AutopilotInputs inputs;
      now_ = inputs.now = sensed - Duration{(kSteps - i) * std::int64_t{1'000'000}};
      inputs.imu.emplace();
      inputs.imu->stamp = inputs.now;
      inputs.imu->specific_force_m_s2 = {sensor.xacc, -sensor.yacc, -sensor.zacc};
      inputs.imu->angular_velocity_rad_s = {sensor.xgyro, -sensor.ygyro, -sensor.zgyro};
      inputs.pose = std::exchange(pose_, {});
      inputs.height = std::exchange(height_, {});
      inputs.computer_alive = true;
      inputs.motors_on = on_since_ && now_ - *on_since_ > Duration{400'000'000};
      follow_target();
      if (!command_ && is_on()) command_.emplace();  // sign of life
      if (command_) {
        command_->stamp = now_;
        command_->pilot = 1;
        inputs.command = std::exchange(command_, {});
      }
      core_.step(inputs);
      const bool runs =
          core_.outputs().motors != MotorDemand::kOff && core_.outputs().motors != MotorDemand::kStop;
      if (!runs) on_since_.reset();
      if (runs && !on_since_) on_since_ = now_;
    }
    tell();
    if (const auto offset = peer_.time_sync().offset_at(now_))
      worst_clock_s = std::max(worst_clock_s, std::abs(offset->seconds()));
  }

  void tell() {
    const AutopilotOutputs& out = core_.outputs();
    const BasicVehicleState<float> estimate = core_.estimate();
    LinkState state;
    state.stamp = now_;
    const Mat3 R = rotation_from_roll_pitch_yaw(estimate.roll_pitch_yaw_rad.cast<double>());
    state.T_odom_base = SE3(R, estimate.position_m.cast<double>());
    state.velocity_body = R.transpose() * estimate.velocity_m_s.cast<double>();
    peer_.send(to_attitude(state, {}, AutopilotWorld::kLocalFrd));
    if (estimate.planar_ready && estimate.height_ready)
      peer_.send(to_local_position(state, {}, AutopilotWorld::kLocalFrd));
    MavExtendedSysState landed;
    landed.landed_state = in_air(out.state) ? kMavInAir : kMavOnGround;
    peer_.send(landed);
    const bool armed = is_on();
    if (armed != ((peer_.heartbeat().base_mode & kMavModeArmed) != 0)) {
      peer_.heartbeat().base_mode = armed ? kMavModeArmed : 0;
      peer_.send(peer_.heartbeat());
    }
    MavHilActuatorControls controls;
    controls.time_usec = static_cast<std::uint64_t>(now_.ns / 1000);
    for (std::size_t i = 0; i < 4; ++i) controls.controls[i] = out.rotor_speed_rad_s[i] / 838;
    peer_.send(controls);
  }

  UdpSocket& socket_;
  MavAutopilot kind_;
  MavlinkPeer peer_;
  Autopilot core_;
  Time now_;
  std::optional<Time> first_target_, on_since_;
  std::optional<PoseReading<float>> pose_;
  std::optional<BasicHeightReading<float>> height_;
  std::optional<FlightCommand> command_;
  std::optional<Vec3f> goal_;
  float climb_m_ = 0;  ///< as it was told
  LinkSetPoint target_;
  bool offboard_ = false, landed_ = false, lost_ = false, said_why_ = false;
};

/// A socket of the loopback and one that sends to it.
std::pair<std::unique_ptr<UdpSocket>, std::unique_ptr<UdpSocket>> socket_pair() {
  auto theirs = UdpSocket::listen("127.0.0.1", 0).value();
  auto ours = UdpSocket::listen("127.0.0.1", 0).value();
  EXPECT_TRUE(ours->add_peer({"127.0.0.1", theirs->port()}).has_value());
  return {std::move(ours), std::move(theirs)};
}

/// A flight of a script in the room, by an autopilot behind MAVLink.
struct ExternalFlight {
  ExternalFlight(std::unique_ptr<Transport> transport, const MavlinkAutopilotSetup& setup) {
    auto made = std::make_unique<MavlinkAutopilot>(std::move(transport), setup);
    autopilot = made.get();
    FlightRunParams params;
    start_in(WorldKind::kRoom, params.run);
    run.emplace(site, params, FaultSchedule{}, nullptr, std::move(made));
  }
  /// Until the script is over; the least distance from a place.
  double fly(const char* text, const Vec3& goal, double limit_s) {
    const FlightScript script = parse_flight_script(text, "test").value();
    for (const FlightOrder& order : script.orders) pilot.add(order);
    pilot.close();
    double nearest_m = 1e9;
    while (!pilot.is_over() && run->elapsed().seconds() < limit_s && !autopilot->failure()) {
      run->step(pilot.step(pilot_view(run->moment())));
      log.add(*run, pilot);
      nearest_m = std::min(nearest_m, (run->moment().T_odom_base.translation() - goal).norm());
    }
    return nearest_m;
  }
  void expect_done() const {
    EXPECT_FALSE(autopilot->failure()) << autopilot->failure()->message;
    ASSERT_TRUE(pilot.is_over());
    for (const OrderRecord& record : pilot.records())
      EXPECT_EQ(record.outcome, OrderOutcome::kDone) << record.order.text << ": " << record.reason;
    EXPECT_TRUE(run->collisions().empty());
    EXPECT_EQ(run->moment().autopilot.state, AutopilotState::kOff);
    EXPECT_GT(run->moment().feet_down, 2);
  }
  FlightSite site{WorldKind::kRoom, 1};
  std::optional<FlightRun> run;
  ScriptPilot pilot;
  FlightLog log;
  const MavlinkAutopilot* autopilot = nullptr;
};

class EachAutopilot : public ::testing::TestWithParam<MavAutopilot> {};

TEST_P(EachAutopilot, IsFlownByPerceptionOverUdp) {
  auto [ours, theirs] = socket_pair();
  PeerAutopilot peer(*theirs, GetParam());
  std::thread thread([&peer] { peer.run(); });
  MavlinkAutopilotSetup setup;
  setup.answer_limit = Duration{2'000'000'000};  // lock-step, however slow the machine is
  ExternalFlight flight(std::move(ours), setup);
  const double nearest_m =
      flight.fly("takeoff 1.2\ngoto -0.8 0.3 1.3 30\nwait 2\nland", {-0.8, 0.3, 1.3}, 90);
  peer.stop = true;
  thread.join();
  flight.expect_done();
  EXPECT_LT(nearest_m, 0.1);
  EXPECT_GT(peer.poses, 200U);
  EXPECT_EQ(peer.faulty_poses, 0U);
  EXPECT_EQ(peer.refused_early, 0U);
  EXPECT_TRUE(peer.armed_in_offboard);
  EXPECT_GE(peer.repeated_orders, 1U) << "the order to arm was lost and must come again";
  const bool is_ardupilot = GetParam() == kMavAutopilotArdupilot;
  EXPECT_EQ(peer.told_to_take_off, is_ardupilot);
  EXPECT_EQ(peer.origins > 0, is_ardupilot);
  EXPECT_LT(peer.origins, 10U) << "once it estimates a position it has one";
  const auto offset = flight.autopilot->peer().time_sync().offset_at(flight.run->now());
  ASSERT_TRUE(offset);
  EXPECT_NEAR(offset->seconds(), 0, 0.01);
  EXPECT_LT(peer.worst_clock_s, 0.01);
  // Why it did not arm at first stands among the events of the flight.
  const auto said = [&](const std::string& text) {
    return std::ranges::count(flight.log.events(), "autopilot: " + text, &FlightEvent::text);
  };
  EXPECT_EQ(said(PeerAutopilot::kReason), 1);
  EXPECT_EQ(said("it refuses to arm or disarm (result 1)"), 1);
}

INSTANTIATE_TEST_SUITE_P(MavlinkAutopilot, EachAutopilot,
                         ::testing::Values(kMavAutopilotPx4, kMavAutopilotArdupilot));

/// HM_PX4 names a program that starts PX4 in the foreground, which sends to UDP port 14550 (docs/link.md).
TEST(MavlinkAutopilot, FliesPx4WhereThereIsOne) {
  const char* program = std::getenv("HM_PX4");
  if (program == nullptr || *program == 0) GTEST_SKIP() << "HM_PX4 names no PX4: it is not flown";
  constexpr std::uint16_t kPort = 14550;
  auto socket = UdpSocket::listen("127.0.0.1", kPort);
  ASSERT_TRUE(socket) << to_string(socket.error());
  const pid_t process = fork();
  if (process == 0) {
    execl(program, program, nullptr);
    _exit(127);
  }
  ASSERT_GT(process, 0);
  const bool sends = (*socket)->wait(Duration{60'000'000'000});
  double nearest_m = 0;
  MavlinkAutopilotSetup setup;
  setup.answer_limit = Duration{1'000'000'000};
  setup.most_unanswered = 60;
  ExternalFlight flight(std::move(*socket), setup);
  if (sends) nearest_m = flight.fly("takeoff 1.2\ngoto -0.8 0 1.2 0\nwait 2\nland", {-0.8, 0, 1.2}, 180);
  kill(process, SIGTERM);
  waitpid(process, nullptr, 0);
  ASSERT_TRUE(sends) << program << " sends nothing to UDP port " << kPort;
  flight.expect_done();
  EXPECT_LT(nearest_m, 0.25);
}

/// A MavlinkAutopilot whose other end stands in memory and does what the test says.
struct ByHand {
  explicit ByHand(const std::optional<MavlinkKey>& ours_key = {},
                  const std::optional<MavlinkKey>& theirs = {}) {
    auto ours = std::make_unique<link_testing::PipeTransport>();
    ours->other = &far;
    far.other = ours.get();
    MavlinkAutopilotSetup setup;
    setup.most_unanswered = 1'000'000;
    setup.key = ours_key;
    autopilot = std::make_unique<MavlinkAutopilot>(std::move(ours), setup);
    MavlinkPeerOptions options;
    options.address = {1, 1};
    options.heartbeat.autopilot = kMavAutopilotPx4;
    peer.emplace(far, with_key(options, theirs));
    start_signing(*peer);
  }
  /// Steps of 1 ms in which the other end says its attitude.
  void run(int steps, std::optional<PoseReading<float>> pose = {}) {
    for (int i = 0; i < steps; ++i) {
      inputs.now = inputs.now + Duration{1'000'000};
      inputs.imu.emplace();
      inputs.pose = pose;
      if (pose) {
        inputs.pose->stamp = inputs.now;
        inputs.height = BasicHeightReading<float>{inputs.now, 1, {}};
      }
      pose.reset();
      autopilot->step(inputs);
      LinkState state;
      state.stamp = inputs.now;
      peer->send(to_attitude(state, {}, AutopilotWorld::kLocalFrd));
      peer->step([this] { return inputs.now; },
                 [this](const MavlinkFrame& frame) {
                   if (const auto odometry = read_mavlink_message<MavOdometry>(frame))
                     poses.push_back(*odometry);
                 });
    }
  }
  link_testing::PipeTransport far;
  std::optional<MavlinkPeer> peer;
  std::unique_ptr<MavlinkAutopilot> autopilot;
  AutopilotInputs inputs;
  std::vector<MavOdometry> poses;
};

TEST(MavlinkAutopilot, AJumpOfThePosesIsAResetAndNoVelocity) {
  ByHand link;
  link.run(20);
  PoseReading<float> pose{{}, Vec3f::Zero(), {}};
  for (int i = 0; i < 5; ++i) link.run(25, pose);
  pose.x_y_yaw = {3, 0, 0};
  link.autopilot->note_restarts(1);
  for (int i = 0; i < 5; ++i) link.run(25, pose);
  ASSERT_EQ(link.poses.size(), 8U) << "the first ones of both paths have no velocity";
  for (std::size_t i = 0; i < link.poses.size(); ++i) {
    EXPECT_EQ(link.poses[i].reset_counter, i < 4 ? 0 : 1);
    EXPECT_NEAR(link.poses[i].x, i < 4 ? 0 : 3, 1e-5);
    EXPECT_NEAR(link.poses[i].vx, 0, 1e-5);
  }
}

TEST(MavlinkAutopilot, WithAKeyItHearsAndIsHeardByThoseWithIt) {
  const MavlinkKey key{1, 2, 3}, wrong{1, 2, 4};
  const auto poses_heard = [](const ByHand& link) { return link.poses.size(); };
  for (const auto& theirs : {std::optional<MavlinkKey>(), std::optional(wrong), std::optional(key)}) {
    ByHand link(key, theirs);
    link.run(20);
    for (int i = 0; i < 5; ++i) link.run(25, PoseReading<float>{{}, Vec3f::Zero(), {}});
    EXPECT_EQ(poses_heard(link), theirs == key ? 4U : 0U);
    EXPECT_EQ(link.autopilot->peer().autopilot(link.inputs.now) != nullptr, theirs == key);
  }
}

TEST(MavlinkAutopilot, AnAutopilotThatNeverAnswersIsNamed) {
  auto [ours, theirs] = socket_pair();
  MavlinkAutopilotSetup setup;
  setup.answer_limit = Duration{1'000'000};
  setup.most_unanswered = 20;
  MavlinkAutopilot autopilot(std::move(ours), setup);
  AutopilotInputs inputs;
  inputs.imu.emplace();
  for (int i = 1; i <= 20 * MavlinkAutopilot::kSensorSteps; ++i) {
    EXPECT_FALSE(autopilot.failure());
    inputs.now = Time{i * std::int64_t{1'000'000}};
    autopilot.step(inputs);
  }
  ASSERT_TRUE(autopilot.failure());
  EXPECT_NE(autopilot.failure()->message.find("does not answer"), std::string::npos);
  inputs.now = inputs.now + Duration{1'000'000};
  EXPECT_EQ(autopilot.step(inputs).state, AutopilotState::kError);
}

}  // namespace
}  // namespace hm
