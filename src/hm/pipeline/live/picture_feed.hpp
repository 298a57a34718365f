#pragma once
#include "hm/pipeline/live/newest_jobs.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/station/live_store.hpp"

namespace hm {

/// Puts small pictures of frames into a store: colour, and depth in false colours. Encoded on another thread;
/// the newest frame wins.
class PictureFeed {
 public:
  explicit PictureFeed(LiveStore& store) : store_(store) {}
  /// Copies the images at a reduced size and returns.
  void give(const RgbdFrame& frame);
  void wait() { jobs_.wait(); }

 private:
  LiveStore& store_;
  NewestJobs<> jobs_;
};

/// A depth image in false colours (sequential_color): near light, far dark, from its 2nd to its
/// 98th percentile; black where nothing was measured.
Image<Rgb8> false_colors(const Image<std::uint16_t>& depth);

}  // namespace hm
