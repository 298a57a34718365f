#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"

namespace hm {

/// A frame for the map.
struct Observation {
  std::size_t frame_index = 0;
  Time stamp;
  int submap = 0;  ///< of odometry
  SE3 T_odom_camera;
  std::optional<SE3> T_map_camera;  ///< with which it is in the map; nothing: it is not in the map
};

/// Record of the frames that have changed each volume of a map, so that both can follow when poses are
/// corrected. Volumes are noted for groups of consecutive frames: some kilobytes a second. A copy shares the
/// groups.
class ObservationLog {
 public:
  struct Group {
    std::vector<Observation> observations;
    std::vector<VolumeKey> volumes;  ///< that they changed, sorted, each once
  };

  /// Notes a frame and what its integration has changed; in order of time.
  void note(const Observation& observation, std::span<const ChangedVolume> changed);
  /// Ends the group that is growing.
  void close();
  /// Those that have ended, in order of time. Their places stay when more follow.
  [[nodiscard]] std::span<const std::shared_ptr<const Group>> groups() const { return groups_; }
  void replace(std::size_t place, Group group);
  /// Frames that are in the map.
  [[nodiscard]] std::size_t frames_mapped() const;
  /// All observations, those of the growing group included.
  [[nodiscard]] std::vector<Observation> observations() const;

 private:
  std::vector<std::shared_ptr<const Group>> groups_;
  Group growing_;
};

/// Sorts keys and keeps each once.
void sort_and_unite(std::vector<VolumeKey>& keys);

}  // namespace hm
