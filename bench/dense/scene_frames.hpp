#pragma once
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm::bench {

/// Frames in memory, a chunk at a time, so that a long recording fits.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  [[nodiscard]] virtual PinholeCamera camera() const = 0;
  /// The next frames, valid until the next call; none at the end.
  virtual Result<std::span<const RgbdFrame>> next_chunk() = 0;
};

struct FrameRange {
  std::size_t limit = 0;  ///< 0: all
  std::size_t stride = 1;
  std::size_t chunk = 40;
};

/// The folder of recordings: $HM_DATA, or ../shared/data beside the sources.
std::filesystem::path data_folder();

/// A recording of ../shared/data beside the sources, or of $HM_DATA. An error when it is absent.
Result<std::unique_ptr<FrameSource>> open_frames(const std::string& recording, const FrameRange& range);

/// Frames of a simulation, which must outlive the source.
std::unique_ptr<FrameSource> simulated_frames(const Simulation& simulation, const FrameRange& range);

}  // namespace hm::bench
