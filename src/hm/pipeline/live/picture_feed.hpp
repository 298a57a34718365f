#pragma once
#include <memory>
#include <mutex>
#include <vector>

#include "hm/pipeline/live/newest_jobs.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/station/live_store.hpp"

namespace hm {

/// The images of a frame at a reduced size.
struct SmallPictures {
  Image<Rgb8> color;
  DepthImage depth;
  Time stamp;
};

/// Puts small pictures of frames into a store: colour, and depth in false colours. Encoded on another thread;
/// the newest frame wins.
class PictureFeed {
 public:
  using Place = std::shared_ptr<SmallPictures>;

  explicit PictureFeed(LiveStore& store) : store_(store) {}
  /// Copies the images, into memory that was used before. Any thread.
  Place copy(const RgbdFrame& frame);
  /// They are not to be changed any more.
  void give(const Place& pictures);
  void wait() { jobs_.wait(); }

 private:
  Place free_place();
  void put(const Place& pictures);

  LiveStore& store_;
  std::mutex mutex_;
  std::vector<Place>
      free_;  ///< memory that was used before: new memory of this size costs more than the copy
  NewestJobs<> jobs_;
};

/// A depth image in false colours (sequential_color): near light, far dark, from its 2nd to its
/// 98th percentile; black where nothing was measured.
Image<Rgb8> false_colors(const Image<std::uint16_t>& depth);

}  // namespace hm
