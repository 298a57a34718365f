#include <memory>

#include "flags/laser_flags.hpp"
#include "flags/recording_flags.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/pipeline/checks/laser_check.hpp"
#include "hm/pipeline/checks/recording_check.hpp"
#include "hm/pipeline/inspect/file_check.hpp"
#include "hm/pipeline/inspect/mvog_check.hpp"
#include "hm/pipeline/inspect/result_check.hpp"
#include "program.hpp"

namespace {

struct InfoFlags {
  std::string path;
  RecordingFlags of_recording;
  LaserFlags of_laser;
};

hm::Result<Outcome> show_recording(const InfoFlags& flags, Session& session) {
  const auto options = flags.of_recording.options();
  if (!options) return hm::forward_error(options);
  const auto recording = hm::open_recording(flags.path, *options);
  if (!recording) return hm::forward_error(recording);
  const auto report = hm::inspect_recording(**recording, {}, session.progress());
  Outcome outcome{hm::to_text(report), hm::to_json(report), {}, {}, true};
  for (const hm::Finding& finding : report.findings) outcome.warnings.push_back(finding.message);
  return outcome;
}

hm::Result<Outcome> show_laser_recording(const InfoFlags& flags) {
  const auto recording = hm::open_laser_recording(flags.path, flags.of_laser.options());
  if (!recording) return hm::forward_error(recording);
  const auto report = hm::inspect_laser_recording(*recording);
  Outcome outcome{hm::to_text(report), hm::to_json(report), {}, {}, true};
  for (const hm::LaserFinding& finding : report.findings) outcome.warnings.push_back(finding.message);
  return outcome;
}

template <class Report>
hm::Result<Outcome> show(const hm::Result<Report>& report) {
  if (!report) return hm::forward_error(report);
  return Outcome{hm::to_text(*report), hm::to_json(*report), {}, {}};
}

hm::Result<Outcome> show_result(const std::string& path) {
  const auto report = hm::inspect_result(path);
  if (!report) return hm::forward_error(report);
  return Outcome{hm::to_text(*report), hm::to_json(*report), report->warnings, {}};
}

hm::Result<Outcome> show_trajectory(const std::string& path) {
  const auto trajectory = hm::read_trajectory(path);
  if (!trajectory) return hm::forward_error(trajectory);
  const double duration_s = (trajectory->back().stamp - trajectory->front().stamp).seconds();
  Outcome outcome;
  outcome.text =
      fmt::format("trajectory of {}, {:.2f} s, path {:.2f} m\n", hm::counted(trajectory->size(), "pose"),
                  duration_s, hm::path_length(*trajectory));
  outcome.json = hm::JsonValue::object({{"poses", trajectory->size()},
                                        {"duration_s", duration_s},
                                        {"path_length_m", hm::path_length(*trajectory)}});
  return outcome;
}

hm::Result<Outcome> run(const InfoFlags& flags, Session& session) {
  const hm::ParamList none;  // parameters are checked, and change nothing
  if (const auto applied = session.apply(none); !applied) return hm::forward_error(applied);
  const auto kind = hm::kind_of(flags.path);
  if (!kind) return hm::forward_error(kind);
  hm::Result<Outcome> outcome;
  const char* name = "recording";
  switch (*kind) {
    case hm::PathKind::kRecording:
      outcome = show_recording(flags, session);
      break;
    case hm::PathKind::kLaserRecording:
      name = "laser_recording", outcome = show_laser_recording(flags);
      break;
    case hm::PathKind::kResult:
      name = "result", outcome = show_result(flags.path);
      break;
    case hm::PathKind::kMap:
      name = "map", outcome = show(hm::inspect_map(flags.path));
      break;
    case hm::PathKind::kOccupancy:
      name = "occupancy_map", outcome = show(hm::inspect_mvog(flags.path));
      break;
    case hm::PathKind::kMesh:
      name = "mesh", outcome = show(hm::inspect_mesh(flags.path));
      break;
    case hm::PathKind::kPoseGraph:
      name = "pose_graph", outcome = show(hm::inspect_pose_graph(flags.path));
      break;
    case hm::PathKind::kTrajectory:
      name = "trajectory", outcome = show_trajectory(flags.path);
      break;
  }
  if (!outcome) return outcome;
  auto json = hm::JsonValue::object({{"path", flags.path}, {"path_kind", name}});
  if (const auto* members = outcome->json.as_object())
    for (const auto& [key, value] : *members) json[key] = value;
  outcome->json = std::move(json);
  return outcome;
}

void add_info(Program& program) {
  auto flags = std::make_shared<InfoFlags>();
  Command command = program.add(
      {"info",
       "Show what a recording, result, map, mesh, trajectory or pose graph contains, and what looks wrong.",
       "  hm info recording\n"
       "  hm info result\n"
       "  hm info result/map.hmap\n"
       "  hm info result/mesh.ply --json",
       [flags](Session& session) { return run(*flags, session); }});
  command
      .add_option(
          "path", flags->path,
          "folder of a recording or of results, or a file: .bag .log .alog .dat .hmap .mvog .ply .obj "
          ".glb .gltf .stl .off .dae .fbx .tum .g2o")
      .required();
  flags->of_recording.add_to(command);
  flags->of_laser.add_to(command);
}

const VerbRegistration kInfo(20, add_info);

}  // namespace
