#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "hm/io/recording.hpp"
#include "hm/pipeline/dense_pipeline.hpp"
#include "hm/pipeline/run_context.hpp"

namespace hm {

/// A frame that is in the map, and where it was taken to be.
struct Observation {
  std::size_t frame_index = 0;
  Time stamp;
  SE3 T_map_camera;
};

/// Which frames have changed which volumes of a map, so that both can follow when poses are corrected.
/// Volumes are noted for groups of consecutive frames: some kilobytes a second.
class ObservationLog {
 public:
  /// Notes a frame that was integrated; in order of time.
  void note(const Observation& observation, std::span<const ChangedVolume> changed);

  /// Adds frames that are not in the map yet: the next correction integrates them where they belong.
  void add_unmapped(std::span<const Observation> observations);

  struct Group {
    std::vector<Observation> observations;
    bool mapped = true;              ///< false: not in the map yet
    std::vector<VolumeKey> volumes;  ///< that they changed, sorted, each once
  };
  [[nodiscard]] std::span<const Group> groups() const { return groups_; }
  /// Begins anew with these groups; what is noted later goes into groups of its own.
  void restart_with(std::vector<Group> groups);
  /// Puts groups into the order of their frames.
  void sort();
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::vector<Group> groups_;
  std::size_t closed_ = 0;  ///< groups that get no more frames
};

/// Where an observation is by what is known now; nothing: it does not belong into the map.
using PoseOfObservation = std::function<std::optional<SE3>(const Observation&)>;

struct MapCorrectionOptions {
  double least_shift_m = 0.005;  ///< frames that moved less, measured at `at_depth_m`, stay as they are
  double at_depth_m = 3.0;
  std::size_t prefetch_frames = 4;
};

/// What a correction did.
struct MapCorrection {
  std::size_t frames = 0;           ///< in the map before, or to come into it
  std::size_t frames_moved = 0;     ///< integrated again at another place
  std::size_t frames_replayed = 0;  ///< integrated again at their place, as they had seen what was rebuilt
  std::size_t frames_added = 0;     ///< of those that moved: were not in the map before
  std::size_t frames_removed = 0;   ///< do not belong into the map (any more)
  std::size_t frames_lost = 0;      ///< could not be read again
  std::size_t volumes_before = 0, volumes_after = 0;
  std::size_t volumes_rebuilt = 0;  ///< cleared, as a frame that moved had changed them
  double largest_shift_m = 0;       ///< of a frame, measured at `at_depth_m`
  double seconds = 0;
  bool interrupted = false;
};

/// Brings a map to corrected poses (after a loop has closed). Volumes that a moved frame has changed are
/// cleared; frames that did not move and had changed them too are read again and written into them alone;
/// then the moved frames are integrated at their new places. Volumes that no moved frame ever changed keep
/// their bits; if all frames moved, the map is the one that the corrected poses would have given at once. The
/// log follows. Told to stop, it stops between frames: the map then lacks what was not integrated yet.
MapCorrection correct_map(DensePipeline& pipeline, ObservationLog& log, const Recording& recording,
                          const PoseOfObservation& pose_now, const MapCorrectionOptions& options,
                          const RunContext& run);

}  // namespace hm
