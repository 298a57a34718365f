#pragma once
#include <string>
#include <vector>

#include "command_line.hpp"
#include "hm/io/rgbd/recording.hpp"

/// Options of verbs that read a recording or a camera: what the user may know better than these.
struct RecordingFlags {
  std::string kind;
  std::string calibration;
  std::vector<double> intrinsics;  ///< fx fy cx cy
  std::vector<int> size_px;
  double depth_units_per_m = 0;
  bool force = false;

  void add_to(Command command);
  /// Adds those that a camera has too.
  void add_camera_to(Command command);
  /// Adds --force, for verbs that check the recording before they run.
  void add_force_to(Command command);
  [[nodiscard]] hm::Result<hm::RecordingOptions> options() const;

 private:
  void add_images_to(Command command, const std::string& group, const std::string& source);
};
