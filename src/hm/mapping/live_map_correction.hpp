#pragma once
#include <memory>

#include "hm/mapping/map_rebuild.hpp"

namespace hm {

/// Rebuilds what loops have moved beside the map on a thread of its own while frames go on
/// coming into the map. All functions are called from the map's thread; none of them waits for a rebuild, but
/// the destructor, for one frame of it.
class LiveMapCorrection {
 public:
  /// `frames` must outlive it.
  LiveMapCorrection(const DenseParams& parameters, const FrameSource& frames,
                    const MapRebuildOptions& options);
  /// Gives up what is under way.
  ~LiveMapCorrection();
  LiveMapCorrection(const LiveMapCorrection&) = delete;
  LiveMapCorrection& operator=(const LiveMapCorrection&) = delete;

  [[nodiscard]] bool busy() const;
  /// Begins a rebuild; not while busy. `pose_now` is called on the other thread. The log is closed by it.
  void start(ObservationLog& log, PoseOfObservation pose_now);
  /// Adds a frame that came into the map while busy; to be called for every one.
  void follow(const Observation& observation, std::span<const ChangedVolume> changed, RgbdFrame&& frame);
  /// The rebuild when it is complete, ready to be put into the map; nothing before. The last frame or two
  /// that it has not caught up with are followed here, so that it ends on a machine with other work too. It
  /// is not busy afterwards; nor after one that was given up for want of memory.
  std::unique_ptr<MapRebuild> take();
  /// Frees a rebuild, with the grid that it has taken out of the map, on the other thread.
  void discard(std::unique_ptr<MapRebuild> rebuild);

  struct State {
    std::size_t frames_done = 0, frames_total = 0;  ///< of the rebuild under way
  };
  [[nodiscard]] State state() const;
  /// Why a rebuild was given up, in words; empty: none was.
  [[nodiscard]] std::string out_of_memory() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
