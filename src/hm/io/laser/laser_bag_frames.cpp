#include "hm/io/laser/laser_bag_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>
#include <optional>
#include <tuple>

#include "hm/io/laser/laser_readers.hpp"
#include "hm/io/rosbag/bag_format.hpp"

namespace hm::detail {
namespace {

constexpr double kFixed_m = 1e-3, kFixed_rad = 0.1 * std::numbers::pi / 180;
constexpr double kFarthest_m = 1e9;
constexpr std::size_t kMostPairs = 4096, kLongestName = 256;
constexpr std::array<std::string_view, 2> kBaseNames{"base_link", "base_footprint"};

std::string without_slash(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

/// Name of a frame without the prefix of its robot.
std::string_view short_name(std::string_view frame) {
  return frame.substr(frame.rfind('/') + 1);  // npos + 1 is 0
}

bool is_base_name(std::string_view frame) {
  return std::ranges::find(kBaseNames, short_name(frame)) != kBaseNames.end();
}

bool is_odometry_name(std::string_view frame) {
  return short_name(frame).find("odom") != std::string_view::npos;
}

/// A vehicle moves in such a frame: it is not the vehicle's.
bool is_world_name(std::string_view frame) {
  const std::string_view name = short_name(frame);
  return is_odometry_name(frame) || name.starts_with("map") || name.starts_with("world") || name == "earth";
}

std::optional<SkippedLines::Reason> fault_of(const TransformMessage& transform) {
  if (!transform.position_m.allFinite() || !transform.quaternion.allFinite() ||
      transform.position_m.norm() > kFarthest_m)
    return SkippedLines::Reason::kNotFinite;
  if (!rotation_of(transform.quaternion)) return SkippedLines::Reason::kNotRigid;
  const std::string parent = without_slash(transform.header.frame_id),
                    child = without_slash(transform.child_frame_id);
  if (parent.empty() || child.empty() || parent == child ||
      std::max(parent.size(), child.size()) > kLongestName)
    return SkippedLines::Reason::kMalformed;
  return {};
}

}  // namespace

bool BagFrames::Edge::is_fixed() const { return moved_m <= kFixed_m && turned_rad <= kFixed_rad; }

void BagFrames::add(const BagMessage& message) {
  const BagConnection& connection = message.connection;
  if (connection.type != kTransformsType.name && connection.type != kOldTransformsName) return;
  if (connection.md5sum != kTransformsType.md5sum && connection.md5sum != "*") {
    other_versions_.insert(connection.topic);
    return;
  }
  Topic& topic = topics_.try_emplace(connection.topic, Topic{0, SkipCounter::of_messages(connection.topic)})
                     .first->second;
  ++topic.seen;
  const auto transforms = parse_transforms(message.data);
  if (!transforms) return topic.skips.add(SkippedLines::Reason::kMalformed, topic.seen);
  for (const TransformMessage& transform : *transforms) add(transform, message, topic);
}

void BagFrames::add(const TransformMessage& transform, const BagMessage& message, Topic& topic) {
  if (const auto fault = fault_of(transform)) return topic.skips.add(*fault, topic.seen);
  const Time stamp = transform.header.stamp.ns == 0 ? message.received : transform.header.stamp;
  add_to_edge({without_slash(transform.header.frame_id), without_slash(transform.child_frame_id)},
              {stamp, SE3(*rotation_of(transform.quaternion), transform.position_m)}, message, topic);
}

void BagFrames::add_to_edge(const Pair& frames, const StampedPose& pose, const BagMessage& message,
                            const Topic& topic) {
  auto found = edges_.find(frames);
  if (found == edges_.end()) {
    if (edges_.size() >= kMostPairs) {
      too_many_ = true;
      return;
    }
    found = edges_.emplace(frames, Edge{.T_parent_child = pose.T_world_base, .order = edges_.size()}).first;
    found->second.topic = message.connection.topic;
    names_.insert({frames.first, frames.second});
  }
  Edge& edge = found->second;
  const SE3 change = edge.T_parent_child.inverse() * pose.T_world_base;
  edge.moved_m = std::max(edge.moved_m, change.translation().norm());
  edge.turned_rad = std::max(edge.turned_rad, change.angle());
  if (!is_odometry_name(frames.first) || is_world_name(frames.second)) return;
  edge.poses.push_back(pose);
  edge.messages.push_back(topic.seen);
}

/// The transforms from a frame of odometry to the base, if any: those that change before fixed ones, bases
/// known by name before others, then the first of the bag.
BagFrames::EdgeEntry* BagFrames::odometry_edge() {
  EdgeEntry* best = nullptr;
  const auto rank = [](const EdgeEntry& entry) {
    return std::tuple(entry.second.is_fixed(), !is_base_name(entry.first.second), entry.second.order);
  };
  for (EdgeEntry& entry : edges_)
    if (!entry.second.poses.empty() && (best == nullptr || rank(entry) < rank(*best))) best = &entry;
  return best;
}

std::string BagFrames::base_frame(const std::string& odometry_child, const EdgeEntry* odometry) const {
  if (names_.contains(without_slash(odometry_child))) return without_slash(odometry_child);
  if (odometry != nullptr) return odometry->first.second;
  for (const std::string_view base : kBaseNames) {
    const auto found =
        std::ranges::find_if(names_, [&](const std::string& name) { return short_name(name) == base; });
    if (found != names_.end()) return *found;
  }
  return {};
}

std::map<std::string, std::vector<BagFrames::Link>> BagFrames::links() const {
  std::map<std::string, std::vector<Link>> links;
  for (const EdgeEntry& entry : edges_) {
    const auto& [parent, child] = entry.first;
    links[parent].push_back({child, entry.second.T_parent_child, &entry});
    links[child].push_back({parent, entry.second.T_parent_child.inverse(), &entry});
  }
  return links;
}

void BagFrames::take_odometry(EdgeEntry& odometry, LaserRecording& recording) {
  auto& [frames, edge] = odometry;
  const std::string words = fmt::format("{} -> {}", frames.first, frames.second);
  if (edge.is_fixed()) {
    recording.notes.push_back(
        fmt::format("{}: {} never changes and is not taken as odometry", edge.topic, words));
    return;
  }
  // The same transform is often sent again, with the same stamp.
  std::set<Time> stamps;
  Trajectory poses;
  std::vector<std::size_t> messages;
  for (std::size_t i = 0; i < edge.poses.size(); ++i) {
    if (!stamps.insert(edge.poses[i].stamp).second) continue;
    poses.push_back(edge.poses[i]);
    messages.push_back(edge.messages[i]);
  }
  recording.odometry = keep_increasing(
      std::move(poses), messages, [](const StampedPose& pose) { return pose.stamp; },
      topics_.at(edge.topic).skips);
  recording.odometry_source = fmt::format("{} ({})", edge.topic, words);
}

BagFrames::Placed BagFrames::place(const std::string& base, const std::string& frame_id) const {
  const std::string frame = without_slash(frame_id);
  if (frame.empty()) return {{}, "its messages name no frame"};
  if (base.empty())
    return {{},
            "no transform names a base of the vehicle (base_link, base_footprint, or a frame that moves in "
            "odom)"};
  struct Reached {
    SE3 T_base_frame;
    const EdgeEntry* moving;  // on the way
  };
  std::map<std::string, Reached> reached{{base, {SE3(), nullptr}}};
  const auto all_links = links();
  // Frames that fixed transforms join to the base come first.
  for (const bool fixed : {true, false}) {
    std::deque<std::string> open;
    for (const auto& [name, place] : reached) open.push_back(name);
    while (!open.empty() && !reached.contains(frame)) {
      const std::string from = open.front();
      open.pop_front();
      const auto found = all_links.find(from);
      if (found == all_links.end()) continue;
      for (const Link& link : found->second) {
        if (reached.contains(link.to) || (fixed && !link.edge->second.is_fixed())) continue;
        const Reached& here = reached.at(from);
        const EdgeEntry* moving =
            here.moving != nullptr || link.edge->second.is_fixed() ? here.moving : link.edge;
        reached.emplace(link.to, Reached{here.T_base_frame * link.T_from_to, moving});
        open.push_back(link.to);
      }
    }
  }
  const auto found = reached.find(frame);
  if (found == reached.end())
    return {{}, fmt::format("no transform joins its frame {} to the base {}", frame, base)};
  if (const EdgeEntry* moving = found->second.moving)
    return {{},
            fmt::format("its mount is not fixed, {} -> {} changes by up to {:.3g} m and {:.3g} deg",
                        moving->first.first, moving->first.second, moving->second.moved_m,
                        moving->second.turned_rad * 180 / std::numbers::pi)};
  return {found->second.T_base_frame, fmt::format("transforms {} -> {}", base, frame)};
}

void BagFrames::mount(const std::string& base, LaserStream& laser) const {
  const Placed placed = place(base, laser.frame_id);
  if (placed.T_base_frame) {
    laser.T_base_laser = *placed.T_base_frame;
    laser.mount_source = placed.words;
  } else {
    laser.mount_problem = fmt::format(
        "{}: {}: it is taken to be at the base, unless a rig.toml says otherwise", laser.name, placed.words);
  }
}

void BagFrames::apply(const std::string& odometry_child, LaserRecording& recording) {
  for (const std::string& topic : other_versions_)
    recording.notes.push_back(
        fmt::format("{} has another version of {}, which cannot be read", topic, kTransformsType.name));
  if (!edges_.empty() && !recording.lasers.empty()) {
    EdgeEntry* odometry = odometry_edge();
    const bool needs_odometry = recording.odometry.empty();
    const std::string base = base_frame(needs_odometry ? std::string() : odometry_child, odometry);
    if (needs_odometry && odometry != nullptr) take_odometry(*odometry, recording);
    for (LaserStream& laser : recording.lasers) mount(base, laser);
    if (!recording.range.readings.empty()) {
      const Placed placed = place(base, recording.range.frame_id);
      recording.range.T_base_range = placed.T_base_frame;
      recording.range.mount_source = placed.words;
    }
  }
  if (too_many_)
    recording.notes.push_back(
        fmt::format("more than {} pairs of frames: the transforms of further ones are not used", kMostPairs));
  for (auto& [name, topic] : topics_) add_skipped(recording, topic.skips.take());
}

}  // namespace hm::detail
