#include "hm/pipeline/dense/reconstruction_output.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/core/process_memory.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/common/mesh_output.hpp"
#include "hm/pipeline/common/scene_level.hpp"
#include "hm/pipeline/dense/alignment_summary.hpp"
#include "hm/pipeline/dense/reconstruction_report.hpp"

namespace hm {
namespace {

void say(const ReconstructionOptions& options, const char* stage) {
  if (options.run.progress) options.run.progress({stage, 0, 0, {}});
}

void measure(const ReconstructionOptions& options, const TriangleMesh& mesh, const ParallelLoop& loop,
             ReportMaterial& material, ReconstructionSummary& summary) {
  if (!has_mesh_truth(options.recording) || mesh.triangles.empty()) return;
  say(options, "comparing with the truth");
  auto truth = read_mesh_truth(options.recording);
  if (!truth) {
    summary.warnings.push_back("the truth cannot be used: " + to_string(truth.error()));
    return;
  }
  if (!summary.T_level_given.rotation().isIdentity(0)) turn(*truth, summary.T_level_given.rotation());
  auto error = evaluate_mesh(mesh, truth->mesh, options.parameters.mesh_error, loop, truth->visible_points);
  if (!error) {
    summary.warnings.push_back("the mesh cannot be compared with the truth: " + to_string(error.error()));
    return;
  }
  summary.error = std::move(*error);
  truth->visible_points = {};  // a million or two; figures only need the mesh
  material.truth = std::move(*truth);
  trim_memory();
}

/// With poses that were levelled, up is z unless that could not be found.
void find_up_in(const TriangleMesh& mesh, ReconstructionSummary& summary) {
  summary.up = up_of_frame(mesh, summary.trajectory,
                           {summary.recording.camera.without_distortion(), summary.recording.imu});
  const double off_rad = std::acos(std::clamp(summary.up.up.z(), -1.0, 1.0));
  if (summary.levelled && summary.up.known() && off_rad < 1.5 * kRadiansPerDegree)
    summary.up.up = Vec3::UnitZ();
  if (!summary.up.known())
    summary.warnings.emplace_back(
        "up is unknown: no accelerometer, and neither floor nor walls determine it");
}

void add_warnings(const ReconstructionOptions& options, ReconstructionSummary& summary) {
  const std::size_t skipped = summary.skipped.size();
  if (skipped > 0)
    summary.warnings.push_back(fmt::format("{} of {} skipped; the first is frame {}: {}",
                                           with_thousands(skipped), counted(summary.frames_total, "frame"),
                                           summary.skipped.front().index, summary.skipped.front().reason));
  if (summary.alignment) {
    std::string warning = alignment_warning(*summary.alignment);
    if (!warning.empty()) summary.warnings.push_back(std::move(warning));
  }
  if (summary.interrupted)
    summary.warnings.push_back(fmt::format(
        "stopped after {} of {}; `hm reconstruct {} -o {} --resume` continues",
        with_thousands(summary.frames_integrated + skipped), counted(summary.frames_total, "frame"),
        options.recording.string(), options.output.string()));
}

Result<void> write_texts(const std::filesystem::path& folder, const ReportMaterial& material,
                         ReconstructionSummary& summary) {
  const auto trajectory = folder / "trajectory.tum", parameters = folder / "parameters.toml",
             json = folder / "report.json", html = folder / "report.html";
  if (const auto written = write_tum_trajectory(trajectory, summary.trajectory); !written) return written;
  if (const auto written = write_file_text(parameters, material.parameters_toml); !written) return written;
  for (const auto& path : {trajectory, parameters, json, html}) summary.outputs.push_back(path);
  const std::string report = to_json_text(report_json(summary, material.program_version));
  if (const auto written = write_file_text(json, report + "\n"); !written) return written;
  return write_file_text(html, report_html(summary, material));
}

}  // namespace

Result<void> write_results(DensePipeline& pipeline, const ReconstructionOptions& options,
                           const std::filesystem::path& folder, ReconstructionSummary& summary) {
  say(options, "finishing the mesh");
  const TriangleMesh mesh = pipeline.take_finished_mesh();
  summary.vertices = mesh.vertices.size();
  summary.triangles = mesh.triangles.size();
  summary.bounds_m = bounds(mesh);
  summary.outputs.push_back(folder / "map.hmap");
  if (mesh.triangles.empty())
    summary.warnings.push_back("the mesh is empty: no surface was seen clearly enough");
  find_up_in(mesh, summary);
  const auto meshes = write_mesh_files(mesh, {folder, options.run.program_version, summary.up},
                                       options.parameters.reconstruction, summary.outputs);
  if (!meshes) return as_run_failure(meshes);
  ReportMaterial material;
  material.program_version = options.run.program_version;
  DenseParameters parameters = options.parameters;
  material.parameters_toml = list_reconstruction(parameters).to_toml();
  measure(options, mesh, pipeline.loop(), material, summary);
  add_warnings(options, summary);
  if (options.parameters.reconstruction.pictures) {
    say(options, "drawing figures");
    const MeshFigureOptions draw = figure_options(summary.recording.camera, summary.trajectory, summary.up);
    material.figures = make_mesh_figures(mesh, draw, pipeline.loop());
    if (material.truth)
      if (auto figure = make_error_figure(mesh, material.truth->mesh, draw, pipeline.loop()))
        material.figures.push_back(std::move(*figure));
    say(options, "simplifying the mesh for the report");
    material.scene =
        make_scene_model(mesh, draw, material.truth ? &material.truth->mesh : nullptr, pipeline.loop());
    if (const auto written = write_floor_plan(material.scene, folder, summary.outputs); !written)
      return as_run_failure(written);
    if (const auto written = write_figures(folder, material.figures, summary.outputs, pipeline.loop());
        !written)
      return as_run_failure(written);
  }
  return as_run_failure(write_texts(folder, material, summary));
}

}  // namespace hm
