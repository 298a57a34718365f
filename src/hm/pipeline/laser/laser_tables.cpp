#include "hm/pipeline/laser/laser_tables.hpp"

#include "hm/io/bytes/text_lines.hpp"

namespace hm {
namespace {

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

}  // namespace

std::string heights_csv(std::span<const LaserScanRecord> records) {
  std::string text;
  for (const LaserScanRecord& record : records) {
    if (!record.step.height) continue;
    const HeightEstimate& height = *record.step.height;
    text += fmt::format("{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{:.4f}\n", stamp_text(height.stamp),
                        name_of(height.status), height.height_m, height.height_std_m, height.climb_m_s,
                        height.clearance_m, height.floor_level_m, height.floor_id, name_of(height.event),
                        height.step_m);
  }
  if (text.empty()) return text;
  return "stamp_s,status,height_m,height_std_m,climb_m_s,clearance_m,floor_level_m,floor_id,event,step_m\n" +
         text;
}

std::string floors_csv(std::span<const FloorLevel> floors) {
  std::string text = "id,level_m,std_m,sightings,first_seen_s,last_seen_s\n";
  for (const FloorLevel& floor : floors)
    text += fmt::format("{},{:.4f},{:.4f},{},{},{}\n", floor.id, floor.level_m, floor.std_m, floor.sightings,
                        stamp_text(floor.first_seen), stamp_text(floor.last_seen));
  return text;
}

std::string states_csv(std::span<const LaserScanRecord> records) {
  std::string text;
  for (const LaserScanRecord& record : records) {
    if (!record.step.state) continue;
    const VehicleState& state = *record.step.state;
    const Vec3 &p = state.position_m, &v = state.velocity_m_s, &rpy = state.roll_pitch_yaw_rad,
               &w = state.angular_velocity_rad_s;
    text += fmt::format(
        "{},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{},{}\n",
        stamp_text(state.stamp), p.x(), p.y(), p.z(), rpy.x(), rpy.y(), rpy.z(), v.x(), v.y(), v.z(), w.x(),
        w.y(), w.z(), state.planar_ready ? 1 : 0, state.height_ready ? 1 : 0);
  }
  if (text.empty()) return text;
  return "stamp_s,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s,"
         "planar_ready,height_ready\n" +
         text;
}

}  // namespace hm
