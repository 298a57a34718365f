#include <algorithm>

#include "hm/pipeline/common/box_json.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/rgbd/slam_run.hpp"

namespace hm {
namespace {

JsonValue loops_to_json(const RgbdLoopStatistics& loops) {
  return JsonValue::object({{"candidates", loops.candidates},
                            {"accepted", loops.accepted},
                            {"not_verified", loops.not_verified},
                            {"too_far", loops.too_far},
                            {"ambiguous", loops.ambiguous},
                            {"unconfirmed", loops.unconfirmed},
                            {"taken_out", loops.taken_out},
                            {"maps", loops.maps},
                            {"solutions", loops.solutions}});
}

JsonValue adjustment_to_json(const RgbdAlignmentReport& report) {
  return JsonValue::object({{"adjusted", report.adjusted},
                            {"loop_links", report.loop_links},
                            {"visit_links", report.visit_links},
                            {"landmarks", report.landmarks},
                            {"observations", report.observations},
                            {"observations_behind", report.observations_behind},
                            {"interrupted", report.interrupted},
                            {"failure", report.failure},
                            {"error_before_px", report.error_before_px},
                            {"error_after_px", report.error_after_px}});
}

JsonValue correction_to_json(const MapCorrection& correction) {
  return JsonValue::object({{"frames_moved", correction.frames_moved},
                            {"frames_replayed", correction.frames_replayed},
                            {"frames_removed", correction.frames_removed},
                            {"volumes_before", correction.volumes_before},
                            {"volumes_rebuilt", correction.volumes_rebuilt},
                            {"volumes_after", correction.volumes_after},
                            {"largest_shift_m", correction.largest_shift_m},
                            {"seconds", correction.seconds}});
}

JsonValue live_corrections_to_json(const std::vector<LiveCorrection>& corrections) {
  auto list = JsonValue::array();
  for (const LiveCorrection& live : corrections) {
    auto one = correction_to_json(live.map);
    one["frame"] = live.frame_index;
    one["after_s"] = (live.stamp - live.begun).seconds();
    one["stall_ms"] = live.stall_ms;
    list.push_back(std::move(one));
  }
  return list;
}

}  // namespace

double longest_stall_ms(const SlamPipeline::State& state) {
  double longest_ms = 0;
  for (const LiveCorrection& live : state.live_corrections) longest_ms = std::max(longest_ms, live.stall_ms);
  return longest_ms;
}

JsonValue to_json(const SlamSummary& summary) {
  const SlamPipeline::State& state = summary.state;
  auto json = JsonValue::object();
  json["method"] = kOdometryMethodNames[static_cast<std::size_t>(summary.parameters.odometry.method)];
  add_json(json, state.track);
  json["loops"] = loops_to_json(state.loops);
  json["bundle_adjustment"] = adjustment_to_json(state.alignment);
  add_json(json, summary.error);
  if (summary.odometry_error) {
    auto odometry = JsonValue::object();
    add_json(odometry, summary.odometry_error);
    json["odometry"] = std::move(odometry);
  }
  json["largest_correction_m"] = state.largest_shift_m;
  if (state.dense_alignment) json["alignment"] = to_json(*state.dense_alignment);
  json["frames_mapped"] = state.frames_mapped;
  json["frames_disconnected"] = state.frames_disconnected;
  json["map_correction"] = correction_to_json(state.correction);
  json["live_corrections"] = live_corrections_to_json(state.live_corrections);
  json["longest_stall_ms"] = longest_stall_ms(state);
  json["frame_ms"] = JsonValue::object({{"median", state.frame_ms.median},
                                        {"mean", state.frame_ms.mean},
                                        {"p99", state.frame_ms.p99},
                                        {"max", state.frame_ms.max}});
  json["volumes"] = summary.volumes;
  json["map_bytes"] = summary.map_bytes;
  json["mesh"] = JsonValue::object({{"vertices", summary.vertices}, {"triangles", summary.triangles}});
  json["bounds_m"] = to_json(summary.bounds_m);
  if (summary.mesh_error) json["mesh_error"] = to_json(*summary.mesh_error, summary.parameters.mesh_error);
  if (summary.odometry_mesh_error)
    json["odometry_mesh_error"] = to_json(*summary.odometry_mesh_error, summary.parameters.mesh_error);
  json["interrupted"] = state.interrupted;
  json["run_s"] = summary.run_s;
  return json;
}

std::string to_text(const SlamSummary& summary) {
  const SlamPipeline::State& state = summary.state;
  std::string text = to_text(state.track);
  text += fmt::format("loops     {} of {} candidates accepted, largest correction {:.3f} m\n",
                      state.loops.accepted, state.loops.candidates, state.largest_shift_m);
  if (const auto& alignment = state.dense_alignment)
    text += fmt::format("alignment {} frames aligned, {} not; {:.1f} ms a frame, 99 % under {:.1f} ms\n",
                        alignment->accepted, alignment->not_accepted, alignment->milliseconds.mean,
                        alignment->milliseconds.p99);
  if (state.alignment.adjusted)
    text += fmt::format(
        "bundle    {} landmarks, {} matches of loops, {} of other visits; {:.2f} px before, {:.2f} px "
        "after\n",
        state.alignment.landmarks, state.alignment.loop_links, state.alignment.visit_links,
        state.alignment.error_before_px, state.alignment.error_after_px);
  text += to_text_line(summary.odometry_error, "odometry") + to_text_line(summary.error, "corrected");
  const MapCorrection& correction = state.correction;
  text += fmt::format("map       {} frames, {} volumes, {} triangles; {} of {} volumes rebuilt in {:.1f} s\n",
                      state.frames_mapped, summary.volumes, summary.triangles, correction.volumes_rebuilt,
                      correction.volumes_before, correction.seconds);
  if (!state.live_corrections.empty())
    text += fmt::format("          corrected {} times while tracking, which waited {:.1f} ms at most\n",
                        state.live_corrections.size(), longest_stall_ms(state));
  if (summary.odometry_mesh_error)
    text += fmt::format("surface error before loops were closed {:.2f} mm\n",
                        summary.odometry_mesh_error->accuracy.distance_m.mean * 1e3);
  if (summary.mesh_error)
    text += fmt::format("surface error {:.2f} mm (mean), {:.1f} % complete\n",
                        summary.mesh_error->accuracy.distance_m.mean * 1e3,
                        summary.mesh_error->completeness.ratio * 100);
  for (const auto& path : summary.outputs) text += fmt::format("  {}\n", path.string());
  return text;
}

}  // namespace hm
