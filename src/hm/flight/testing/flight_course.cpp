#include "hm/flight/testing/flight_course.hpp"

#include <limits>

namespace hm {
namespace {

FlightCommand position_step(float x_m, float y_m, float z_m, float yaw_rad) {
  FlightCommand command;
  command.kind = CommandKind::kPositionStep;
  command.position_m = {x_m, y_m, z_m};
  command.yaw_rad = yaw_rad;
  return command;
}

void fly_by_commands(FlightRig& rig) {
  rig.go_to(1.5F, 0.5F, 1.5F, 2.5F);
  rig.send(CommandKind::kRelease);
  rig.run_ms(2500);
  rig.send(position_step(0.5F, -0.3F, 0.2F, 1.5F));
  rig.send(CommandKind::kTakeOff);  // refused: it flies
  rig.run_ms(1500);
  rig.send_mode(FlightPhase::kVelocity);
  for (int i = 0; i < 8; ++i) {
    rig.fly_velocity(0.6F, -0.3F, i < 4 ? 0.1F : -0.1F);
    rig.run_ms(99);
  }
  rig.run_ms(500);  // stale: holds
  rig.send_mode(FlightPhase::kDirect);
  FlightCommand direct;
  direct.kind = CommandKind::kDirect;
  direct.roll_rad = 0.05F;
  direct.thrust_ratio = 0.49F;
  for (int i = 0; i < 4; ++i) {
    rig.send(direct);
    rig.run_ms(49);
  }
  rig.send(CommandKind::kRelease);
  rig.run_ms(1000);
}

void fly_through_outages(FlightRig& rig) {
  rig.pose = false;
  rig.run_ms(400);  // dead reckoning
  rig.pose = true;
  rig.run_ms(500);
  rig.height = false;
  rig.run_ms(700);  // sinks slowly
  rig.height = true;
  rig.run_ms(500);
  rig.imu = false;
  rig.run_ms(40);  // motor commands stand
  rig.imu = true;
  rig.run_ms(500);
  rig.pose_shift_m = 0.8F;  // refused by the gate
  rig.run_ms(300);
  rig.pose_shift_m = 0;
  rig.run_ms(300);
  rig.battery_ratio = 0.5F;
  rig.obstacle_m = 0.2F;
  rig.run_ms(50);
  rig.obstacle_m = 20.0F;
  FlightCommand bad = position_step(std::numeric_limits<float>::quiet_NaN(), 0, 0, 0);
  rig.send(bad);
  rig.send(CommandKind::kRelease);
  rig.alive = false;
  rig.run_ms(1100);  // level descent
  rig.alive = true;
  rig.run_ms(300);
}

}  // namespace

void fly_course(FlightRig& rig) {
  rig.take_off();
  fly_by_commands(rig);
  fly_through_outages(rig);
  rig.send(CommandKind::kLand);
  rig.send(CommandKind::kRelease);
  rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kIdle; }, 8000);
  rig.run_ms(200);
  rig.send(CommandKind::kEStop);
  rig.run_ms(100);
  rig.send(CommandKind::kReset);
  rig.run_ms(50);
}

}  // namespace hm
