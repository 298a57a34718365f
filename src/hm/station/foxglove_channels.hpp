#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "hm/core/json_value.hpp"
#include "hm/core/time.hpp"
#include "hm/station/live_store.hpp"

namespace hm {

/// Channels that Foxglove can subscribe to.
enum class FoxgloveChannel : std::uint32_t {
  kTransforms = 1,  ///< of camera and vehicle in `map`
  kCameraPose,
  kVehiclePose,
  kTrajectory,
  kKeyframes,
  kWayPoints,
  kLaserScan,
  kLaserPoints,
  kObstacles,
  kLog,
};
inline constexpr std::array kFoxgloveChannels{FoxgloveChannel::kTransforms,  FoxgloveChannel::kCameraPose,
                                              FoxgloveChannel::kVehiclePose, FoxgloveChannel::kTrajectory,
                                              FoxgloveChannel::kKeyframes,   FoxgloveChannel::kWayPoints,
                                              FoxgloveChannel::kLaserScan,   FoxgloveChannel::kLaserPoints,
                                              FoxgloveChannel::kObstacles,   FoxgloveChannel::kLog};

/// How a channel is advertised: id, topic, encoding, name and text of its JSON schema.
JsonValue foxglove_advertisement(FoxgloveChannel channel);

/// Kind of frames that a channel is made from.
LiveKind foxglove_source(FoxgloveChannel channel);

struct FoxgloveMessage {
  Time stamp;
  JsonValue value;
};

/// Newest state of a channel but kLog; nothing if the store has none.
std::optional<FoxgloveMessage> foxglove_message(const LiveStore& store, FoxgloveChannel channel);

/// A message of kLog from an event.
std::optional<FoxgloveMessage> foxglove_log(const LiveItem& event);

}  // namespace hm
