#include "hm/pipeline/flight/flight_run.hpp"

#include <algorithm>
#include <cmath>

#include "hm/pipeline/flight/flight_board.hpp"
#include "hm/pipeline/flight/motor_controllers.hpp"
#include "hm/pipeline/flight/onboard_computer.hpp"
#include "hm/sim/vehicle/vehicle_sensors.hpp"

namespace hm {
namespace {

constexpr Time kStart{1'000'000'000};
constexpr std::size_t kMotorBytes = 16;

SE3 planar_start(const FlightRunSettings& run) {
  return {so3_exp({0, 0, run.start_yaw_rad}), {run.start_x_m, run.start_y_m, 0}};
}

VehicleSetup vehicle_setup(const FlightRunParams& params, const LaserRig& rig, const FaultSchedule& faults) {
  VehicleSetup setup;
  setup.params = params.vehicle;
  setup.imu = params.imu;
  setup.imu.imu_rate_hz = 1000;
  setup.imu_effects = params.imu_effects;
  setup.T_base_imu = rig.T_base_imu;
  const SE3 start = planar_start(params.run);
  setup.T_world_base = SE3(start.rotation(), start.translation() + Vec3(0, 0, kBaseOverGround_m));
  setup.start = kStart;
  setup.faults = faults;
  setup.seed = static_cast<std::uint64_t>(params.run.seed);
  return setup;
}

VehicleSensorsSetup sensors_setup(const FlightRunParams& params) {
  VehicleSensorsSetup setup;
  setup.laser = params.laser;
  setup.laser_effects = params.laser_effects;
  setup.laser_link = params.links.laser;
  setup.seed = static_cast<std::uint64_t>(params.run.seed);
  return setup;
}

/// Charge by voltage and current at the terminals, as a battery gauge measures it.
float gauge(const VehicleBattery& battery, const BatteryParams& params) {
  const double open_v = battery.voltage_v() + battery.current_a() * params.internal_resistance_ohm;
  const double cell_v = open_v / params.cells;
  const double ratio = (cell_v - params.kCellEmpty_v) / (params.kCellFull_v - params.kCellEmpty_v);
  return static_cast<float>(std::clamp(ratio, 0.0, 1.0));
}

StageCounts link_counts(const char* name, const StreamLinkCounts& link, std::uint64_t received) {
  return {name, link.sent, received, link.cut + link.overflown + link.damaged};
}

}  // namespace

FlightSite::FlightSite(World generated) : world(std::move(generated)), renderer(world) {}
FlightSite::FlightSite(WorldKind kind, int seed)
    : FlightSite(make_world(kind, static_cast<std::uint64_t>(seed))) {}

BasicVehicleState<float> estimate_in_map(const FlightMoment& moment) {
  BasicVehicleState<float> state = moment.estimate;
  const SE2& T = moment.T_map_odom;
  state.position_m.head<2>() = (T * Vec2(moment.estimate.position_m.head<2>().cast<double>())).cast<float>();
  state.velocity_m_s.head<2>() =
      (T.rotation() * moment.estimate.velocity_m_s.head<2>().cast<double>()).cast<float>();
  state.roll_pitch_yaw_rad.z() =
      wrap_angle_f(moment.estimate.roll_pitch_yaw_rad.z() + static_cast<float>(T.angle()));
  return state;
}

struct FlightRun::Impl {
  Impl(const FlightSite& site, const FlightRunParams& parameters, const FaultSchedule& faults,
       FlightObserver* observer, std::unique_ptr<FlightCore> core);

  void drive_motors();
  void run_computer(const std::optional<FlightCommand>& command);
  void run_board(const std::optional<ImuSample>& sample);
  void note_moment();

  FlightRunParams params;
  SE3 T_world_odom;
  VehicleSensors sensors;
  Vehicle vehicle;
  OnboardComputer computer;
  FlightBoard board;
  MotorControllers motors;
  StreamLink<UpMessage> up;
  StreamLink<DownMessage> down;
  StreamLink<MotorMessage> to_motors;
  std::uint64_t up_received = 0, down_received = 0, motors_received = 0;
  std::optional<Time> last_gauge;
  RunningSummary core_to_motor_s;
  FlightMoment moment;
};

FlightRun::Impl::Impl(const FlightSite& site, const FlightRunParams& parameters, const FaultSchedule& faults,
                      FlightObserver* observer, std::unique_ptr<FlightCore> core)
    : params(parameters),
      T_world_odom(planar_start(parameters.run)),
      sensors(site.world, site.renderer, sensors_setup(parameters)),
      vehicle(vehicle_setup(parameters, sensors.rig(), faults), cast_into(site.renderer)),
      computer(parameters.perception, LaserPlatform{{sensors.rig()}, true, true},
               Duration::from_seconds(parameters.run.perception_s),
               parameters.vehicle.airframe.arm_m + parameters.vehicle.rotor.radius_m, observer),
      board(core ? std::move(core) : make_host_core(core_aboard(parameters, sensors.rig())),
            parameters.run.imu_down_hz, observer),
      up(parameters.links.serial_up, static_cast<std::uint64_t>(parameters.run.seed) + 10),
      down(parameters.links.serial_down, static_cast<std::uint64_t>(parameters.run.seed) + 11),
      to_motors(parameters.links.motors, static_cast<std::uint64_t>(parameters.run.seed) + 12) {
  sensors.update(vehicle);
  moment.stamp = vehicle.now();
  note_moment();
}

void FlightRun::Impl::drive_motors() {
  while (const auto arrival = to_motors.receive(vehicle.now())) {
    ++motors_received;
    core_to_motor_s.add((arrival->at - arrival->message.computed).seconds());
    motors.receive(arrival->message);
  }
}

void FlightRun::Impl::run_computer(const std::optional<FlightCommand>& command) {
  const Time now = vehicle.now();
  while (const auto arrival = down.receive(now)) {
    ++down_received;
    computer.add(now, arrival->message);
  }
  while (const auto scan = sensors.next_scan(now)) computer.add_scan(*scan);
  if (command) computer.add_command(*command);
  for (UpMessage& message : computer.take_messages(now)) {
    const std::size_t bytes = bytes_on_wire(message);
    up.send(now, std::move(message), bytes);
  }
}

void FlightRun::Impl::run_board(const std::optional<ImuSample>& sample) {
  const Time now = vehicle.now();
  while (const auto arrival = up.receive(now)) {
    ++up_received;
    board.receive(now, arrival->message);
  }
  BoardReadings readings;
  readings.now = now;
  if (vehicle.has_fault(FaultKind::kClockStep)) readings.clock_step = Vehicle::kFaultClockStep;
  readings.imu = sample;
  readings.motors_on = motors.motors_on();
  if (is_due(last_gauge, Duration::from_seconds(1 / params.run.battery_gauge_hz), now)) {
    moment.battery_ratio = static_cast<double>(gauge(vehicle.battery(), params.vehicle.battery));
    readings.battery_ratio = static_cast<float>(moment.battery_ratio);
  }
  const AutopilotOutputs& outputs = board.step(readings);
  to_motors.send(now, {now, outputs.motors, outputs.rotor_speed_rad_s, outputs.rpyt}, kMotorBytes);
  for (DownMessage& message : board.take_messages()) {
    const std::size_t bytes = bytes_on_wire(message);
    down.send(now, std::move(message), bytes);
  }
  moment.autopilot = outputs;
  moment.estimate = board.core().estimate();
  moment.answer = board.answer();
  moment.T_map_odom = computer.T_map_odom();
}

void FlightRun::Impl::note_moment() {
  moment.stamp = vehicle.now();
  moment.truth = vehicle.state();
  moment.T_odom_base = T_world_odom.inverse() * vehicle.state().T_world_base;
  moment.collisions = vehicle.collisions().size();
  moment.feet_down = vehicle.feet_down();
}

FlightRun::FlightRun(const FlightSite& site, const FlightRunParams& params, const FaultSchedule& faults,
                     FlightObserver* observer, std::unique_ptr<FlightCore> core)
    : impl_(std::make_unique<Impl>(site, params, faults, observer, std::move(core))) {}
FlightRun::~FlightRun() = default;
FlightRun::FlightRun(FlightRun&&) noexcept = default;
FlightRun& FlightRun::operator=(FlightRun&&) noexcept = default;

const FlightMoment& FlightRun::step(const std::optional<FlightCommand>& command) {
  Impl& self = *impl_;
  self.drive_motors();
  const std::optional<ImuSample> sample = self.vehicle.step(self.motors.step(self.vehicle.now()));
  self.sensors.update(self.vehicle);
  const bool cut = self.vehicle.has_fault(FaultKind::kLinkCut);
  const bool noisy = self.vehicle.has_fault(FaultKind::kLinkNoise);
  self.up.set_faults(cut, noisy);
  self.down.set_faults(cut, noisy);
  self.run_computer(command);
  self.run_board(sample);
  self.note_moment();
  return self.moment;
}

const FlightMoment& FlightRun::moment() const { return impl_->moment; }
Time FlightRun::now() const { return impl_->vehicle.now(); }
Duration FlightRun::elapsed() const { return impl_->vehicle.elapsed(); }
void FlightRun::finish() { impl_->computer.finish(); }
const LaserPipeline& FlightRun::perception() const { return impl_->computer.perception(); }
const SE3& FlightRun::T_world_odom() const { return impl_->T_world_odom; }
const FlightCore& FlightRun::core() const { return impl_->board.core(); }
const LaserRig& FlightRun::rig() const { return impl_->sensors.rig(); }
const std::vector<VehicleCollision>& FlightRun::collisions() const { return impl_->vehicle.collisions(); }

std::vector<StageCounts> FlightRun::counts() const {
  std::vector<StageCounts> all = impl_->computer.counts();
  for (StageCounts& stage : impl_->board.counts()) all.push_back(std::move(stage));
  all.push_back(link_counts("serial up", impl_->up.counts(), impl_->up_received));
  all.push_back(link_counts("serial down", impl_->down.counts(), impl_->down_received));
  all.push_back(link_counts("motor commands", impl_->to_motors.counts(), impl_->motors_received));
  return all;
}

std::vector<StageLatency> FlightRun::latencies() const {
  return {{"scan to pose", impl_->computer.scan_to_pose_s()},
          {"scan to core", impl_->board.scan_to_core_s()},
          {"age of poses in the core", impl_->board.pose_age_s()},
          {"core to motors", impl_->core_to_motor_s.summary()}};
}

}  // namespace hm
