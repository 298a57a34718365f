#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include "hm/core/bytes/little_endian.hpp"
#include "hm/link/codec/crc16.hpp"
#include "hm/link/codec/wire_fields.hpp"

namespace hm {

/// Largest payload of a MAVLink message, bytes.
inline constexpr std::size_t kMavlinkMaxPayload = 255;

/// One field of a message: its place in the payload, and what CRC_EXTRA is computed from.
struct MavlinkField {
  std::string_view name, type;
  std::uint8_t element_bytes = 0;
  std::uint8_t count = 0;  ///< elements of an array; 0: not an array
  std::uint8_t offset = 0;
  bool extension = false;
  [[nodiscard]] constexpr std::uint8_t bytes() const {
    return static_cast<std::uint8_t>(element_bytes * (count ? count : 1));
  }
};

namespace detail {

template <class T>
constexpr std::string_view mavlink_type_name() {
  constexpr std::array<std::string_view, 4> kSigned{"int8_t", "int16_t", "int32_t", "int64_t"};
  constexpr std::array<std::string_view, 4> kUnsigned{"uint8_t", "uint16_t", "uint32_t", "uint64_t"};
  if constexpr (std::is_same_v<T, char>) return "char";
  if constexpr (std::is_same_v<T, float>) return "float";
  constexpr std::size_t kPlace = sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : sizeof(T) == 4 ? 2 : 3;
  return std::is_signed_v<T> ? kSigned[kPlace] : kUnsigned[kPlace];
}

/// No message that we speak has more fields.
inline constexpr std::size_t kMaxMavlinkFields = 24;

struct MavlinkFieldList {
  std::array<MavlinkField, kMaxMavlinkFields> fields{};
  std::size_t count = 0;
  template <class Field>
  constexpr void field(std::string_view name, const Field&) {
    add<Field>(name, false);
  }
  template <class Field>
  constexpr void extension(std::string_view name, const Field&) {
    add<Field>(name, true);
  }
  template <class Field>
  constexpr void add(std::string_view name, bool is_extension) {
    using Element = typename WireType<Field>::Element;
    fields[count++] = {name,        mavlink_type_name<Element>(), sizeof(Element), WireType<Field>::kCount, 0,
                       is_extension};
  }
};

}  // namespace detail

/// Layout of a message, computed from its fields (mavlink.io, "Packet Serialization"): fields ordered by the
/// size of their elements, largest first, equal sizes in the order of the definition; then the extensions as
/// defined. CRC_EXTRA is a checksum of the message's name and of the types and names of the fields before the
/// extensions, so that two programs with different definitions refuse each other's messages.
struct MavlinkLayout {
  detail::MavlinkFieldList list;
  std::uint8_t base_bytes = 0;  ///< without extensions: the size in MAVLink 1
  std::uint8_t bytes = 0;
  std::uint8_t crc_extra = 0;
  [[nodiscard]] constexpr std::span<const MavlinkField> fields() const {
    return std::span(list.fields).first(list.count);
  }
};

template <class Message>
constexpr MavlinkLayout make_mavlink_layout() {
  MavlinkLayout layout;
  const Message message{};
  Message::visit(message, layout.list);
  Crc16 crc(0xFFFF);
  crc.add(Message::kName);
  crc.add(std::string_view(" "));
  std::size_t offset = 0;
  for (const int size : {8, 4, 2, 1})
    for (std::size_t i = 0; i < layout.list.count; ++i) {
      MavlinkField& field = layout.list.fields[i];
      if (field.extension || field.element_bytes != size) continue;
      field.offset = static_cast<std::uint8_t>(offset);
      offset += field.bytes();
      crc.add(field.type);
      crc.add(std::string_view(" "));
      crc.add(field.name);
      crc.add(std::string_view(" "));
      if (field.count) crc.add(field.count);
    }
  layout.base_bytes = static_cast<std::uint8_t>(offset);
  for (std::size_t i = 0; i < layout.list.count; ++i) {
    MavlinkField& field = layout.list.fields[i];
    if (!field.extension) continue;
    field.offset = static_cast<std::uint8_t>(offset);
    offset += field.bytes();
  }
  layout.bytes = static_cast<std::uint8_t>(offset);
  layout.crc_extra = static_cast<std::uint8_t>((crc.value() & 0xFFU) ^ (crc.value() >> 8U));
  return layout;
}

template <class Message>
inline constexpr MavlinkLayout kMavlinkLayout = make_mavlink_layout<Message>();

namespace detail {

template <class Message>
struct MavlinkStore {
  std::uint8_t* payload;
  std::size_t index = 0;
  template <class Field>
  constexpr void field(std::string_view, const Field& value) {
    store_little_endian(payload + kMavlinkLayout<Message>.list.fields[index++].offset, value);
  }
  template <class Field>
  constexpr void extension(std::string_view name, const Field& value) {
    field(name, value);
  }
};

template <class Message>
struct MavlinkLoad {
  const std::uint8_t* payload;
  std::size_t index = 0;
  template <class Field>
  constexpr void field(std::string_view, Field& value) {
    load_little_endian(payload + kMavlinkLayout<Message>.list.fields[index++].offset, value);
  }
  template <class Field>
  constexpr void extension(std::string_view name, Field& value) {
    field(name, value);
  }
};

}  // namespace detail

/// Writes a message to its payload; the bytes behind it are left alone. Returns the length without the zeros
/// at its end (at least 1, as MAVLink 2 wants).
template <class Message>
constexpr std::uint8_t store_mavlink_payload(const Message& message,
                                             std::array<std::uint8_t, kMavlinkMaxPayload>& payload) {
  Message::visit(message, detail::MavlinkStore<Message>{payload.data()});
  std::uint8_t length = kMavlinkLayout<Message>.bytes;
  while (length > 1 && payload[length - 1U] == 0) --length;
  return length;
}

/// Reads a message from a payload that is filled up with zeros behind its length.
template <class Message>
constexpr Message load_mavlink_payload(const std::array<std::uint8_t, kMavlinkMaxPayload>& payload) {
  Message message;
  Message::visit(message, detail::MavlinkLoad<Message>{payload.data()});
  return message;
}

}  // namespace hm
