#pragma once
#include <memory>
#include <string>

#include "flags/board_flags.hpp"
#include "flags/recording_flags.hpp"
#include "hm/pipeline/calibrate/calibrate_parameter_list.hpp"
#include "program.hpp"

/// Parts that the words of `hm calibrate` share.
struct CalibrateFlags {
  std::string input, second_input, start, camera = "color", from = "static";
  OutputFlags output;
  double depth_units_per_m = 1000;
  int frames = 300;
  bool is_raw_disparity = false;
  BoardFlags board;
  RecordingFlags of_recording;
};

inline constexpr const char* kCalibrationStopped = "nothing is written";

/// The parameters of a run: the folder's board, flags, then --params and --set.
hm::Result<hm::CalibrateParameters> parameters_of(const CalibrateFlags& flags, const Session& session);

/// The folder of the results of a word ("intrinsics") of `hm calibrate`.
hm::ResultFolderRequest result_folder_of(const CalibrateFlags& flags, const std::string& word);

/// Options that every word has: -o, --overwrite, and --calibration (the start) where `start` says so.
enum class CalibrationStart { kNone, kOptional, kRequired };
void add_calibrate_output(Command command, const std::shared_ptr<CalibrateFlags>& flags, const char* name,
                          CalibrationStart start);

/// `hm calibrate depth` and `noise` (calibrate_depth.cpp).
void add_calibrate_depth(Program& program, const std::shared_ptr<CalibrateFlags>& flags);
