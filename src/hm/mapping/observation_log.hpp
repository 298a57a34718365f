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

/// Frame observed by the map.
struct Observation {
  std::size_t frame_index = 0;
  Time stamp;
  int submap = 0;  ///< submap of odometry
  SE3 T_odom_camera;
  std::optional<SE3> T_map_camera;  ///< pose used for integration; unset: not in the map
};

/// Log of the frames that changed each volume of a map, for rebuilding it when poses are corrected. Volumes
/// are recorded for groups of consecutive frames (some kilobytes per second). Copies share the groups.
class ObservationLog {
 public:
  struct Group {
    std::vector<Observation> observations;
    std::vector<VolumeKey> volumes;  ///< changed by them, sorted, unique
  };

  /// Records a frame and the volumes changed by its integration; in order of time.
  void note(const Observation& observation, std::span<const ChangedVolume> changed);
  /// Ends the current group.
  void close();
  /// Closed groups, in order of time. Their indices do not change.
  [[nodiscard]] std::span<const std::shared_ptr<const Group>> groups() const { return groups_; }
  void replace(std::size_t place, Group group);
  /// Number of frames in the map.
  [[nodiscard]] std::size_t frames_mapped() const;
  /// All observations, including those of the current group.
  [[nodiscard]] std::vector<Observation> observations() const;

 private:
  std::vector<std::shared_ptr<const Group>> groups_;
  Group growing_;
};

/// Sorts keys and removes duplicates.
void sort_and_unite(std::vector<VolumeKey>& keys);

}  // namespace hm
