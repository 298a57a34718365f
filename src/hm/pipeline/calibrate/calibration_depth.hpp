#pragma once
#include "hm/calibration/disparity_fit.hpp"
#include "hm/pipeline/calibrate/calibration_set.hpp"

namespace hm {

/// Meaning of the numbers in depth images.
enum class DepthImages { kDepth, kRawDisparity };

struct DepthCalibrationOptions {
  std::filesystem::path
      set;  ///< a folder: a folder for each pose of the board, or train/ and test/ with those
  std::filesystem::path start;   ///< the calibration with the cameras and the motion between them
  std::filesystem::path output;  ///< a folder
  DepthImages images = DepthImages::kDepth;
  double depth_units_per_m = 1000;
  BoardParams board;
  DepthFitParams fit;
  RunContext run;  ///< stopped early, nothing is written
};

/// Errors of test poses near a distance.
struct DistanceError {
  double distance_m = 0;
  std::size_t samples = 0;
  double before_rms_m = 0, after_rms_m = 0;
  double noise_m = 0;  ///< RMS deviation expected of the averaged readings; 0: unknown, as of single images
};

/// Errors of poses, gathered around full quarters of a metre.
std::vector<DistanceError> errors_by_distance(std::span<const DepthViewError> errors);

/// Model of raw disparity that was found.
struct RawDepthSummary {
  DisparityFit fit;
  bool is_nominal_start = false;  ///< the calibration had no depth camera: that of a Kinect by design
  double published_ratio = 1;     ///< depth found / depth by the published constants, at the boards' middle
};

struct DepthCalibrationSummary {
  std::size_t poses = 0;                      ///< folders that were looked at
  std::vector<std::string> left_out;          ///< "012: no board in color.png"
  std::size_t no_reading = 0, off_plane = 0;  ///< pixels of boards that gave no sample
  std::vector<DepthViewError> train, test;
  std::vector<DistanceError> by_distance;  ///< of test poses
  bool has_test_folder = false;
  std::optional<RawDepthSummary> raw;
  std::optional<DepthRefinement> refinement;  ///< where the cameras were adjusted too
  DepthFit fit;
  RgbdCalibration calibration;  ///< with the correction
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// Boards at many distances -> correction of depth (dissertation 3.1.2), judged on poses that the fit did not
/// see: writes calibration.toml with its correction, report.json, report.html. Each pose is a folder with one
/// colour image (color.png or .jpg) and any number of depth images (depth*.png, 16 bits), which are
/// averaged; or a pair of files (list_depth_poses()). Of raw disparity, its two constants, the depth camera
/// and the motion to the colour camera are fitted first; a start without a depth camera is enough then.
/// Errors: set or start unusable, too few poses.
Result<DepthCalibrationSummary> calibrate_depth(const DepthCalibrationOptions& options);
void visit(const DepthCalibrationSummary& summary, SummaryTree& v);
std::string to_text(const DepthCalibrationSummary& summary);
/// The page (calibration_depth_report.cpp).
std::string to_html(const DepthCalibrationSummary& summary);

}  // namespace hm
