#include "hm/sim/vehicle/vehicle.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace hm {
namespace {

constexpr std::int64_t kStepsPerLook = 10;  ///< surfaces are looked for at 100 Hz
constexpr Eigen::Index kLostRotor = 0;      ///< of the fault `motor_lost`
constexpr std::uint64_t kComStream = 0x636f6d;

/// Centre of mass in the base frame, in a random horizontal direction.
Vec3 random_com(const VehicleSetup& setup) {
  Rng rng(setup.seed, kComStream);
  const double angle = rng.uniform(0, 2 * std::numbers::pi);
  return setup.params.airframe.com_offset_m * Vec3(std::cos(angle), std::sin(angle), 0);
}

VehicleImuSetup imu_setup(const VehicleSetup& setup) {
  return {setup.imu,        setup.imu_effects, setup.params.vibration, setup.params.hover_speed_rad_s(),
          setup.T_base_imu, setup.seed};
}

bool is_finite(const VehicleCommand& command) {
  const InnerLoopCommand& a = command.attitude;
  return command.rotor_speed_rad_s.allFinite() && std::isfinite(a.roll_rad) && std::isfinite(a.pitch_rad) &&
         std::isfinite(a.yaw_rate_rad_s) && std::isfinite(a.thrust_ratio);
}

}  // namespace

Vehicle::Vehicle(const VehicleSetup& setup, CastRays surroundings)
    : setup_(setup),
      dynamics_(setup.params, random_com(setup)),
      contact_(setup.params, dynamics_.com_base_m(), std::move(surroundings)),
      battery_(setup.params.battery),
      wind_(setup.params.wind, setup.seed),
      thrust_errors_(setup.params.rotor, setup.seed),
      imu_(imu_setup(setup)),
      body_(dynamics_.at_rest(setup.T_world_base)),
      now_(setup.start) {
  motion_ = dynamics_.base_motion(body_, QuadrotorRates{});
}

void Vehicle::accept(const VehicleCommand& command) {
  if (is_finite(command))
    command_ = command;
  else
    ++bad_commands_;
}

RotorValues Vehicle::attainable_speeds() const {
  const RotorParams& rotor = setup_.params.rotor;
  RotorValues speeds = command_.rotor_speed_rad_s;
  if (setup_.params.inner_loop.inner_loop != InnerLoopKind::kMotors)
    speeds.setConstant(rotor.max_speed_rad_s *
                       std::sqrt(std::clamp(command_.attitude.thrust_ratio, 0.0, 1.0)));
  const double voltage_ratio = battery_.voltage_ratio();
  if (!rotor.speed_governed) speeds *= voltage_ratio;
  speeds = speeds.cwiseMax(0).cwiseMin(rotor.max_speed_rad_s * voltage_ratio);
  if (has_fault(FaultKind::kMotorLost)) speeds[kLostRotor] = 0;
  return speeds;
}

void Vehicle::update_inputs() {
  if (steps_ % kStepsPerLook == 0) contact_.look(body_, now_);
  inputs_.surfaces = contact_.rotor_surfaces();
  inputs_.contact = nullptr;
  if (contact_.has_surfaces())
    inputs_.contact = [this](const QuadrotorState& state) { return contact_.wrench(state); };
  const ScriptedFault* gust = setup_.faults.active(FaultKind::kGust, elapsed());
  if (gust != nullptr && gust_at_ != gust->at) {
    gust_at_ = gust->at;
    wind_.begin_gust(gust->duration.seconds());
  }
  wind_.step(kStep_s);
  inputs_.wind_world_m_s = wind_.velocity_world_m_s();
  thrust_errors_.step(kStep_s);
  inputs_.thrust_factor = thrust_errors_.factors();
  const BatteryParams& battery = setup_.params.battery;
  const double power_w =
      dynamics_.rotor_power_w(body_, inputs_) / battery.kMotorEfficiency + battery.kAvionicsPower_w;
  battery_.step(power_w, kStep_s, has_fault(FaultKind::kCellLost));
  inputs_.rotor_command_rad_s = attainable_speeds();
  inputs_.attitude = command_.attitude;
}

std::optional<ImuSample> Vehicle::measure() {
  std::optional<ImuSample> sample = imu_.step(now_, motion_, body_.rotor_speed_rad_s);
  if (!sample) return sample;
  if (has_fault(FaultKind::kImuStuck) && last_sample_) {
    const Time stamp = sample->stamp;
    sample = last_sample_;
    sample->stamp = stamp;
  }
  last_sample_ = sample;
  if (has_fault(FaultKind::kClockStep)) sample->stamp = sample->stamp + kFaultClockStep;
  if (has_fault(FaultKind::kImuGap)) return std::nullopt;
  return sample;
}

std::optional<ImuSample> Vehicle::step(const VehicleCommand& command) {
  accept(command);
  update_inputs();
  body_ = dynamics_.advance(body_, inputs_, kStep_s);
  contact_.settle(body_);
  ++steps_;
  now_ = now_ + kStep;
  motion_ = dynamics_.base_motion(body_, dynamics_.rates(body_, inputs_));
  return measure();
}

}  // namespace hm
