#include <fmt/format.h>

#include "hm/core/text/counted.hpp"
#include "hm/pipeline/checks/recording_check.hpp"
#include "hm/pipeline/common/sensor_prior.hpp"

namespace hm {
namespace {

JsonValue vector_json(const Vec3& v) { return JsonValue(JsonValue::Array{v.x(), v.y(), v.z()}); }

void add_camera(const RecordingInfo& info, SummaryTree& v) {
  const PinholeCamera& c = info.camera;
  const LensDistortion& d = c.distortion;
  v({"source"}, info.camera_source);
  v.json("calibration", info.calibration.empty() ? JsonValue() : JsonValue(info.calibration));
  v({"width_px", {}, "{:d}"}, c.width);
  v({"height_px", {}, "{:d}"}, c.height);
  v({"fx_px", {}, "{:.2f}"}, c.fx);
  v({"fy_px", {}, "{:.2f}"}, c.fy);
  v({"cx_px", {}, "{:.2f}"}, c.cx);
  v({"cy_px", {}, "{:.2f} px"}, c.cy);
  v.json("distortion", JsonValue(JsonValue::Array{d.k1, d.k2, d.p1, d.p2, d.k3}));
}

void add_depth(const RecordingReport& report, SummaryTree& v) {
  const DepthReport& d = report.depth;
  v({"unit_m"}, report.info.depth_unit_m);
  v.shown("units_per_m", {}, with_thousands(std::lround(1.0 / report.info.depth_unit_m)));
  v({"frames_sampled"}, d.frames_sampled);
  v({"frames_unreadable"}, d.frames_unreadable);
  v({"valid_ratio", {}, "{:.1f} %", 100}, d.valid_ratio);
  v({"min_m", {}, "{:.3f}"}, d.min_m);
  v({"p05_m", {}, "{:.2f}"}, d.p05_m);
  v({"median_m", {}, "{:.2f} m"}, d.median_m);
  v({"p95_m", {}, "{:.2f} m"}, d.p95_m);
  v({"max_m", {}, "{:.2f} m"}, d.max_m);
}

/// Lens distortion and calibration, where there are any, below the camera's line.
std::string calibration_lines(const RecordingInfo& info) {
  const LensDistortion& d = info.camera.distortion;
  std::string text;
  if (!d.is_zero())
    text += fmt::format("           lens distortion k1 {} k2 {} p1 {} p2 {} k3 {}, undistorted on reading\n",
                        d.k1, d.k2, d.p1, d.p2, d.k3);
  if (!info.calibration.empty()) text += fmt::format("           {}\n", info.calibration);
  return text;
}

/// The line of the depths; where there are none, why.
std::string depth_line(const DepthReport& depth, const SummaryTree& tree) {
  if (depth.frames_sampled == 0)
    return tree.lines({"depth      {depth.units_per_m} units per metre; not one frame could be read"});
  if (depth.valid_ratio == 0)
    return tree.lines({"depth      {depth.units_per_m} units per metre; not one pixel holds a reading"});
  return tree.lines(
      {"depth      {depth.units_per_m} units per metre; {depth.min_m} to {depth.max_m}, median "
       "{depth.median_m}, 90 % within {depth.p05_m} to {depth.p95_m}; {depth.valid_ratio} of the pixels "
       "valid"});
}

/// The truth of a recording in words.
std::string truth_text(const RecordingInfo& info) {
  if (info.truth.empty()) return "mesh";
  return info.truth_mesh ? "trajectory, mesh" : "trajectory";
}

}  // namespace

std::string_view to_string(FindingKind kind) {
  switch (kind) {
    case FindingKind::kDepthScale:
      return "depth_scale";
    case FindingKind::kInvertedPoses:
      return "inverted_poses";
    case FindingKind::kQuaternionOrder:
      return "quaternion_order";
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
    case FindingKind::kMissingPoses:
      return "missing_poses";
    case FindingKind::kMissingColor:
      return "missing_color";
    case FindingKind::kGap:
      return "gap";
    case FindingKind::kDepthRange:
      return "depth_range";
    case FindingKind::kOddScale:
      return "odd_scale";
    case FindingKind::kPoseUnit:
      return "pose_unit";
  }
  return "unknown";
}

void visit(const AgreementReport& agreement, SummaryTree& v) {
  v({"hypothesis"}, agreement.hypothesis);
  v({"agreement_mm", {}, "{:.1f} mm"}, agreement.agreement_mm);
  v({"agreement_ratio", {}, "{:.2f} %", 100}, agreement.agreement_ratio);
  v({"systematic_ratio"}, agreement.systematic_ratio);
  v({"overlap_ratio"}, agreement.overlap_ratio);
}

void visit(const Finding& finding, SummaryTree& v) {
  v({"kind"}, to_string(finding.kind));
  v({"message"}, finding.message);
}

void visit(const RecordingReport& report, SummaryTree& v) {
  const RecordingInfo& info = report.info;
  const Vec3& extent = report.pose_extent_m;
  v({"kind"}, to_string(info.kind));
  v({"path"}, info.path.string());
  v({"frames"}, info.frame_count);
  v({"frames_with_color"}, info.paired_count);
  v({"frames_with_pose"}, info.posed_count);
  v({"has_own_stamps"}, info.has_own_stamps);
  if (!report.streams.empty()) v.list("streams", report.streams);
  v.object("camera", [&](SummaryTree& camera) { add_camera(info, camera); });
  if (is_from_kinect(info))
    v.object("rolling_shutter", [](SummaryTree& shutter) {
      shutter({"readout_s", {}, "{:.0f} ms", 1e3}, kinect_row_times().readout_s);
      shutter({"color_delay_s", {}, "{:.0f} ms", 1e3}, kinect_row_times().color_delay_s);
    });
  v.object("depth", [&](SummaryTree& depth) { add_depth(report, depth); });
  v({"path_length_m", {}, "{:.2f} m"}, report.path_length_m);
  v.json("pose_extent_m", vector_json(extent));
  v.shown("pose_extent_m", {}, fmt::format("{:.2f} x {:.2f} x {:.2f} m", extent.x(), extent.y(), extent.z()));
  v({"pose_source"}, info.trajectory_source);
  if (info.imu)
    v.object("imu", [&](SummaryTree& imu) {
      imu({"source"}, info.imu->source);
      imu({"has_gyroscope"}, info.imu->has_gyroscope);
    });
  v({"has_truth_trajectory"}, !info.truth.empty());
  v({"has_truth_mesh"}, info.truth_mesh.has_value());
  v.json("color_shift_px",
         JsonValue(JsonValue::Array{report.color_shift.right_px, report.color_shift.down_px}));
  v({"color_scale_ratio"}, report.color_shift.scale_ratio);
  v({"pairs_compared"}, report.pairs_compared);
  v.list("agreement", report.agreement);
  v.list("findings", report.findings);
  v({"notes"}, info.notes);
}

std::string to_text(const RecordingReport& report) {
  const RecordingInfo& info = report.info;
  const SummaryTree tree = describe(report);
  std::string text = tree.lines({"recording  {path} ({kind})"});
  for (const StreamReport& stream : report.streams) text += stream_line(stream) + "\n";
  if (info.imu)
    text += tree.lines({info.imu->has_gyroscope
                            ? "           from {imu.source}"
                            : "           from {imu.source}: accelerometer only, no gyroscope"});
  text +=
      tree.lines({"frames     {frames} with depth, {frames_with_color} of them with colour, "
                  "{frames_with_pose} with a pose",
                  "camera     {camera.width_px} x {camera.height_px}, fx {camera.fx_px} fy {camera.fy_px} cx "
                  "{camera.cx_px} cy "
                  "{camera.cy_px} ({camera.source})"});
  text += calibration_lines(info);
  text += tree.lines(
      {"shutter    rolling, as of a Kinect: {rolling_shutter.readout_s} from the first row of colour to the "
       "last, {rolling_shutter.color_delay_s} after depth; odometry starts from these and estimates them"});
  text += depth_line(report.depth, tree);
  if (info.trajectory.empty())
    text += "poses      none: `hm slam` or `hm odometry` estimates them\n";
  else
    text += tree.lines({"poses      {pose_source}; path {path_length_m}, in a box of {pose_extent_m}"});
  if (!info.truth.empty() || info.truth_mesh) text += "truth      " + truth_text(info) + "\n";
  if (report.agreement.empty() && info.posed_count > 0)
    text += "agreement  not compared: no two frames with poses are far enough apart\n";
  else if (!report.agreement.empty())
    text +=
        describe(report.agreement.front())
            .lines({fmt::format("agreement  depth moved by its poses meets the depth measured there within "
                                "{{agreement_mm}} (median of {}, {{agreement_ratio}} of the depth)",
                                counted(report.pairs_compared, "pair"))});
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
