#include "hm/link/codec/mavlink_frame.hpp"

#include "hm/link/codec/crc16.hpp"

namespace hm {

std::size_t write_mavlink_frame(const MavlinkFrame& frame, MavlinkBytes& bytes, MavlinkSigner* signer) {
  const MavlinkTableEntry* entry = find_mavlink_message(frame.message);
  if (!entry) return 0;
  bytes[0] = kMavlink2Start;
  bytes[1] = frame.length;
  bytes[2] = signer ? kMavlinkSignedFlag : 0;
  bytes[3] = 0;  // compatible flags
  bytes[4] = frame.sequence;
  bytes[5] = frame.from.system;
  bytes[6] = frame.from.component;
  for (std::size_t i = 0; i < 3; ++i) bytes[7 + i] = static_cast<std::uint8_t>(frame.message >> (8 * i));
  for (std::size_t i = 0; i < frame.length; ++i) bytes[kMavlinkHeaderBytes + i] = frame.payload[i];
  std::size_t end = kMavlinkHeaderBytes + frame.length;
  Crc16 crc(0xFFFF);
  crc.add(std::span(bytes).subspan(1, end - 1));
  crc.add(entry->crc_extra);
  bytes[end++] = static_cast<std::uint8_t>(crc.value() & 0xFFU);
  bytes[end++] = static_cast<std::uint8_t>(crc.value() >> 8U);
  if (!signer) return end;
  signer->sign(std::span(bytes).first(end),
               std::span<std::uint8_t, kMavlinkSignatureBytes>(bytes.data() + end, kMavlinkSignatureBytes));
  return end + kMavlinkSignatureBytes;
}

}  // namespace hm
