#include "hm/pipeline/experiments/rgbd/compensated_map_experiment.hpp"

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/pipeline/experiments/rgbd/depth_bias_experiment.hpp"
#include "hm/pipeline/experiments/rgbd/depth_compensation.hpp"
#include "hm/pipeline/simulate/simulation_recording.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kComparedFolder = "compared";

void add_side_rows(const char* name, const CompensationSide& side, double cell_m,
                   std::vector<ExperimentRow>& rows) {
  constexpr double kMm = 1e3, kPercent = 100;
  const std::string prefix = std::string(name) + " correction: ";
  if (const auto& error = side.reconstruction.error) {
    rows.push_back({prefix + "distance of the mesh from the true surface, mean",
                    {},
                    kMm * error->accuracy.distance_m.mean,
                    "mm"});
    rows.push_back(
        {prefix + "true surface reconstructed within 2 cm", {}, kPercent * error->completeness.ratio, "%"});
  }
  if (side.point_error)
    rows.push_back({prefix + "distance of the points of keyframes, mean",
                    {},
                    kMm * side.point_error->distance_m.mean,
                    "mm"});
  if (side.cell_error)
    rows.push_back({fmt::format("{}occupied cells within {:.0f} cm of the surface", prefix, 100 * cell_m),
                    {},
                    kPercent * side.cell_error->near_ratio,
                    "%"});
}

/// Adds the pictures that the comparison wrote: both maps side by side.
void add_compared_pictures(HtmlReport& report, const fs::path& folder) {
  report.begin_section("Without and with the correction",
                       fmt::format("The whole comparison: {}/report.html", kComparedFolder));
  for (const auto& [file, words] :
       {std::pair{"plan.png", "Floor plans."}, std::pair{"shaded.png", "Surfaces."},
        std::pair{"error.png", "Distance from the true surface."},
        std::pair{"occupancy.png", "Occupied cells, coloured by height."}})
    if (const auto bytes = read_file_bytes(folder / file)) report.add_figure(*bytes, words, words);
}

Result<ExperimentFindings> compare_maps(WorldKind world, int frames, const ExperimentOptions& options) {
  const auto boards = calibrate_boards(CalibrationSensor::kTangoPhone, options);
  if (!boards) return forward_error(boards);
  SimulationOptions walk;
  walk.params = options.parameters.simulation;
  walk.params.world = world;
  walk.params.sensor = SensorPreset::kTangoPhone;
  walk.params.frame_limit = frames;
  walk.output = options.output / "walk";
  walk.run = options.run;
  if (const auto made = simulate_recording(walk); !made) return forward_error(made);
  DepthCompensationOptions compensation;
  compensation.recording = walk.output;
  compensation.recording_options.calibration = options.output / "calibration" / "calibration.toml";
  compensation.output = options.output / kComparedFolder;
  compensation.parameters.tsdf.voxel_size_m = options.tiny ? 0.05 : 0.03;
  compensation.parameters.slam.points_voxel_m = 0.03;
  compensation.parameters.slam.map_top_m = 2.2;  // below ceilings, so that one sees into the rooms
  compensation.parameters.depth_noise = sensor_model(SensorPreset::kTangoPhone).noise;
  if (options.tiny)
    compensation.parameters.mesh_error.samples = 20'000,
    compensation.parameters.reconstruction.pictures = false;
  compensation.run = options.run;
  const auto summary = compare_depth_compensation(compensation);
  if (!summary) return forward_error(summary);
  std::error_code code;  // what is left is only large
  fs::remove_all(walk.output, code);
  fs::remove_all(options.output / "boards", code);
  ExperimentFindings findings;
  findings.warnings = summary->warnings;
  findings.outputs = {options.output / kComparedFolder, options.output / "calibration"};
  const double cell_m = compensation.parameters.slam.octomap_resolution_m;
  add_side_rows("without", summary->without, cell_m, findings.rows);
  add_side_rows("with", summary->with, cell_m, findings.rows);
  findings.add_figures = [pictures = compensation.output / "pictures"](HtmlReport& report) {
    add_compared_pictures(report, pictures);
  };
  return findings;
}

}  // namespace

Result<ExperimentFindings> run_large_map_experiment(const ExperimentOptions& options) {
  return compare_maps(options.tiny ? WorldKind::kRoom : WorldKind::kHouse, options.tiny ? 6 : 0, options);
}

Result<ExperimentFindings> run_phone_room_experiment(const ExperimentOptions& options) {
  return compare_maps(WorldKind::kRoom, options.tiny ? 6 : 0, options);
}

}  // namespace hm
