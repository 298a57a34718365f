#include "hm/pipeline/laser/laser_map_summary.hpp"

#include "hm/io/bytes/text_lines.hpp"
#include "hm/pipeline/laser/laser_run.hpp"

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
JsonValue common_json(const LaserMapSummary& summary) {
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

}  // namespace

LaserMapSummary summarise_map_frame(const LaserMapFrame& frame, std::span<const LaserScanRecord> records) {
  LaserMapSummary summary;
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

JsonValue loops_to_json(const LaserMapSummary& summary) {
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

JsonValue localisation_to_json(const LaserMapSummary& summary) {
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

JsonValue history_to_json(const LaserMapSummary& summary, Time begin) {
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

std::string map_frame_csv(const LaserMapSummary& summary) {
  std::string text = "stamp_s,x_m,y_m,yaw_rad\n";
  for (const MapFrameChange& change : summary.history)
    text += fmt::format("{},{:.5f},{:.5f},{:.6f}\n", stamp_text(change.stamp), change.T_map_odom.x(),
                        change.T_map_odom.y(), change.T_map_odom.angle());
  return text;
}

std::string to_text(const LaserMapSummary& summary) {
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

}  // namespace hm
