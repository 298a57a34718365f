#pragma once
#include "hm/calibration/stereo_fit.hpp"
#include "hm/pipeline/calibrate/calibration_set.hpp"

namespace hm {

struct ExtrinsicsOptions {
  std::filesystem::path depth_images,
      color_images;              ///< folders; a pair has the same name but for the ending
  std::filesystem::path start;   ///< the calibration with both cameras
  std::filesystem::path output;  ///< a folder
  BoardParams board;
  StereoFitParams fit;
  RunContext run;  ///< stopped early, nothing is written
};

struct ExtrinsicsSummary {
  FoundBoards depth_found, color_found;
  std::vector<std::string> names;  ///< of the pairs in which both see the board
  std::size_t without_partner = 0;
  StereoFit fit;
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// Pairs of images of a board -> T_color_depth (dissertation 3.1.1), added to the calibration: writes
/// calibration.toml, report.json, report.html. Errors: folders or start unusable, a camera missing there, no
/// pairs.
Result<ExtrinsicsSummary> calibrate_extrinsics(const ExtrinsicsOptions& options);
void visit(const ExtrinsicsSummary& summary, SummaryTree& v);
std::string to_text(const ExtrinsicsSummary& summary);

}  // namespace hm
