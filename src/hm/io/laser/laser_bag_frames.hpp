#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rosbag/bag_messages.hpp"
#include "hm/io/rosbag/bag_records.hpp"

namespace hm::detail {

/// Coordinate frames of a bag, from its transforms (`/tf`, `/tf_static`): of every pair of frames the first
/// transform and how far the others differ from it; where the parent is a frame of odometry, all of them.
///
/// Names are compared without a leading '/'. Memory grows with the number of pairs, which is limited, and
/// with the transforms from frames of odometry.
class BagFrames {
 public:
  /// Takes a message with transforms; others are ignored.
  void add(const BagMessage& message);

  /// Sets `mount` or `mount_problem` of every laser, and of the range sensor, by its `frame_id`; without
  /// odometry in `recording` also takes the transforms from the frame of odometry to the base as such.
  /// `odometry_child`: the base, as odometry messages name it. Skipped messages and transforms are counted.
  /// Without any transform nothing changes.
  void apply(const std::string& odometry_child, LaserRecording& recording);

 private:
  using Pair = std::pair<std::string, std::string>;  // parent, child
  struct Edge {
    SE3 T_parent_child;  // the first one
    std::size_t order = 0;
    double moved_m = 0, turned_rad = 0;  // at most, relative to the first one
    std::string topic = {};
    Trajectory poses = {};                   // only of odometry
    std::vector<std::size_t> messages = {};  // their numbers
    [[nodiscard]] bool is_fixed() const;
  };
  struct Topic {
    std::size_t seen = 0;
    SkipCounter skips;
  };
  using EdgeEntry = std::pair<const Pair, Edge>;
  struct Link {
    std::string to;
    SE3 T_from_to;
    const EdgeEntry* edge;
  };

  void add(const TransformMessage& transform, const BagMessage& message, Topic& topic);
  void add_to_edge(const Pair& frames, const StampedPose& pose, const BagMessage& message,
                   const Topic& topic);
  [[nodiscard]] EdgeEntry* odometry_edge();
  [[nodiscard]] std::string base_frame(const std::string& odometry_child, const EdgeEntry* odometry) const;
  [[nodiscard]] std::map<std::string, std::vector<Link>> links() const;
  void take_odometry(EdgeEntry& odometry, LaserRecording& recording);
  /// Where a sensor's frame is on the base, and where that is from; or why it is unknown.
  struct Placed {
    std::optional<SE3> T_base_frame;
    std::string words;
  };
  [[nodiscard]] Placed place(const std::string& base, const std::string& frame_id) const;
  void mount(const std::string& base, LaserStream& laser) const;

  std::map<Pair, Edge> edges_;
  std::map<std::string, Topic> topics_;
  std::set<std::string> names_, other_versions_;
  bool too_many_ = false;
};

}  // namespace hm::detail
