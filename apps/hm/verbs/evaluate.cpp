#include <memory>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/compare/trajectory_evaluation.hpp"
#include "hm/pipeline/compare/trajectory_report.hpp"
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

constexpr int kMostTrajectories = 1000;

struct EvaluateFlags {
  std::string result, truth, report, alignment;
  std::vector<std::string> trajectories;  ///< estimates, and the truth as the last
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
  const std::vector<std::filesystem::path> estimates(flags.trajectories.begin(),
                                                     flags.trajectories.end() - 1);
  auto comparison =
      hm::evaluate_trajectory_files(estimates, flags.trajectories.back(), parameters.trajectory_error);
  if (!comparison) return hm::forward_error(comparison);
  Outcome outcome{hm::to_text(*comparison), hm::to_json(*comparison), comparison->warnings, {}};
  if (!flags.report.empty()) {
    const char* title = estimates.size() == 1 ? "Trajectory against truth" : "Trajectories against truth";
    const auto written = write_report(flags, hm::trajectory_report_html(*comparison, title), outcome);
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
  const auto error = hm::evaluate_mesh_file(flags.result, *mesh, *truth, params, loop);
  if (!error) return hm::forward_error(error);
  const hm::MeasuredMesh measured{*error, params};
  Outcome outcome{to_text(measured), to_json(measured), {}, {}};
  if (std::string warning = hm::mesh_size_warning(flags.result, *mesh, *truth); !warning.empty())
    outcome.warnings.push_back(std::move(warning));
  if (!flags.report.empty()) {
    const auto written = write_report(flags, hm::mesh_report_html(*mesh, *truth, measured, loop), outcome);
    if (!written) return hm::forward_error(written);
  }
  return outcome;
}

void add_evaluate(Program& program) {
  program.add({"evaluate",
               "Compare trajectories and meshes with ground truth.",
               "  hm evaluate trajectory tracked/trajectory.tum recording\n"
               "  hm evaluate mesh result/mesh.ply recording",
               {}});
  auto flags = std::make_shared<EvaluateFlags>();
  const auto add_report = [flags](Command command) {
    command.add_option("--report", flags->report, "write a report with plots to this .html file");
  };
  Command trajectory = program.add(
      {"evaluate trajectory",
       "Measure the absolute and relative error of a trajectory (ATE; RPE per frame, second and metre), or "
       "compare several.",
       "  hm evaluate trajectory tracked/trajectory.tum recording\n"
       "  hm evaluate trajectory tracked/trajectory.tum whole/trajectory.tum recording "
       "--report comparison.html\n"
       "  hm evaluate trajectory tracked/trajectory.tum recording/groundtruth.txt --alignment none "
       "--report ate.html",
       [flags](Session& session) { return run_trajectory(*flags, session); }});
  trajectory
      .add_option("trajectories", flags->trajectories,
                  "one trajectory or several (TUM, EuRoC, KITTI; or a recording with poses), and as the last "
                  "the true one, or a recording with true poses")
      .required()
      .expected(2, kMostTrajectories);
  add_report(trajectory);
  trajectory
      .add_option("--alignment", flags->alignment,
                  "transformation that aligns the estimate first: se3 (default), sim3, yaw or none "
                  "(trajectory_error.alignment)")
      .one_of({"se3", "sim3", "yaw", "none"});
  Command mesh =
      program.add({"evaluate mesh", "Measure the accuracy and completeness of a mesh.",
                   "  hm evaluate mesh result/mesh.ply recording\n"
                   "  hm evaluate mesh result/mesh.glb recording/truth_mesh.ply --report mesh.html --json",
                   [flags](Session& session) { return run_mesh(*flags, session); }});
  mesh.add_option("result", flags->result, "mesh: .ply .obj .glb .gltf .stl .off .dae .fbx").required();
  mesh.add_option("truth", flags->truth, "true mesh, or folder of a simulated recording").required();
  add_report(mesh);
  program.add_parameters([] { return hm::make_parameter_part(list_evaluation); });
}

const VerbRegistration kEvaluate(90, add_evaluate);

}  // namespace
