#include <memory>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/compare/trajectory_evaluation.hpp"
#include "program.hpp"

namespace {

struct EvaluateParameters {
  hm::MeshErrorParams mesh_error;
  hm::TrajectoryErrorParams trajectory_error;
};

hm::ParamList list_evaluation(EvaluateParameters& parameters) {
  hm::ParamList list;
  list.add("mesh_error", parameters.mesh_error);
  list.add("trajectory_error", parameters.trajectory_error);
  return list;
}

struct EvaluateFlags {
  std::string result, truth, report, alignment;
};

/// Writes the page of --report, if there is one.
hm::Result<void> write_report(const EvaluateFlags& flags, const std::string& html, Outcome& outcome) {
  if (const auto written = hm::as_run_failure(hm::write_file_text(flags.report, html)); !written)
    return written;
  outcome.outputs.emplace_back(flags.report);
  return {};
}

hm::Result<Outcome> run_trajectory(const EvaluateFlags& flags, Session& session) {
  EvaluateParameters parameters;
  const auto list = list_evaluation(parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  for (std::size_t i = 0; i < hm::kTrajectoryAlignmentNames.size(); ++i)
    if (flags.alignment == hm::kTrajectoryAlignmentNames[i])
      parameters.trajectory_error.alignment = static_cast<hm::TrajectoryAlignment>(i);
  std::vector<std::string> warnings;
  const auto error =
      hm::evaluate_trajectory_files(flags.result, flags.truth, parameters.trajectory_error, warnings);
  if (!error) return hm::forward_error(error);
  Outcome outcome{hm::to_text(*error), hm::to_json(*error), std::move(warnings), {}};
  if (!flags.report.empty()) {
    const auto written =
        write_report(flags, hm::trajectory_report_html(*error, "Trajectory against truth"), outcome);
    if (!written) return hm::forward_error(written);
  }
  return outcome;
}

hm::Result<Outcome> run_mesh(const EvaluateFlags& flags, Session& session) {
  EvaluateParameters parameters;
  const auto list = list_evaluation(parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  const auto mesh = hm::read_mesh(flags.result);
  if (!mesh) return hm::forward_error(mesh);
  const auto truth = hm::read_mesh_truth(flags.truth);
  if (!truth) return hm::forward_error(truth);
  const hm::ParallelLoop loop(session.threads());
  const auto& params = parameters.mesh_error;
  const auto error = hm::evaluate_mesh(*mesh, truth->mesh, params, loop, truth->visible_points);
  if (!error) return hm::forward_error(error);
  const hm::MeasuredMesh measured{*error, params};
  Outcome outcome{to_text(measured), to_json(measured), {}, {}};
  if (!flags.report.empty()) {
    const auto written = write_report(flags, hm::mesh_report_html(*mesh, *truth, measured, loop), outcome);
    if (!written) return hm::forward_error(written);
  }
  return outcome;
}

void add_evaluate(Program& program) {
  program.add({"evaluate",
               "Compare trajectories and meshes with ground truth.",
               "  hm evaluate trajectory result/trajectory.tum recording\n"
               "  hm evaluate mesh result/mesh.ply recording",
               {}});
  auto flags = std::make_shared<EvaluateFlags>();
  const auto add_paths = [flags](CLI::App& command, const char* result, const char* truth) {
    command.add_option("result", flags->result, result)->required();
    command.add_option("truth", flags->truth, truth)->required();
    command.add_option("--report", flags->report, "write a report with plots to this .html file");
  };
  CLI::App& trajectory = program.add(
      {"evaluate trajectory",
       "Measure the absolute and relative error of a trajectory (ATE; RPE per frame, second and metre).",
       "  hm evaluate trajectory result/trajectory.tum recording\n"
       "  hm evaluate trajectory result/trajectory.tum recording/groundtruth.txt "
       "--alignment none --report ate.html",
       [flags](Session& session) { return run_trajectory(*flags, session); }});
  add_paths(trajectory, "trajectory (TUM, EuRoC, KITTI), or a recording with poses",
            "true trajectory, or a recording with true poses");
  trajectory
      .add_option("--alignment", flags->alignment,
                  "transformation that aligns the estimate first: se3 (default), sim3, yaw or none "
                  "(trajectory_error.alignment)")
      ->check(CLI::IsMember({"se3", "sim3", "yaw", "none"}));
  add_paths(
      program.add({"evaluate mesh", "Measure the accuracy and completeness of a mesh.",
                   "  hm evaluate mesh result/mesh.ply recording\n"
                   "  hm evaluate mesh result/mesh.glb recording/truth_mesh.ply --report mesh.html --json",
                   [flags](Session& session) { return run_mesh(*flags, session); }}),
      "mesh: .ply .obj .glb .gltf .stl .off .dae .fbx", "true mesh, or folder of a simulated recording");
  program.add_parameters([] { return hm::make_parameter_part(list_evaluation); });
}

const VerbRegistration kEvaluate(90, add_evaluate);

}  // namespace
