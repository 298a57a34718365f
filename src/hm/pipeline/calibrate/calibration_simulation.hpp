#pragma once
#include <filesystem>
#include <vector>

#include "hm/calibration/board.hpp"
#include "hm/core/run_context.hpp"
#include "hm/sim/sensor/calibration_rig.hpp"

namespace hm {

/// Whose images are simulated: an Xtion with two cameras (xtion_rig()), or a device of `hm simulate`, whose
/// recordings have the same bias (in the order of SensorPreset).
enum class CalibrationSensor { kXtion, kTangoTablet, kTangoPhone, kKinect };
inline constexpr std::string_view kCalibrationSensorNames[] = {"xtion", "tango_tablet", "tango_phone",
                                                               "kinect"};

/// A set of calibration images: of which sensor, how many, of which boards.
struct CalibrationSimulationParams {
  CalibrationSensor sensor = CalibrationSensor::kXtion;
  int camera_views = 24;
  int stereo_views = 16;
  int depth_steps = 7;
  int test_steps = 6;
  int depth_images = 8;
  double min_distance_m = 1.0, max_distance_m = 4.0;
  /// Xtion: largest bias of depth at 4 m.
  double warp_at_4m_m = 0.10;
  /// Xtion: axial noise of depth, factor of z^2.
  double noise_quadratic_per_m = 0.001425;
  /// Noise of images, grey levels.
  double gray_sigma = 2.0;
  /// Inner corners along a row of the board for both cameras.
  static constexpr int kSmallCornersX = 8;
  /// Inner corners along its columns.
  static constexpr int kSmallCornersY = 6;
  /// Edge of its squares.
  static constexpr double kSmallSquare_m = 0.023;
  int seed = 1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"sensor", {}, "xtion: colour and infrared camera; the others as in simulation.sensor"},
      self.sensor, kCalibrationSensorNames);
    v(ParamDoc{"camera_views", {3, 1000}, "images for each camera's intrinsics"}, self.camera_views);
    v(ParamDoc{"stereo_views", {1, 1000}, "pairs of images for the motion between the cameras"},
      self.stereo_views);
    v(ParamDoc{"depth_steps", {2, 100}, "distances of the board for training, several places each"},
      self.depth_steps);
    v(ParamDoc{"test_steps", {1, 100}, "distances of the board for testing, between those"}, self.test_steps);
    v(ParamDoc{"depth_images", {1, 1000}, "depth images at each place"}, self.depth_images);
    v(ParamDoc{"min_distance_m", {0.5, 10}, "nearest board of the depth images"}, self.min_distance_m);
    v(ParamDoc{"max_distance_m", {0.6, 20}, "farthest board of the depth images"}, self.max_distance_m);
    v(ParamDoc{"seed", {0, 2147483647}, "seed of the random numbers"}, self.seed);
  }
};

struct CalibrationSimulationOptions {
  CalibrationSimulationParams params;
  BoardParams board;             ///< of the depth images
  std::filesystem::path output;  ///< a folder that is not there yet, or empty
  RunContext run;                ///< stopped early, it removes what was written
};

struct CalibrationSimulationSummary {
  std::size_t color_images = 0, ir_images = 0, pairs = 0, train_poses = 0, test_poses = 0, depth_images = 0;
  std::vector<std::filesystem::path> outputs;
};

/// The rig that a set is made with.
CalibrationRig rig_of(const CalibrationSimulationParams& params);

/// Writes a set of calibration images of a simulated sensor:
///
///     color/NN.png, ir/NN.png              the small board, for the intrinsics
///     stereo/color/NN.png, stereo/ir/NN.png   the same moment
///     depth/train/NNN/, depth/test/NNN/    color.png and depth_NNN.png of the large board
///     board.toml                           in color, ir, stereo, depth: the board as parameters
///     truth/calibration.toml, truth/boards.csv   what is true
Result<CalibrationSimulationSummary> simulate_calibration(const CalibrationSimulationOptions& options);

}  // namespace hm
