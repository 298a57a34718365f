#include <fmt/format.h>

#include <array>
#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/pipeline/checks/laser_check.hpp"

namespace hm {
namespace {

JsonValue sentinels_json(const LaserStreamStats& laser) {
  JsonValue list = JsonValue::array();
  for (const auto& [range, count] : laser.sentinels_m)
    list.push_back(JsonValue::object(
        {{"range_m", std::isfinite(range) ? JsonValue(static_cast<double>(range)) : JsonValue("inf")},
         {"count", static_cast<std::int64_t>(count)}}));
  return list;
}

/// Where a laser is mounted on the base, and who says so.
struct Mount {
  const SE3& T_base_laser;
  const std::string& source;
};
void visit(const Mount& mount, SummaryTree& v) {
  const Vec3& xyz_m = mount.T_base_laser.translation();
  const Vec3 rpy_rad = roll_pitch_yaw(mount.T_base_laser.rotation());
  v.json("xyz_m", JsonValue::array_of(std::array{xyz_m.x(), xyz_m.y(), xyz_m.z()}));
  v.json("rpy_rad", JsonValue::array_of(std::array{rpy_rad.x(), rpy_rad.y(), rpy_rad.z()}));
  v({"source"}, mount.source);
}
std::string mount_text(const LaserStreamStats& laser) {
  const Vec3& xyz_m = laser.T_base_laser.translation();
  // Tenths of a degree, and no "-0.0".
  const Vec3 rpy_deg =
      (roll_pitch_yaw(laser.T_base_laser.rotation()) * kDegreesPerRadian).unaryExpr([](double angle) {
        return std::round(10 * angle) / 10 + 0.0;
      });
  return fmt::format("({:.3f}, {:.3f}, {:.3f}) m, roll {:.1f}, pitch {:.1f}, yaw {:.1f} deg ({})", xyz_m.x(),
                     xyz_m.y(), xyz_m.z(), rpy_deg.x(), rpy_deg.y(), rpy_deg.z(), laser.mount_source);
}

constexpr std::string_view kIndent = "           ";

std::string sentinels_text(const LaserStreamStats& laser) {
  std::string text;
  for (const auto& [range, count] : laser.sentinels_m)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ",
                        std::isfinite(range) ? fmt::format("{:.6g} m", range) : std::string("infinity"),
                        counted(count, "time"));
  return text.empty() ? "none" : text;
}

/// A stream of poses, with the length of their path.
struct PoseStream {
  const StreamReport& stream;
  double length_m;
};
void visit(const PoseStream& poses, SummaryTree& v) {
  visit(poses.stream, v);
  v({"path_length_m", {}, "{:.2f} m"}, poses.length_m);
}
std::optional<PoseStream> with_path(const std::optional<StreamReport>& stream, double length_m) {
  return stream ? std::optional<PoseStream>({*stream, length_m}) : std::nullopt;
}

std::string laser_text(const LaserStreamStats& laser) {
  return stream_line(laser.stream) + "\n" +
         describe(laser).lines(
             {"           {beams|beam} over {angle_rad} ({angle_min_rad} to {angle_max_rad}, every "
              "{angle_increment_rad}), {range_min_m} to {range_max_m}",
              "           {returns_ratio} return, from {nearest_m} to {farthest_m}, median {median_m}",
              "           {no_returns_ratio} see nothing (markers: {sentinels}), {invalid_ratio} invalid",
              "           arrives {latency_s} after its stamp (median; at most {max_latency_s})",
              "           mounted at {mount}"});
}

}  // namespace

void visit(const LaserStreamStats& laser, SummaryTree& v) {
  visit(laser.stream, v);
  v({"beams"}, laser.beams);
  v({"fewest_beams"}, laser.fewest_beams);
  const auto angle = [&](std::string_view key, std::string_view format, double angle_rad) {
    v({key, {}, format, kDegreesPerRadian}, angle_rad);
  };
  angle("angle_min_rad", "{:.1f}", laser.angle_min_rad);
  angle("angle_max_rad", "{:.1f}", laser.angle_max_rad);
  angle("angle_increment_rad", "{:.3f}", laser.angle_increment_rad);
  v.shown("angle_rad", {},
          fmt::format("{:.1f} deg", (laser.angle_max_rad - laser.angle_min_rad) * kDegreesPerRadian));
  v({"time_increment_s"}, laser.time_increment_s);
  v({"range_min_m", {}, "{:.2f}"}, laser.range_min_m);
  v({"range_max_m", {}, "{:.4g} m"}, laser.range_max_m);
  v({"returns_ratio", {}, "{:.1f} %", 100}, laser.returns_ratio);
  v({"no_returns_ratio", {}, "{:.1f} %", 100}, laser.no_returns_ratio);
  v({"invalid_ratio", {}, "{:.1f} %", 100}, laser.invalid_ratio);
  v({"nearest_m", {}, "{:.2f}"}, laser.nearest_m);
  v({"median_m", {}, "{:.2f} m"}, laser.median_m);
  v({"farthest_m", {}, "{:.2f} m"}, laser.farthest_m);
  v.json("sentinels", sentinels_json(laser));
  v.shown("sentinels", {}, sentinels_text(laser));
  v({"repeated_ratio"}, laser.repeated_ratio);
  v.or_null({"latency_s", {}, "{:.1f} ms", 1e3}, laser.latency_s);
  v.or_null({"max_latency_s", {}, "{:.1f}", 1e3}, laser.max_latency_s);
  v.json("mount", {});
  if (laser.mount_source.empty()) return;
  v.group("mount", Mount{laser.T_base_laser, laser.mount_source});
  v.shown("mount", {}, mount_text(laser));
}

void visit(const ImuReport& imu, SummaryTree& v) {
  visit(imu.stream, v);
  v({"has_orientation"}, imu.has_orientation);
  v({"force_m_s2"}, imu.force_m_s2);
  v({"still_force_m_s2", {}, "{:.3f} m/s2"}, imu.still_force_m_s2);
  v({"still_spread_m_s2"}, imu.still_spread_m_s2);
  v({"still_turning_rad_s", {}, "{:.4f} rad/s"}, imu.still_turning_rad_s);
}

void visit(const LaserFinding& finding, SummaryTree& v) {
  v({"kind"}, to_string(finding.kind));
  v({"message"}, finding.message);
}

std::string_view to_string(LaserFindingKind kind) {
  switch (kind) {
    case LaserFindingKind::kStamps:
      return "stamps";
    case LaserFindingKind::kGap:
      return "gap";
    case LaserFindingKind::kRanges:
      return "ranges";
    case LaserFindingKind::kRangeUnits:
      return "range_units";
    case LaserFindingKind::kAngles:
      return "angles";
    case LaserFindingKind::kImuUnits:
      return "imu_units";
    case LaserFindingKind::kOdometry:
      return "odometry";
    case LaserFindingKind::kDamage:
      return "damage";
    case LaserFindingKind::kMissing:
      return "missing";
    case LaserFindingKind::kMount:
      return "mount";
  }
  return "unknown";
}

void visit(const LaserRecordingReport& report, SummaryTree& v) {
  v({"kind"}, report.kind);
  v({"path"}, report.path);
  v.list("lasers", report.lasers);
  v.group_or_null("imu", report.imu);
  v.group_or_null("ranges", report.ranges);
  v.group_or_null("odometry", with_path(report.odometry, report.odometry_length_m));
  v.group_or_null("truth", with_path(report.truth, report.truth_length_m));
  v({"odometry_source"}, report.odometry_source);
  v({"truth_source"}, report.truth_source);
  v({"has_rig"}, report.has_rig);
  v.list("findings", report.findings);
  v.json("notes", JsonValue::array_of(report.notes));
}

std::string to_text(const LaserRecordingReport& report) {
  const SummaryTree tree = describe(report);
  std::string text = tree.lines({"recording  {path} ({kind})"});
  for (const LaserStreamStats& laser : report.lasers) text += laser_text(laser);
  if (report.imu)
    text +=
        stream_line(report.imu->stream) + (report.imu->has_orientation ? ", with orientation\n" : "\n") +
        tree.lines(
            {"           stillest half second: {imu.still_force_m_s2}, turning {imu.still_turning_rad_s}"});
  if (report.ranges) text += stream_line(*report.ranges) + "\n";
  if (report.odometry)
    text += stream_line(*report.odometry) +
            tree.lines({report.odometry_source.empty()
                            ? "; path {odometry.path_length_m}"
                            : "; path {odometry.path_length_m}, from {odometry_source}"});
  if (report.truth)
    text += stream_line(*report.truth) + tree.lines({"; path {truth.path_length_m}, from {truth_source}"});
  if (report.has_rig) text += "rig        rig.toml\n";
  for (std::size_t i = 0; i < report.notes.size(); ++i)
    text += fmt::format("{}{}\n", i == 0 ? "notes      " : kIndent, report.notes[i]);
  if (report.findings.empty()) return text + "looks right: nothing odd was found\n";
  for (const LaserFinding& finding : report.findings) text += "LOOKS WRONG  " + finding.message + "\n";
  return text;
}

}  // namespace hm
