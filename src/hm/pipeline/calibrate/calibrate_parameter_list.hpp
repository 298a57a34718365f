#pragma once
#include "hm/calibration/board.hpp"
#include "hm/calibration/camera_fit.hpp"
#include "hm/calibration/depth_fit.hpp"
#include "hm/calibration/noise_fit.hpp"
#include "hm/calibration/stereo_fit.hpp"
#include "hm/core/params.hpp"
#include "hm/pipeline/calibrate/calibration_simulation.hpp"

namespace hm {

/// Everything that decides what a calibration does, and what simulated images of boards look like.
struct CalibrateParameters {
  BoardParams board;
  CameraFitParams camera_fit;
  StereoFitParams stereo_fit;
  DepthFitParams depth_fit;
  NoiseFitParams noise_fit;
  CalibrationSimulationParams calibration_simulation;
};

/// Its sections, named as the members.
inline ParamList list_calibration(CalibrateParameters& parameters) {
  ParamList list;
  list.add("board", parameters.board);
  list.add("camera_fit", parameters.camera_fit);
  list.add("stereo_fit", parameters.stereo_fit);
  list.add("depth_fit", parameters.depth_fit);
  list.add("calibration_simulation", parameters.calibration_simulation);
  return list;
}

}  // namespace hm
