#pragma once
#include <string>
#include <vector>

#include "hm/pipeline/laser/laser_run.hpp"

namespace hm {

/// What carries the lasers of a recording.
LaserPlatform laser_platform(const LaserRecording& recording);

/// What the choices of a run follow from.
struct LaserChoiceInput {
  const LaserRecording& recording;
  const LaserRunOptions& options;
  const LaserPipeline& pipeline;
};

/// What was used of a recording and why, in words, with the recording's own notes.
std::vector<std::string> laser_choices(const LaserChoiceInput& input);

}  // namespace hm
