#include "hm/pipeline/common/box_json.hpp"
#include "hm/pipeline/laser/laser_run.hpp"

namespace hm {
namespace {

JsonValue times_to_json(const Summary& times) {
  return JsonValue::object(
      {{"median", times.median}, {"p99", times.p99}, {"mean", times.mean}, {"max", times.max}});
}

JsonValue mvog_to_json(const MvogSize& size) {
  return JsonValue::object({{"bytes", size.bytes},
                            {"area_m2", size.area_m2},
                            {"volumes_positive", size.volumes_positive},
                            {"volumes_negative", size.volumes_negative},
                            {"columns", size.columns},
                            {"tiles", size.tiles}});
}

JsonValue floors_to_json(const std::vector<FloorLevel>& floors) {
  auto list = JsonValue::array();
  for (const FloorLevel& floor : floors)
    list.push_back(JsonValue::object({{"level_m", floor.level_m}, {"std_m", floor.std_m}}));
  return list;
}

JsonValue relation_m_to_json(const RelationErrors& errors) {
  return JsonValue::object({{"mean", errors.translation_m.mean}, {"std", errors.translation_std_m}});
}

JsonValue relation_rad_to_json(const RelationErrors& errors) {
  return JsonValue::object({{"mean", errors.rotation_rad.mean}, {"std", errors.rotation_std_rad}});
}

/// Before the run was corrected.
void add_errors_of_odom(const LaserSummary& summary, JsonValue& json) {
  if (summary.error_odom) {
    json["ate_rmse_odom_m"] = summary.error_odom->position_m.rmse;
    json["ate_rotation_rmse_odom_rad"] = summary.error_odom->rotation_rad.rmse;
  }
  if (!summary.relation_error_odom) return;
  json["relation_error_odom_m"] = relation_m_to_json(*summary.relation_error_odom);
  json["relation_error_odom_rad"] = relation_rad_to_json(*summary.relation_error_odom);
}

void add_errors(const LaserSummary& summary, JsonValue& json) {
  if (summary.error) {
    json["ate_rmse_m"] = summary.error->position_m.rmse;
    json["ate_rotation_rmse_rad"] = summary.error->rotation_rad.rmse;
    json["truth"] = summary.truth_source;
  }
  if (summary.height_error) {
    json["height_rmse_m"] = summary.height_error->rmse_m;
    json["height_offset_m"] = summary.height_error->offset_m;
  }
  if (!summary.relation_error) return;
  const RelationErrors& errors = *summary.relation_error;
  json["relation_error_m"] = relation_m_to_json(errors);
  json["relation_error_rad"] = relation_rad_to_json(errors);
  json["relations"] = JsonValue::object({{"used", errors.errors.size()}, {"unmatched", errors.unmatched}});
}

std::string error_text(const LaserSummary& summary) {
  std::string text;
  if (summary.error)
    text += fmt::format("against the truth: position RMSE {:.4f} m, rotation RMSE {:.3f} deg ({} poses)\n",
                        summary.error->position_m.rmse, summary.error->rotation_rad.rmse * 57.29577951308232,
                        summary.error->pairs);
  if (summary.height_error)
    text += fmt::format("                   height RMSE {:.4f} m, at most {:.4f} m\n",
                        summary.height_error->rmse_m, summary.height_error->max_m);
  if (summary.relation_error)
    text += fmt::format("against {} relations: {:.4f} m +- {:.4f} m, {:.5f} rad\n",
                        summary.relation_error->errors.size(), summary.relation_error->translation_m.mean,
                        summary.relation_error->translation_std_m, summary.relation_error->rotation_rad.mean);
  if (summary.error_odom)
    text += fmt::format("before correction: position RMSE {:.4f} m\n", summary.error_odom->position_m.rmse);
  if (summary.relation_error_odom)
    text += fmt::format("before correction: relations {:.4f} m, {:.5f} rad\n",
                        summary.relation_error_odom->translation_m.mean,
                        summary.relation_error_odom->rotation_rad.mean);
  return text;
}

}  // namespace

JsonValue to_json(const LaserSummary& summary) {
  auto json = JsonValue::object();
  json["kind"] = summary.kind;
  json["laser"] = summary.laser;
  json["poses"] = summary.matched_scans ? "scans" : "odometry";
  json["pace"] = summary.pace == LaserPace::kRealtime ? "realtime" : "fast";
  json["choices"] = JsonValue::array_of(summary.choices);
  json["scans"] = JsonValue::object({{"total", summary.scans_total},
                                     {"read", summary.scans_read},
                                     {"posed", summary.trajectory.size()},
                                     {"matched", summary.scans_matched},
                                     {"failed", summary.scans_failed},
                                     {"dropped", summary.scans_dropped},
                                     {"keyframes", summary.keyframes},
                                     {"searched", summary.scans_searched},
                                     {"found", summary.scans_found},
                                     {"restarts", summary.restarts}});
  auto reasons = JsonValue::object();
  for (const auto& [reason, count] : summary.failure_reasons) reasons[reason] = count;
  json["failure_reasons"] = std::move(reasons);
  json["interrupted"] = summary.interrupted;
  json["run_s"] = summary.run_s;
  json["recording_s"] = summary.recording_s;
  json["match_ms"] = summary.matched_scans ? times_to_json(summary.match_ms) : JsonValue();
  json["insert_ms"] = times_to_json(summary.insert_ms);
  json["insert_us_per_beam"] = summary.insert_us_per_beam;
  json["beams"] = summary.beams;
  json["path_length_m"] = path_length(summary.trajectory);
  json["mvog"] = mvog_to_json(summary.mvog);
  json["bounds_m"] = to_json(summary.bounds_m);
  if (!summary.floors.empty()) json["floors"] = floors_to_json(summary.floors);
  json["loops"] = loops_to_json(summary.map_frame);
  json["localisation"] = localisation_to_json(summary.map_frame);
  json["path_length_odom_m"] = path_length(summary.trajectory_odom);
  add_errors(summary, json);
  add_errors_of_odom(summary, json);
  return json;
}

std::string to_text(const LaserSummary& summary) {
  std::string text;
  for (const std::string& choice : summary.choices) text += fmt::format("  {}\n", choice);
  text += fmt::format("{} of {} scans have a pose, {} have none; {} keyframes, path {:.2f} m\n",
                      summary.trajectory.size(), summary.scans_total, summary.scans_failed, summary.keyframes,
                      path_length(summary.trajectory));
  if (summary.scans_dropped > 0) text += fmt::format("{} scans were dropped\n", summary.scans_dropped);
  if (summary.matched_scans)
    text += fmt::format("matching  median {:.3f} ms, 99 % under {:.3f} ms a scan\n", summary.match_ms.median,
                        summary.match_ms.p99);
  if (summary.scans_searched > 0)
    text += fmt::format("search    {} scans sought among the last keyframes, {} placed by it alone\n",
                        summary.scans_searched, summary.scans_found);
  text += to_text(summary.map_frame);
  text += fmt::format("map       {:.1f} m2, {} occupied and {} free volumes, {:.2f} MB; {:.2f} us a beam\n",
                      summary.mvog.area_m2, summary.mvog.volumes_positive, summary.mvog.volumes_negative,
                      static_cast<double>(summary.mvog.bytes) * 1e-6, summary.insert_us_per_beam);
  if (!summary.floors.empty()) {
    text += "floors   ";
    for (const FloorLevel& floor : summary.floors) text += fmt::format(" {:.2f} m", floor.level_m);
    text += "\n";
  }
  if (summary.recording_s > 0)
    text +=
        fmt::format("time      {:.1f} s for a recording of {:.1f} s\n", summary.run_s, summary.recording_s);
  text += error_text(summary);
  for (const auto& path : summary.outputs) text += fmt::format("  {}\n", path.string());
  return text;
}

}  // namespace hm
