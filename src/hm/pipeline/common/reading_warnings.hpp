#pragma once
#include <string>
#include <vector>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rgbd/recording.hpp"

namespace hm {

/// One sentence for everything that the reader of a recording left out, with counts: lines, messages,
/// images that are not there, damaged places of the file.
std::vector<std::string> reading_warnings(const RecordingInfo& info);
std::vector<std::string> reading_warnings(const LaserRecording& recording);

}  // namespace hm
