#include "hm/pipeline/laser/laser_summary.hpp"

#include "hm/io/bytes/text_lines.hpp"
#include "hm/pipeline/common/box_json.hpp"

namespace hm {
namespace {

void count(LocalisationStatus status, LocalisationSummary& summary) {
  ++summary.sought;
  switch (status) {
    case LocalisationStatus::kLocalised:
      ++summary.searches, ++summary.found, ++summary.located;
      return;
    case LocalisationStatus::kTracking:
      ++summary.located;
      return;
    case LocalisationStatus::kMatchFailed:
      ++summary.match_failed;
      return;
    case LocalisationStatus::kLost:
      ++summary.lost;
      return;
    case LocalisationStatus::kAmbiguous:
      ++summary.searches, ++summary.ambiguous;
      return;
    case LocalisationStatus::kGaveUp:
      ++summary.searches, ++summary.gave_up;
      return;
    case LocalisationStatus::kTooFewPoints:
      ++summary.too_few_points;
      return;
    case LocalisationStatus::kNotFound:
    case LocalisationStatus::kEmptyMap:
      ++summary.searches, ++summary.not_found;
  }
}

LocalisationSummary summarise_localisation(std::span<const LaserScanRecord> records) {
  LocalisationSummary summary;
  std::vector<double> scores, corrections_m;
  std::optional<SE2> last;
  for (const LaserScanRecord& record : records) {
    const auto& place = record.step.map_frame.localisation;
    if (!place) continue;
    count(place->status, summary);
    if (!place->T_map_base) continue;
    scores.push_back(place->score);
    const SE2& T_map_odom = record.step.map_frame.T_map_odom;
    if (!summary.first_fix_s) summary.first_fix_s = record.time_s;
    if (last)
      corrections_m.push_back((place->T_map_base->translation() -
                               *last * (T_map_odom.inverse() * place->T_map_base->translation()))
                                  .norm());
    last = T_map_odom;
  }
  summary.score = summarise(scores);
  summary.correction_m = summarise(corrections_m);
  return summary;
}

JsonValue pose_to_json(const SE2& pose) {
  return JsonValue::object({{"x_m", pose.x()}, {"y_m", pose.y()}, {"yaw_rad", pose.angle()}});
}

/// What both sources have in common.
JsonValue common_json(const MapFrameSummary& summary) {
  auto json = JsonValue::object({{"corrected", summary.corrected},
                                 {"T_map_odom", pose_to_json(summary.T_map_odom)},
                                 {"max_shift_m", summary.max_shift_m},
                                 {"changes", summary.history.size()},
                                 {"ms_median", summary.ms.median},
                                 {"ms_p99", summary.ms.p99},
                                 {"ms_max", summary.ms.max},
                                 {"rebuild_s", summary.rebuild_s}});
  if (summary.mvog_odom)
    json["mvog_odom"] = JsonValue::object({{"bytes", summary.mvog_odom->bytes},
                                           {"area_m2", summary.mvog_odom->area_m2},
                                           {"volumes_positive", summary.mvog_odom->volumes_positive},
                                           {"volumes_negative", summary.mvog_odom->volumes_negative}});
  return json;
}

std::string localisation_text(const LocalisationSummary& place) {
  return fmt::format(
      "place     in {}: {} of {} scans, first after {:.1f} s, score {:.2f} (median), against odometry {:.3f} "
      "m "
      "(median) {:.3f} m (99 %)\n          {} searches of the whole map ({} found, {} ambiguous, {} nowhere, "
      "{} "
      "given up), lost {} times\n",
      place.map.string(), place.located, place.sought, place.first_fix_s.value_or(0), place.score.median,
      place.correction_m.median, place.correction_m.p99, place.searches, place.found, place.ambiguous,
      place.not_found, place.gave_up, place.lost);
}

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

MapFrameSummary summarise_map_frame(const LaserMapFrame& frame, std::span<const LaserScanRecord> records) {
  MapFrameSummary summary;
  summary.source = frame.source();
  if (summary.source == MapFrameSource::kOdometry) return summary;
  summary.corrected = frame.corrects();
  summary.history = frame.history();
  if (!summary.history.empty()) summary.T_map_odom = summary.history.back().T_map_odom;
  std::vector<double> ms;
  for (const LaserScanRecord& record : records) ms.push_back(record.step.map_frame.ms);
  summary.ms = summarise(ms);
  if (const LoopCloser* loops = frame.loops()) {
    summary.nodes = loops->graph().size();
    summary.solutions = static_cast<std::size_t>(loops->solutions());
    summary.loops = loops->graph().statistics();
  } else {
    summary.localisation = summarise_localisation(records);
  }
  return summary;
}

JsonValue loops_to_json(const MapFrameSummary& summary) {
  if (summary.source != MapFrameSource::kLoops) return {};
  const ScanGraphStatistics& loops = summary.loops;
  JsonValue json = common_json(summary);
  json["nodes"] = summary.nodes;
  json["solutions"] = summary.solutions;
  json["candidates"] = loops.candidates;
  json["accepted"] = loops.accepted;
  json["rejected"] = loops.rejected();
  json["no_match"] = loops.no_match;
  json["ambiguous"] = loops.ambiguous;
  json["gave_up"] = loops.gave_up;
  json["not_verified"] = loops.not_verified;
  json["taken_out"] = loops.taken_out;
  return json;
}

JsonValue localisation_to_json(const MapFrameSummary& summary) {
  if (!summary.localisation) return {};
  const LocalisationSummary& place = *summary.localisation;
  JsonValue json = common_json(summary);
  json["map"] = place.map.string();
  json["sure"] = place.is_sure();
  json["located"] = place.located;
  json["sought"] = place.sought;
  json["searches"] = place.searches;
  json["found"] = place.found;
  json["ambiguous"] = place.ambiguous;
  json["not_found"] = place.not_found;
  json["gave_up"] = place.gave_up;
  json["match_failed"] = place.match_failed;
  json["lost"] = place.lost;
  json["too_few_points"] = place.too_few_points;
  json["first_fix_s"] = place.first_fix_s ? JsonValue(*place.first_fix_s) : JsonValue();
  json["score"] = JsonValue::object({{"median", place.score.median}, {"min", place.score.min}});
  json["correction_m"] =
      JsonValue::object({{"median", place.correction_m.median}, {"p99", place.correction_m.p99}});
  return json;
}

JsonValue history_to_json(const MapFrameSummary& summary, Time begin) {
  auto time_s = JsonValue::array(), x_m = JsonValue::array(), y_m = JsonValue::array(),
       yaw_rad = JsonValue::array();
  for (const MapFrameChange& change : summary.history) {
    time_s.push_back((change.stamp - begin).seconds());
    x_m.push_back(change.T_map_odom.x());
    y_m.push_back(change.T_map_odom.y());
    yaw_rad.push_back(change.T_map_odom.angle());
  }
  return JsonValue::object({{"time_s", time_s}, {"x_m", x_m}, {"y_m", y_m}, {"yaw_rad", yaw_rad}});
}

std::string map_frame_csv(const MapFrameSummary& summary) {
  std::string text = "stamp_s,x_m,y_m,yaw_rad\n";
  for (const MapFrameChange& change : summary.history)
    text += fmt::format("{},{:.5f},{:.5f},{:.6f}\n", stamp_text(change.stamp), change.T_map_odom.x(),
                        change.T_map_odom.y(), change.T_map_odom.angle());
  return text;
}

std::string to_text(const MapFrameSummary& summary) {
  std::string text;
  const ScanGraphStatistics& loops = summary.loops;
  if (summary.source == MapFrameSource::kLoops)
    text += fmt::format("loops     {} of {} candidates closed; {} nodes, solved {} times\n",
                        loops.accepted - loops.taken_out, loops.candidates, summary.nodes, summary.solutions);
  if (summary.localisation) text += localisation_text(*summary.localisation);
  if (summary.corrected)
    text += fmt::format(
        "          odom to map at the end ({:.3f}, {:.3f}) m, {:.4f} rad; map made anew in {:.1f} s\n",
        summary.T_map_odom.x(), summary.T_map_odom.y(), summary.T_map_odom.angle(), summary.rebuild_s);
  return text;
}

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
