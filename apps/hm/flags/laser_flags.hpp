#pragma once
#include <CLI/CLI.hpp>

#include "hm/io/laser/laser_recording.hpp"

/// Options of verbs that read a laser recording: which topics of a bag.
class LaserFlags {
 public:
  void add_to(CLI::App& command);
  [[nodiscard]] const hm::LaserRecordingOptions& options() const { return options_; }

 private:
  hm::LaserRecordingOptions options_;
};
