#include "hm/pipeline/laser/run/laser_tables.hpp"

#include <fmt/format.h>

#include <string_view>

#include "hm/io/bytes/text_lines.hpp"

namespace hm {
namespace {

constexpr std::string_view kHeightHeader =
    "stamp_s,status,height_m,height_std_m,climb_m_s,clearance_m,floor_level_m,floor_id,event,step_m\n";
constexpr std::string_view kStateHeader =
    "stamp_s,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s,"
    "planar_ready,height_ready\n";

std::string_view name_of(HeightStatus status) {
  switch (status) {
    case HeightStatus::kOk:
      return "ok";
    case HeightStatus::kTooFewReadings:
      return "too_few_readings";
    case HeightStatus::kSpreadTooWide:
      return "spread_too_wide";
    case HeightStatus::kTilted:
      return "tilted";
    case HeightStatus::kTimeBackwards:
      return "time_backwards";
    case HeightStatus::kInvalidInput:
      return "invalid_input";
  }
  return "unknown";
}

std::string_view name_of(FloorEvent event) {
  return event == FloorEvent::kStepUp ? "step_up" : event == FloorEvent::kStepDown ? "step_down" : "";
}

std::string line_of(const HeightEstimate& height) {
  return fmt::format("{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{:.4f}\n", stamp_text(height.stamp),
                     name_of(height.status), height.height_m, height.height_std_m, height.climb_m_s,
                     height.clearance_m, height.floor_level_m, height.floor_id, name_of(height.event),
                     height.step_m);
}

std::string line_of(const VehicleState& state) {
  const Vec3 &p = state.position_m, &v = state.velocity_m_s, &rpy = state.roll_pitch_yaw_rad,
             &w = state.angular_velocity_rad_s;
  return fmt::format(
      "{},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{},{}\n",
      stamp_text(state.stamp), p.x(), p.y(), p.z(), rpy.x(), rpy.y(), rpy.z(), v.x(), v.y(), v.z(), w.x(),
      w.y(), w.z(), state.planar_ready ? 1 : 0, state.height_ready ? 1 : 0);
}

}  // namespace

void LaserTables::add(const LaserStep& step) {
  if (step.height) {
    if (!heights_) heights_.emplace(folder_ / kHeightTable).write(kHeightHeader);
    heights_->write(line_of(*step.height));
  }
  if (step.state) {
    if (!states_) states_.emplace(folder_ / kStateTable).write(kStateHeader);
    states_->write(line_of(*step.state));
  }
}

Result<void> LaserTables::written() const {
  for (const auto* table : {&heights_, &states_})
    if (*table)
      if (const auto written = (*table)->written(); !written) return written;
  return {};
}

Result<void> LaserTables::finish() {
  for (auto* table : {&heights_, &states_})
    if (*table)
      if (const auto written = (*table)->finish(); !written) return written;
  return {};
}

}  // namespace hm
