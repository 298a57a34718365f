#pragma once
#include "hm/pipeline/dense/reconstruction.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"

namespace hm {

/// The experiment: a recording with its poses, a calibration with a depth correction, and where results go.
struct DepthCompensationOptions {
  std::filesystem::path recording;
  RecordingOptions recording_options;  ///< empty calibration: calibration.toml of the recording's folder
  std::filesystem::path output;        ///< a folder, made if needed
  RgbdParameters parameters;
  RunContext run;  ///< stopped early, it fails with kCancelled
};

/// Cells or points of a map, and how far they are from the true surface.
struct MapAgreement {
  std::size_t count = 0;
  Summary distance_m;
  double near_ratio = 0;  ///< within a cell's edge
};

/// The maps of one recording, made with or without the correction.
struct CompensationSide {
  ReconstructionSummary reconstruction;  ///< its error: of the mesh
  std::size_t keyframes = 0, points = 0, occupied_cells = 0;
  std::optional<MapAgreement> point_error, cell_error;  ///< for a recording with a true mesh
};

struct DepthCompensationSummary {
  CompensationSide without, with;
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// The large-map experiment with and without depth compensation (dissertation 3.4, Fig. 3.16): reconstructs a
/// recording twice with the same poses, once with the whole calibration and once with all of it but the depth
/// correction, and makes the point map and the occupancy map of keyframes (every 0.25 m or 20 deg) of both.
/// Writes without/ and with/ (as `hm reconstruct`, and points.ply and occupancy.ot), pictures/ with both side
/// by side, report.json, report.html. Errors: those of reconstruct(); a calibration without a correction.
Result<DepthCompensationSummary> compare_depth_compensation(const DepthCompensationOptions& options);

/// without{mesh_error{...}, points, point_error_mm{...}, ...}, with{the same}.
void visit(const DepthCompensationSummary& summary, SummaryTree& v);
/// A table for a terminal.
std::string to_text(const DepthCompensationSummary& summary);

}  // namespace hm
