#pragma once

#include "command_line.hpp"
#include "hm/io/laser/laser_recording.hpp"

/// Options of verbs that read a laser recording: which topics of a bag.
class LaserFlags {
 public:
  void add_to(Command command);
  [[nodiscard]] const hm::LaserRecordingOptions& options() const { return options_; }

 private:
  hm::LaserRecordingOptions options_;
};
