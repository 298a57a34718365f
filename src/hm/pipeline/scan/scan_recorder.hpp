#pragma once
#include <cstddef>
#include <memory>
#include <string>

#include "hm/core/result.hpp"
#include "hm/io/rgbd/tum_writer.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Frames that were offered to a ScanRecorder.
struct RecorderCounts {
  std::size_t recorded = 0;
  std::size_t uncompressed = 0;  ///< of the recorded ones: compression would not have kept up
  std::size_t queue_full = 0;    ///< not recorded: the disk was slower than the camera
  std::size_t failed = 0;        ///< not recorded: writing failed
  std::string failure;           ///< why the first of these did
};

/// Writes the frames of a scan to disk on a thread of its own, in order. Where compression falls behind,
/// images are stored without it until the queue is short again; only where the disk is too slow for that do
/// frames get lost, and they are counted.
class ScanRecorder {
 public:
  /// `writer` is one of TumWriter::append(). The queue holds at most so many frames, 1.5 MB each for VGA.
  explicit ScanRecorder(TumWriter writer, std::size_t queue_frames = 90);
  /// Writes what waits.
  ~ScanRecorder();

  /// Adds a frame to the queue, or counts it where that is full; returns at once.
  void offer(std::shared_ptr<const RgbdFrame> frame);
  /// Waits until nothing up to this stamp is waiting any more: what was recorded of it is on disk.
  void wait_for(Time stamp) const;
  /// Writes what waits, and syncs everything to disk. Error: that of the first write that failed.
  Result<void> finish();
  [[nodiscard]] RecorderCounts counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
