#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "hm/link/codec/mavlink_commands.hpp"
#include "hm/link/codec/mavlink_layout.hpp"
#include "hm/link/codec/mavlink_telemetry.hpp"

namespace hm {

template <class... Messages>
struct MavlinkMessageList {
  static constexpr std::size_t kCount = sizeof...(Messages);
  /// Calls visitor.template operator()<Message>() for each.
  template <class Visitor>
  static constexpr void for_each(Visitor&& visitor) {
    (visitor.template operator()<Messages>(), ...);
  }
};

/// Every message that we speak, ordered by number.
using MavlinkMessages =
    MavlinkMessageList<MavHeartbeat, MavSysStatus, MavParamRequestRead, MavParamRequestList, MavParamValue,
                       MavParamSet, MavAttitude, MavAttitudeQuaternion, MavLocalPositionNed,
                       MavMissionRequestList, MavMissionCount, MavSetGpsGlobalOrigin, MavManualControl,
                       MavCommandInt, MavCommandLong, MavCommandAck, MavSetAttitudeTarget,
                       MavSetPositionTargetLocalNed, MavHilActuatorControls, MavVisionPositionEstimate,
                       MavHilSensor, MavTimesync, MavBatteryStatus, MavAutopilotVersion, MavExtendedSysState,
                       MavStatusText, MavOdometry>;

/// Properties of a message that its frame depends on.
struct MavlinkTableEntry {
  std::uint32_t id = 0;
  std::uint8_t crc_extra = 0, base_bytes = 0, bytes = 0;
  std::string_view name;
};

namespace detail {
constexpr std::array<MavlinkTableEntry, MavlinkMessages::kCount> make_mavlink_table() {
  std::array<MavlinkTableEntry, MavlinkMessages::kCount> table{};
  std::size_t i = 0;
  MavlinkMessages::for_each([&]<class Message>() {
    constexpr const MavlinkLayout& kLayout = kMavlinkLayout<Message>;
    table[i++] = {Message::kId, kLayout.crc_extra, kLayout.base_bytes, kLayout.bytes, Message::kName};
  });
  return table;
}
}  // namespace detail

inline constexpr auto kMavlinkTable = detail::make_mavlink_table();

/// The entry of a message number, or nullptr.
constexpr const MavlinkTableEntry* find_mavlink_message(std::uint32_t id) {
  std::size_t low = 0, high = kMavlinkTable.size();
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (kMavlinkTable[middle].id < id)
      low = middle + 1;
    else
      high = middle;
  }
  return low < kMavlinkTable.size() && kMavlinkTable[low].id == id ? &kMavlinkTable[low] : nullptr;
}

namespace detail {
constexpr bool mavlink_table_is_ordered() {
  for (std::size_t i = 1; i < kMavlinkTable.size(); ++i)
    if (kMavlinkTable[i - 1].id >= kMavlinkTable[i].id) return false;
  return true;
}
template <class Message>
constexpr bool mavlink_message_is(std::uint8_t crc_extra, std::uint8_t bytes) {
  return kMavlinkLayout<Message>.crc_extra == crc_extra && kMavlinkLayout<Message>.bytes == bytes;
}
}  // namespace detail

// CRC_EXTRA and full size as published (mavlink.io; two implementations): a wrong type, name or order of a
// field does not compile.
static_assert(detail::mavlink_table_is_ordered());
static_assert(detail::mavlink_message_is<MavHeartbeat>(50, 9));
static_assert(detail::mavlink_message_is<MavSysStatus>(124, 43));
static_assert(detail::mavlink_message_is<MavParamRequestRead>(214, 20));
static_assert(detail::mavlink_message_is<MavParamRequestList>(159, 2));
static_assert(detail::mavlink_message_is<MavParamValue>(220, 25));
static_assert(detail::mavlink_message_is<MavParamSet>(168, 23));
static_assert(detail::mavlink_message_is<MavAttitude>(39, 28));
static_assert(detail::mavlink_message_is<MavAttitudeQuaternion>(246, 48));
static_assert(detail::mavlink_message_is<MavLocalPositionNed>(185, 28));
static_assert(detail::mavlink_message_is<MavMissionRequestList>(132, 3));
static_assert(detail::mavlink_message_is<MavMissionCount>(221, 9));
static_assert(detail::mavlink_message_is<MavSetGpsGlobalOrigin>(41, 21));
static_assert(detail::mavlink_message_is<MavManualControl>(243, 30));
static_assert(detail::mavlink_message_is<MavCommandInt>(158, 35));
static_assert(detail::mavlink_message_is<MavCommandLong>(152, 33));
static_assert(detail::mavlink_message_is<MavCommandAck>(143, 10));
static_assert(detail::mavlink_message_is<MavSetAttitudeTarget>(49, 51));
static_assert(detail::mavlink_message_is<MavSetPositionTargetLocalNed>(143, 53));
static_assert(detail::mavlink_message_is<MavVisionPositionEstimate>(158, 117));
static_assert(detail::mavlink_message_is<MavHilActuatorControls>(47, 81));
static_assert(detail::mavlink_message_is<MavHilSensor>(108, 65));
static_assert(detail::mavlink_message_is<MavTimesync>(34, 18));
static_assert(detail::mavlink_message_is<MavBatteryStatus>(154, 54));
static_assert(detail::mavlink_message_is<MavAutopilotVersion>(178, 78));
static_assert(detail::mavlink_message_is<MavExtendedSysState>(130, 2));
static_assert(detail::mavlink_message_is<MavStatusText>(83, 54));
static_assert(detail::mavlink_message_is<MavOdometry>(91, 233));

}  // namespace hm
