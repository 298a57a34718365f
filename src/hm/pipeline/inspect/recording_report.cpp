#include <fmt/format.h>

#include "hm/pipeline/inspect/recording_check.hpp"

namespace hm {
namespace {

JsonValue vector_json(const Vec3& v) { return JsonValue(JsonValue::Array{v.x(), v.y(), v.z()}); }

JsonValue camera_json(const RecordingInfo& info) {
  const PinholeCamera& c = info.camera;
  const LensDistortion& d = c.distortion;
  return JsonValue::object(
      {{"source", info.camera_source},
       {"calibration", info.calibration.empty() ? JsonValue() : JsonValue(info.calibration)},
       {"width_px", c.width},
       {"height_px", c.height},
       {"fx_px", c.fx},
       {"fy_px", c.fy},
       {"cx_px", c.cx},
       {"cy_px", c.cy},
       {"distortion", JsonValue(JsonValue::Array{d.k1, d.k2, d.p1, d.p2, d.k3})}});
}

JsonValue depth_json(const RecordingReport& report) {
  const DepthReport& d = report.depth;
  return JsonValue::object({{"unit_m", report.info.depth_unit_m},
                            {"frames_sampled", static_cast<std::int64_t>(d.frames_sampled)},
                            {"frames_unreadable", static_cast<std::int64_t>(d.frames_unreadable)},
                            {"valid_ratio", d.valid_ratio},
                            {"min_m", d.min_m},
                            {"p05_m", d.p05_m},
                            {"median_m", d.median_m},
                            {"p95_m", d.p95_m},
                            {"max_m", d.max_m}});
}

std::string camera_text(const RecordingInfo& info) {
  const PinholeCamera& c = info.camera;
  const LensDistortion& d = c.distortion;
  std::string text = fmt::format("{} x {}, fx {:.2f} fy {:.2f} cx {:.2f} cy {:.2f} px ({})", c.width,
                                 c.height, c.fx, c.fy, c.cx, c.cy, info.camera_source);
  if (!d.is_zero())
    text += fmt::format("\n           lens distortion k1 {} k2 {} p1 {} p2 {} k3 {}, removed when read", d.k1,
                        d.k2, d.p1, d.p2, d.k3);
  if (!info.calibration.empty()) text += fmt::format("\n           {}", info.calibration);
  return text;
}

std::string stream_text(const StreamReport& s, bool own_stamps) {
  std::string text = fmt::format("{:<10} {}", s.name, s.count);
  if (s.rate_hz <= 0) return text + "\n";
  text += own_stamps ? fmt::format(", {:.1f} Hz, {:.2f} s", s.rate_hz, s.duration_s)
                     : fmt::format(", no stamps of their own, {:.0f} Hz assumed", s.rate_hz);
  if (own_stamps) text += fmt::format(", longest interval {:.0f} ms", 1e3 * s.longest_gap_s);
  return text + "\n";
}

std::string agreement_text(const RecordingReport& report) {
  if (report.agreement.empty()) return "not compared: no two frames with poses moved enough\n";
  const AgreementReport& given = report.agreement[0];
  return fmt::format(
      "depth moved by its poses meets the depth measured there within {:.1f} mm (median of {} pairs, "
      "{:.2f} % of the depth)\n",
      given.agreement_mm, report.pairs_compared, 100 * given.agreement_ratio);
}

}  // namespace

std::string_view to_string(FindingKind kind) {
  switch (kind) {
    case FindingKind::kDepthScale:
      return "depth_scale";
    case FindingKind::kInvertedPoses:
      return "inverted_poses";
    case FindingKind::kFlippedFy:
      return "flipped_fy";
    case FindingKind::kPoorAgreement:
      return "poor_agreement";
    case FindingKind::kStamps:
      return "stamps";
    case FindingKind::kUnregisteredColor:
      return "unregistered_color";
    case FindingKind::kMissing:
      return "missing";
    case FindingKind::kGap:
      return "gap";
    case FindingKind::kDepthRange:
      return "depth_range";
  }
  return "unknown";
}

JsonValue to_json(const RecordingReport& report) {
  const RecordingInfo& info = report.info;
  JsonValue json = JsonValue::object({{"kind", to_string(info.kind)}, {"path", info.path.string()}});
  json["frames"] = static_cast<std::int64_t>(info.frame_count);
  json["frames_with_color"] = static_cast<std::int64_t>(info.paired_count);
  json["frames_with_pose"] = static_cast<std::int64_t>(info.posed_count);
  json["has_own_stamps"] = info.has_own_stamps;
  for (const StreamReport& stream : report.streams) json["streams"].push_back(to_json(stream));
  json["camera"] = camera_json(info);
  json["depth"] = depth_json(report);
  json["path_length_m"] = report.path_length_m;
  json["pose_extent_m"] = vector_json(report.pose_extent_m);
  json["pose_source"] = info.trajectory_source;
  if (info.imu)
    json["imu"] = JsonValue::object(
        {{"source", info.imu->source}, {"has_gyroscope", JsonValue(info.imu->has_gyroscope)}});
  json["has_truth_trajectory"] = !info.truth.empty();
  json["has_truth_mesh"] = info.truth_mesh.has_value();
  json["color_shift_px"] =
      JsonValue(JsonValue::Array{report.color_shift.right_px, report.color_shift.down_px});
  json["color_scale_ratio"] = report.color_shift.scale_ratio;
  json["pairs_compared"] = static_cast<std::int64_t>(report.pairs_compared);
  json["agreement"] = JsonValue::array();
  for (const AgreementReport& a : report.agreement)
    json["agreement"].push_back(JsonValue::object({{"hypothesis", a.hypothesis},
                                                   {"agreement_mm", a.agreement_mm},
                                                   {"agreement_ratio", a.agreement_ratio},
                                                   {"systematic_ratio", a.systematic_ratio},
                                                   {"overlap_ratio", a.overlap_ratio}}));
  json["findings"] = JsonValue::array();
  for (const Finding& finding : report.findings)
    json["findings"].push_back(
        JsonValue::object({{"kind", to_string(finding.kind)}, {"message", finding.message}}));
  json["notes"] = info.notes;
  return json;
}

std::string to_text(const RecordingReport& report) {
  const RecordingInfo& info = report.info;
  const DepthReport& d = report.depth;
  const Vec3& extent = report.pose_extent_m;
  std::string text = fmt::format("recording  {} ({})\n", info.path.string(), to_string(info.kind));
  for (const StreamReport& stream : report.streams) text += stream_text(stream, info.has_own_stamps);
  if (info.imu)
    text += fmt::format("imu        {}{}\n", info.imu->source,
                        info.imu->has_gyroscope ? "" : ": accelerometer alone, no gyroscope");
  text += fmt::format("frames     {} with depth, {} of them with colour, {} with a pose\n", info.frame_count,
                      info.paired_count, info.posed_count);
  text += fmt::format("camera     {}\n", camera_text(info));
  text += fmt::format(
      "depth      {:.4g} units per metre; {:.3f} to {:.2f} m, median {:.2f} m, 90 % within {:.2f} to "
      "{:.2f} m; {:.1f} % of the pixels valid\n",
      1.0 / info.depth_unit_m, d.min_m, d.max_m, d.median_m, d.p05_m, d.p95_m, 100 * d.valid_ratio);
  if (!info.trajectory.empty())
    text += fmt::format("poses      {}; path {:.2f} m, in a box of {:.2f} x {:.2f} x {:.2f} m\n",
                        info.trajectory_source, report.path_length_m, extent.x(), extent.y(), extent.z());
  if (!info.truth.empty() || info.truth_mesh)
    text += fmt::format("truth      {}{}{}\n", info.truth.empty() ? "" : "trajectory",
                        !info.truth.empty() && info.truth_mesh ? ", " : "", info.truth_mesh ? "mesh" : "");
  text += "agreement  " + agreement_text(report);
  if (!info.notes.empty()) {
    std::string notes = info.notes;
    for (std::size_t at = 0; (at = notes.find('\n', at)) != std::string::npos; at += 12)
      notes.replace(at, 1, "\n           ");
    text += "notes      " + notes + "\n";
  }
  if (report.findings.empty()) return text + "looks right: nothing odd was found\n";
  for (const Finding& finding : report.findings) text += "LOOKS WRONG  " + finding.message + "\n";
  return text;
}

}  // namespace hm
