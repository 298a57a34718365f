#include "hm/pipeline/experiments/rgbd/depth_compensation.hpp"

#include <algorithm>

#include "hm/evaluation/surface_distance.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/map/octomap_file.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/mapping/keyframes/keyframe_maps.hpp"
#include "hm/pipeline/common/frame_range.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/experiments/rgbd/depth_compensation_report.hpp"
#include "hm/report/map_figures.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// Keyframes of a walk with a robot (dissertation 3.5).
constexpr double kKeyframe_m = 0.25, kKeyframe_rad = 0.35;

/// Frames with a pose, far enough from each other, within the range that is reconstructed.
CorrectedKeyframes choose_keyframes(const RecordingInfo& info, const ReconstructionParams& params) {
  const FrameRange range = frame_range(params, info.frame_count);
  std::vector<CorrectedKeyframe> chosen;
  for (std::size_t i = range.begin; i < range.end; i += range.stride) {
    if (i >= info.frame_poses.size() || !info.frame_poses[i]) continue;
    const SE3& T = *info.frame_poses[i];
    if (!chosen.empty()) {
      const SE3 step = chosen.back().T_map_camera.inverse() * T;
      if (step.translation().norm() < kKeyframe_m && step.angle() < kKeyframe_rad) continue;
    }
    chosen.push_back({i, info.stamps[i], 0, 0, T, T, {}});
  }
  return CorrectedKeyframes(std::move(chosen));
}

MapAgreement agreement(std::span<const Vec3> points, double near_m, const SurfaceDistance& truth,
                       const ParallelLoop& loop) {
  const std::vector<float> distances = truth.distances_m(points, loop);
  const std::vector<double> values(distances.begin(), distances.end());
  const auto near = std::ranges::count_if(values, [&](double d) { return d <= near_m; });
  return {values.size(), summarise(values),
          static_cast<double>(near) / static_cast<double>(std::max<std::size_t>(1, values.size()))};
}

/// One run of compare_depth_compensation().
class CompensationExperiment {
 public:
  explicit CompensationExperiment(const DepthCompensationOptions& options)
      : options_(options), parameters_(options.parameters), loop_(options.run.threads) {}
  Result<DepthCompensationSummary> run();

 private:
  Result<void> make_calibrations();
  Result<void> read_truth();
  Result<void> run_side(const char* name, const fs::path& calibration, CompensationSide& side,
                        CompensationMaterial::Side& material);
  Result<void> make_maps(const fs::path& folder, const RecordingOptions& how, CompensationSide& side,
                         CompensationMaterial::Side& material);
  Result<void> write_results();

  const DepthCompensationOptions& options_;
  RgbdParameters parameters_;
  ParallelLoop loop_;
  fs::path with_, without_;  ///< calibrations
  std::optional<MeshTruth> truth_;
  std::optional<SurfaceDistance> surface_;
  CompensationMaterial material_;
  DepthCompensationSummary summary_;
};

/// The same calibration without its depth correction: cameras and registration stay what they are.
Result<void> CompensationExperiment::make_calibrations() {
  with_ = options_.recording_options.calibration;
  if (with_.empty()) with_ = options_.recording / kCalibrationFileName;
  std::error_code code;
  if (fs::is_directory(with_, code)) with_ /= kCalibrationFileName;
  auto calibration = read_calibration(with_);
  if (!calibration) return forward_error(calibration);
  if (!calibration->depth_correction)
    return fail(ErrorCode::kUsage, with_, "has no depth correction: `hm calibrate depth` makes one");
  calibration->depth_correction.reset();
  if (auto made = make_folder_in(options_.output, "without"); !made) return made;
  without_ = options_.output / "without" / kCalibrationFileName;
  return as_run_failure(write_calibration(without_, *calibration));
}

Result<void> CompensationExperiment::read_truth() {
  if (!has_mesh_truth(options_.recording)) return {};
  auto truth = read_mesh_truth(options_.recording);
  if (!truth) return forward_error(truth);
  auto surface = SurfaceDistance::build(truth->mesh);
  if (!surface) return forward_error(surface);
  truth_ = std::move(*truth);
  surface_ = std::move(*surface);
  return {};
}

Result<void> CompensationExperiment::make_maps(const fs::path& folder, const RecordingOptions& how,
                                               CompensationSide& side, CompensationMaterial::Side& material) {
  const auto recording = open_recording(options_.recording, how);
  if (!recording) return forward_error(recording);
  const CorrectedKeyframes chosen = choose_keyframes((*recording)->info(), parameters_.reconstruction);
  const KeyframeMaps maps =
      make_keyframe_maps(**recording, chosen, keyframe_map_params(parameters_), options_.run);
  side.keyframes = maps.keyframes;
  const double cell_m = parameters_.slam.octomap_resolution_m;
  if (maps.occupancy) {
    const auto voxels = maps.occupancy->voxels();
    const auto written =
        write_color_octomap(folder / "occupancy.ot", voxels, voxel_colors(maps, voxels), cell_m);
    if (!written) return as_run_failure(written);
    std::vector<Vec3> centres;
    for (const OccupancyVoxel& voxel : voxels)
      if (voxel.state == Occupancy::kOccupied) centres.push_back(voxel.p_world_centre.cast<double>());
    side.occupied_cells = centres.size();
    material.heights = draw_heights(voxels, cell_m);
    if (surface_) side.cell_error = agreement(centres, cell_m, *surface_, loop_);
  }
  if (maps.points) {
    const TriangleMesh cloud = maps.points->points();
    side.points = cloud.vertices.size();
    const auto written = write_mesh(folder / "points.ply", cloud, {});
    if (!written) return as_run_failure(written);
    std::vector<Vec3> points;
    for (const auto& vertex : cloud.vertices) points.push_back(vertex.cast<double>());
    if (surface_) side.point_error = agreement(points, cell_m, *surface_, loop_);
  }
  return {};
}

Result<void> CompensationExperiment::run_side(const char* name, const fs::path& calibration,
                                              CompensationSide& side, CompensationMaterial::Side& material) {
  ReconstructionOptions options;
  options.recording = options_.recording;
  options.recording_options = options_.recording_options;
  options.recording_options.calibration = calibration;
  options.output = options_.output / name;
  options.existing = ExistingResult::kOverwrite;  // the folder has been opened for the whole experiment
  options.parameters = {parameters_, parameters_.mesh_error, parameters_.trajectory_error};
  options.run = options_.run;
  auto summary = reconstruct(options);
  if (!summary) return forward_error(summary);
  side.reconstruction = std::move(*summary);
  if (auto made = make_maps(options.output, options.recording_options, side, material); !made) return made;
  if (options_.run.stop.stop_requested())
    return fail(ErrorCode::kCancelled, {}, "stopped {} the depth correction", name);
  auto mesh = read_mesh(options.output / "mesh.ply");
  if (!mesh) return forward_error(mesh);
  material.mesh = std::move(*mesh);
  for (const std::string& warning : side.reconstruction.warnings)
    summary_.warnings.push_back(fmt::format("{}: {}", name, warning));
  summary_.outputs.push_back(options.output);
  return {};
}

Result<void> CompensationExperiment::write_results() {
  material_.program_version = options_.run.program_version;
  material_.parameters_toml = list_slam(parameters_).to_toml();
  if (truth_) material_.surface = &*surface_;
  const std::vector<Figure> figures = draw_compensation(summary_, material_, loop_);
  if (auto written = write_figures(options_.output, figures, summary_.outputs, loop_); !written)
    return written;
  const auto json = to_json_text(to_json(summary_));
  if (auto written = write_file_text(options_.output / "report.json", json + "\n"); !written) return written;
  summary_.outputs.push_back(options_.output / "report.json");
  const auto html = depth_compensation_html(summary_, material_, figures);
  summary_.outputs.push_back(options_.output / "report.html");
  return write_file_text(summary_.outputs.back(), html);
}

Result<DepthCompensationSummary> CompensationExperiment::run() {
  if (parameters_.slam.maps.empty()) parameters_.slam.maps = "points,octomap";
  parameters_.reconstruction.mesh_formats = "ply";
  if (auto made = make_calibrations(); !made) return forward_error(made);
  if (auto read = read_truth(); !read) return forward_error(read);
  if (auto ran = run_side("without", without_, summary_.without, material_.without); !ran)
    return forward_error(ran);
  if (auto ran = run_side("with", with_, summary_.with, material_.with); !ran) return forward_error(ran);
  if (options_.run.progress) options_.run.progress({"drawing figures", 0, 0, {}});
  if (auto written = as_run_failure(write_results()); !written) return forward_error(written);
  return std::move(summary_);
}

}  // namespace

Result<DepthCompensationSummary> compare_depth_compensation(const DepthCompensationOptions& options) {
  return CompensationExperiment(options).run();
}

}  // namespace hm
