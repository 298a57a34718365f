#include "hm/pipeline/laser/run/laser_summary.hpp"

#include <algorithm>

#include "hm/core/angle.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/pipeline/common/box_json.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

/// Adds mean, deviation and 95th percentile of the errors of relative poses.
void add_relations(SummaryTree& v, const SummaryDoc& doc, const Summary& errors, double deviation) {
  v.object(doc.key, [&](SummaryTree& error) {
    error({"mean", doc.label, doc.format}, errors.mean);
    error({"std", {}, doc.format}, deviation);
    error({"p95", {}, doc.format}, errors.p95);
  });
}

void add_errors(const LaserSummary& summary, SummaryTree& v) {
  if (summary.error) {
    v({"ate_rmse_m", "position error, RMSE", "{:.4f} m"}, summary.error->position_m.rmse);
    v.or_null({"ate_rotation_rmse_rad", "rotation error, RMSE", "{:.3f} deg", kDegreesPerRadian},
              rotation_rmse_rad(*summary.error));
    v({"ate_rotation_own_rmse_rad", "rotation error, aligned on its own", "{:.3f} deg", kDegreesPerRadian},
      summary.error->rotation_own_rad.rmse);
    v({"truth", "truth"}, summary.truth_source);
    v.shown("pairs", "poses compared", summary.error->pairs);
    v.shown("truth_path", "true path", fmt::format("{:.2f} m", summary.error->truth_path_m));
  }
  if (summary.height_error) {
    v({"height_rmse_m", "height error, RMSE", "{:.4f} m"}, summary.height_error->rmse_m);
    v({"height_offset_m", {}, "{:.4f} m"}, summary.height_error->offset_m);
    v.shown("height_max_m", "height error, at most", fmt::format("{:.4f} m", summary.height_error->max_m));
  }
  if (!summary.relation_error) return;
  const RelationErrors& errors = *summary.relation_error;
  add_relations(v, {"relation_error_m", "relations, mean error", "{:.4f} m"}, errors.translation_m,
                errors.translation_std_m);
  add_relations(v, {"relation_error_rad", "relations, mean error", "{:.5f} rad"}, errors.rotation_rad,
                errors.rotation_std_rad);
  v.object("relations", [&](SummaryTree& relations) {
    relations({"used", "relations used"}, errors.errors.size());
    relations({"unmatched", "relations without a pose"}, errors.unmatched);
  });
}

/// Adds the errors before the run was corrected.
void add_errors_of_odom(const LaserSummary& summary, SummaryTree& v) {
  if (summary.error_odom) {
    v({"ate_rmse_odom_m", {}, "{:.4f} m"}, summary.error_odom->position_m.rmse);
    v.or_null({"ate_rotation_rmse_odom_rad", {}, "{:.3f} deg", kDegreesPerRadian},
              rotation_rmse_rad(*summary.error_odom));
  }
  if (!summary.relation_error_odom) return;
  const RelationErrors& errors = *summary.relation_error_odom;
  add_relations(v, {"relation_error_odom_m", {}, "{:.4f} m"}, errors.translation_m, errors.translation_std_m);
  add_relations(v, {"relation_error_odom_rad", {}, "{:.5f} rad"}, errors.rotation_rad,
                errors.rotation_std_rad);
}

void add_size(const MvogSize& size, SummaryTree& v) {
  v({"bytes", "memory", "{:.2f} MB", 1e-6}, size.bytes);
  v({"area_m2", "area of the map", "{:.1f} m2"}, size.area_m2);
  v({"volumes_positive", "occupied volumes"}, size.volumes_positive);
  v({"volumes_negative", "free volumes"}, size.volumes_negative);
}

/// Adds what loops and a saved map have in common.
void add_map_frame(const MapFrameSummary& map, SummaryTree& v) {
  v({"corrected"}, map.corrected);
  v.object("T_map_odom", [&](SummaryTree& pose) {
    pose({"x_m", {}, "{:.3f}"}, map.T_map_odom.x());
    pose({"y_m", {}, "{:.3f}"}, map.T_map_odom.y());
    pose({"yaw_rad", {}, "{:.4f} rad"}, map.T_map_odom.angle());
  });
  v({"max_shift_m", "poses moved, at most", "{:.2f} m"}, map.max_shift_m);
  v({"changes", "changes of T_map_odom"}, map.history.size());
  if (map.ms.max > 0) {
    v({"ms_median", "a scan, median", "{:.2f} ms"}, map.ms.median);
    v({"ms_p99", "a scan, 99 % under", "{:.2f} ms"}, map.ms.p99);
    v({"ms_max", "a scan, at most", "{:.2f} ms"}, map.ms.max);
  }
  v({"rebuild_s", "map rebuilt in", "{:.1f} s"}, map.rebuild_s);
  if (!map.mvog_odom) return;
  SummaryTree odom;
  add_size(*map.mvog_odom, odom);
  v.json("mvog_odom", odom.json());
}

void add_loops(const MapFrameSummary& map, SummaryTree& v) {
  const ScanGraphStatistics& loops = map.loops;
  add_map_frame(map, v);
  v({"nodes", "nodes of the graph"}, map.nodes);
  v({"solutions", "times solved"}, map.solutions);
  v({"candidates", "candidates"}, loops.candidates);
  v({"accepted", "accepted"}, loops.accepted);
  v.shown("closed", "closed", loops.accepted - loops.removed);
  v({"rejected", "rejected"}, loops.rejected());
  v({"no_match", "no match"}, loops.no_match);
  v({"ambiguous", "it fits several places"}, loops.ambiguous);
  v({"limit_reached", "search limit reached"}, loops.limit_reached);
  v({"not_verified", "not confirmed by PL-ICP"}, loops.not_verified);
  v({"alone", "no other loop agrees"}, loops.alone);
  v({"removed", "removed again: contradicted by others"}, loops.removed);
  const LoopRevision& revision = map.revision;
  v({"revision_trials", "left out on trial at the end"}, revision.trials);
  v({"revision_searched", "keyframes searched again at the end"}, revision.searched);
  v.or_null({"revised", "changed at the end: the map agrees better with itself"},
            revision.trials > 0 ? std::optional(revision.changes) : std::nullopt);
  v({"registered", "matches with keyframes around, at the end"}, map.registration.registered);
  v.or_null({"registration_moved_m", "keyframes moved by them, at most", "{:.3f} m"},
            map.registration.registered > 0 ? std::optional(map.registration.moved_m) : std::nullopt);
  v({"unchecked_turn_rad", "turned by them where no loop spans the path, at most", "{:.3f} rad"},
    map.registration.unchecked.angle_rad);
  v.or_null({"wrong", "closed, but contradicted by the truth"}, map.wrong_loops);
}

void add_place(const MapFrameSummary& map, const LocalisationSummary& place, SummaryTree& v) {
  add_map_frame(map, v);
  v({"map", "map"}, place.map.string());
  v({"sure", "sure"}, place.is_sure());
  v({"located", "scans located"}, place.located);
  v({"scans", "scans to be located"}, place.scans);
  v({"searches", "searches of the whole map"}, place.searches);
  v({"found", "found"}, place.found);
  v({"ambiguous", "ambiguous"}, place.ambiguous);
  v({"not_found", "not found"}, place.not_found);
  v({"limit_reached", "search limit reached"}, place.limit_reached);
  v({"match_failed", "not matched"}, place.match_failed);
  v({"lost", "lost"}, place.lost);
  v({"too_few_points", "too few points"}, place.too_few_points);
  v.or_null({"first_fix_s", "first located after", "{:.2f} s"}, place.first_fix_s);
  v.spread({"score", "score of the located scans (1: every point on a wall)", "{:.2f}"}, place.score,
           {"median", "min"});
  v.spread({"correction_m", "jumps against odometry, a scan", "{:.3f} m"}, place.correction_m,
           {"median", "p99"});
}

/// Adds what became of the scans.
void add_scans(const LaserSummary& summary, SummaryTree& v) {
  v.object("scans", [&](SummaryTree& scans) {
    scans({"total"}, summary.scans_total);
    scans({"read"}, summary.scans_read);
    scans({"posed"}, summary.trajectory.size());
    scans({"matched"}, summary.scans_matched);
    scans({"failed"}, summary.scans_failed);
    scans({"dropped"}, summary.scans_dropped);
    scans({"keyframes"}, summary.keyframes);
    scans({"searched"}, summary.scans_searched);
    scans({"found"}, summary.scans_found);
    scans({"unconfirmed"}, summary.scans_unconfirmed);
    scans({"restarts"}, summary.restarts);
    scans({"length_unobserved"}, summary.scans_length_unobserved);
  });
  v({"guessed_m", "motion along bare walls that was guessed", "{:.1f} m"}, summary.guessed_m);
  v({"longest_guess_m", "the longest of it", "{:.1f} m"}, summary.longest_guess_m);
  v.object("failure_reasons", [&](SummaryTree& reasons) {
    for (const auto& [reason, count] : summary.failure_reasons) reasons({reason, reason}, count);
  });
}

/// Adds the times of the run and of its steps.
void add_times(const LaserSummary& summary, SummaryTree& v) {
  v({"run_s", "time", "{:.1f} s"}, summary.run_s);
  v({"recording_s", "recording", "{:.1f} s"}, summary.recording_s);
  v({"odometry_delay_s", "odometry read before the stamps of scans by", "{:.2f} s"},
    summary.odometry_delay_s);
  v.spread({"scan_ms", "a scan", "{:.3f} ms"}, summary.scan_ms);
  v.json("match_ms", {});
  if (summary.matched_scans) v.spread({"match_ms", "matching", "{:.3f} ms"}, summary.match_ms);
  v.spread({"insert_ms", "inserting", "{:.3f} ms"}, summary.insert_ms);
  v({"insert_us_per_beam", "inserting a beam", "{:.2f} us"}, summary.insert_us_per_beam);
}

}  // namespace

MapFrameSummary summarise_map_frame(const LaserMapFrame& frame) {
  MapFrameSummary summary;
  summary.source = frame.source();
  if (summary.source == MapFrameSource::kOdometry) return summary;
  summary.corrected = frame.corrects();
  summary.history = frame.history();
  if (!summary.history.empty()) summary.T_map_odom = summary.history.back().T_map_odom;
  if (const LaserLoopCloser* loops = frame.loops()) {
    summary.nodes = loops->graph().size();
    summary.solutions = static_cast<std::size_t>(loops->solutions());
    summary.revision = loops->revision();
    summary.registration = loops->registration();
    summary.loops = loops->graph().statistics();
  }
  return summary;
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

void visit(const MvogSize& size, SummaryTree& v) {
  add_size(size, v);
  v({"columns"}, size.columns);
  v({"tiles"}, size.tiles);
}

void visit(const FloorLevel& floor, SummaryTree& v) {
  v({"level_m", "floor", "{:.3f} m"}, floor.level_m);
  v({"std_m", "standard deviation", "{:.3f} m"}, floor.std_m);
  v.shown("sightings", "scans", floor.sightings);
}

void visit(const LaserPiece& piece, SummaryTree& v) {
  v({"map", "map"}, piece.map.string());
  v({"begin_s", "begin", "{:.1f} s"}, piece.begin_s);
  v({"end_s", "end", "{:.1f} s"}, piece.end_s);
  v({"scans", "scans"}, piece.scans);
  v({"path_m", "path", "{:.1f} m"}, piece.path_m);
}

void visit(const LaserSummary& summary, SummaryTree& v) {
  v.group("verdict", summary.verdict);
  v.list("pieces", summary.pieces);
  v({"kind"}, summary.kind);
  v({"laser"}, summary.laser);
  v({"poses"}, summary.matched_scans ? "scans" : "odometry");
  v({"pace"}, summary.pace == LaserPace::kRealtime ? "realtime" : "fast");
  v.json("choices", JsonValue::array_of(summary.choices));
  add_scans(summary, v);
  v({"interrupted"}, summary.interrupted);
  add_times(summary, v);
  v({"beams", "beams in the map"}, summary.beams);
  v({"path_length_m", "path", "{:.2f} m"}, path_length(summary.trajectory));
  v.group("mvog", summary.mvog);
  v({"columns_refused"}, summary.columns_refused);
  add_box(v, "bounds_m", summary.bounds_m);
  if (!summary.floors.empty()) v.list("floors", summary.floors);
  const MapFrameSummary& map = summary.map_frame;
  v.json("loops", {});
  if (map.source == MapFrameSource::kLoops)
    v.object("loops", [&](SummaryTree& loops) { add_loops(map, loops); });
  v.json("localisation", {});
  if (map.localisation)
    v.object("localisation", [&](SummaryTree& place) { add_place(map, *map.localisation, place); });
  v({"path_length_odom_m", "path of odometry", "{:.2f} m"}, path_length(summary.trajectory_odom));
  add_errors(summary, v);
  add_errors_of_odom(summary, v);
}

namespace {

/// Loops, localisation and the correction of the map.
std::string map_frame_text(const LaserSummary& summary, const SummaryTree& tree) {
  std::string text = tree.lines(
      {"loops     {loops.closed} of {loops.candidates|candidate} closed; {loops.nodes|node}, solved "
       "{loops.solutions|time}[, revised {loops.revised|time}]",
       "place     in {localisation.map}: {localisation.located} of {localisation.scans|scan} located[, "
       "first after {localisation.first_fix_s}], score {localisation.score.median} (median), against "
       "odometry "
       "{localisation.correction_m.median} (median) {localisation.correction_m.p99} (99 %)",
       "          {localisation.searches|search|searches} of the whole map ({localisation.found} found, "
       "{localisation.ambiguous} ambiguous, {localisation.not_found} not found, {localisation.limit_reached} "
       "given "
       "up), lost {localisation.lost|time}"});
  const char* source = summary.map_frame.localisation ? "localisation" : "loops";
  if (summary.map_frame.corrected)
    text +=
        tree.lines({fmt::format("          correction at the end (T_map_odom): ({{{0}.T_map_odom.x_m}}, "
                                "{{{0}.T_map_odom.y_m}}) m, {{{0}.T_map_odom.yaw_rad}}; map rebuilt in "
                                "{{{0}.rebuild_s}}",
                                source)});
  return text;
}

}  // namespace

std::string to_text(const LaserSummary& summary) {
  const SummaryTree tree = describe(summary);
  std::string text;
  for (const std::string& choice : summary.choices)
    if (std::ranges::find(summary.warnings, choice) == summary.warnings.end()) text += "  " + choice + "\n";
  text += tree.lines({"verdict   {verdict.text}",
                      "{scans.posed} of {scans.total|scan} have a pose, {scans.failed} without; "
                      "{scans.keyframes|keyframe}, path {path_length_m}[ (true path {truth_path})]",
                      "matching  median {match_ms.median}, 99 % under {match_ms.p99} a scan"});
  if (!summary.pieces.empty())
    text += fmt::format("pieces    a map of each of {} that {} consistent: {}/\n",
                        counted(summary.pieces.size(), "piece"), summary.pieces.size() == 1 ? "is" : "are",
                        kPiecesFolder);
  if (summary.odometry_delay_s != 0)
    text +=
        tree.lines({"odometry  read {odometry_delay_s} before the stamps of scans: their turns agree then"});
  if (summary.scans_searched > 0)
    text +=
        tree.lines({"search    {scans.searched|scan} searched for among the last keyframes, "
                    "{scans.found} located only by this"});
  text += map_frame_text(summary, tree);
  text += tree.lines(
      {"map       {mvog.area_m2}, {mvog.volumes_positive} occupied and {mvog.volumes_negative} free "
       "volumes, {mvog.bytes}; {insert_us_per_beam} a beam"});
  if (!summary.floors.empty()) {
    text += "floors   ";
    for (const FloorLevel& floor : summary.floors) text += fmt::format(" {:.2f} m", floor.level_m);
    text += "\n";
  }
  text += tree.lines(
      {"time      {run_s} for a recording of {recording_s}",
       "against the truth: position RMSE {ate_rmse_m}[, rotation RMSE {ate_rotation_rmse_rad}]; orientations "
       "aligned on their own {ate_rotation_own_rmse_rad} ({pairs|pose})",
       "                   height RMSE {height_rmse_m}, at most {height_max_m}",
       "against {relations.used|relation}: {relation_error_m.mean} +- {relation_error_m.std}, "
       "{relation_error_rad.mean}",
       "before correction: position RMSE {ate_rmse_odom_m}",
       "before correction: relations {relation_error_odom_m.mean}, {relation_error_odom_rad.mean}"});
  return text + output_lines(summary.outputs);
}

std::string floors_csv(std::span<const FloorLevel> floors) {
  std::string text = "id,level_m,std_m,sightings,first_seen_s,last_seen_s\n";
  for (const FloorLevel& floor : floors)
    text += fmt::format("{},{:.4f},{:.4f},{},{},{}\n", floor.id, floor.level_m, floor.std_m, floor.sightings,
                        stamp_text(floor.first_seen), stamp_text(floor.last_seen));
  return text;
}

}  // namespace hm
