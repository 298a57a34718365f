#pragma once
#include "hm/calibration/camera_fit.hpp"
#include "hm/pipeline/calibrate/calibration_set.hpp"

namespace hm {

struct IntrinsicsOptions {
  std::filesystem::path images;  ///< a folder
  std::filesystem::path start;   ///< a calibration that the camera is added to; empty: none
  std::filesystem::path output;  ///< a folder
  CalibratedCamera camera = CalibratedCamera::kColor;
  BoardParams board;
  CameraFitParams fit;
  RunContext run;  ///< stopped early, nothing is written
};

struct IntrinsicsSummary {
  FoundBoards found;
  CameraFit fit;
  CalibratedCamera camera = CalibratedCamera::kColor;
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// Images of a board -> intrinsics (dissertation 3.1.1): writes calibration.toml, COLOR_camera_info.yaml,
/// report.json and report.html. Errors: folder, board or start unusable; too few boards.
Result<IntrinsicsSummary> calibrate_intrinsics(const IntrinsicsOptions& options);
void visit(const IntrinsicsSummary& summary, SummaryTree& v);
std::string to_text(const IntrinsicsSummary& summary);

}  // namespace hm
