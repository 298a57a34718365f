#include "hm/link/codec/mavlink_parser.hpp"

#include "hm/link/codec/crc16.hpp"

namespace hm {
namespace {

constexpr std::size_t kMavlink1HeaderBytes = 6;
constexpr std::size_t kLengthAt = 1, kFlagsAt = 2, kMessageAt = 7, kMavlink1MessageAt = 5;

/// Frames of unknown messages in a row that must follow each other to be taken for such.
constexpr std::size_t kForeignChain = 3;

constexpr std::uint32_t message_number(const std::uint8_t* start) {
  return static_cast<std::uint32_t>(start[kMessageAt] | start[kMessageAt + 1] << 8 |
                                    start[kMessageAt + 2] << 16);
}

constexpr bool starts_frame(std::uint8_t byte) { return byte == kMavlink2Start || byte == kMavlink1Start; }

/// Whether the checksum behind `frame` (its bytes up to the checksum, start byte first) is right.
bool crc_is_right(std::span<const std::uint8_t> frame, std::uint8_t crc_extra) {
  Crc16 crc(0xFFFF);
  crc.add(frame.subspan(1));
  crc.add(crc_extra);
  const std::uint8_t* sent = frame.data() + frame.size();
  return sent[0] == (crc.value() & 0xFFU) && sent[1] == (crc.value() >> 8U);
}

}  // namespace

std::size_t MavlinkParser::push(std::span<const std::uint8_t> bytes) {
  std::size_t taken = 0;
  while (taken < bytes.size() && count_ < buffer_.size()) buffer_[count_++] = bytes[taken++];
  return taken;
}

void MavlinkParser::drop(std::size_t bytes) {
  for (std::size_t i = bytes; i < count_; ++i) buffer_[i - bytes] = buffer_[i];
  count_ -= bytes;
}

void MavlinkParser::skip_to_start() {
  std::size_t start = 0;
  while (start < count_ && !starts_frame(buffer_[start])) ++start;
  counts_.skipped_bytes += start;
  if (start > 0) drop(start);
}

/// Reads the header at `at`, which holds a start byte.
MavlinkParser::Header MavlinkParser::read_header(std::size_t at) const {
  const std::uint8_t* start = buffer_.data() + at;
  const std::size_t here = count_ - at;
  Header header;
  header.is_old = start[0] == kMavlink1Start;
  if (!header.is_old && here > kFlagsAt && (start[kFlagsAt] & ~kMavlinkSignedFlag) != 0) {
    header.state = Header::State::kIncompatible;
    return header;
  }
  header.payload_at = header.is_old ? kMavlink1HeaderBytes : kMavlinkHeaderBytes;
  if (here < header.payload_at) return header;
  header.end = header.payload_at + start[kLengthAt];
  const bool is_signed = !header.is_old && start[kFlagsAt] == kMavlinkSignedFlag;
  header.bytes = header.end + kMavlinkCrcBytes + (is_signed ? kMavlinkSignatureBytes : 0);
  header.entry = find_mavlink_message(header.is_old ? start[kMavlink1MessageAt] : message_number(start));
  header.state = header.entry ? Header::State::kKnown : Header::State::kForeign;
  return header;
}

MavlinkParser::Verdict MavlinkParser::examine_known(std::size_t at, const Header& header) const {
  if (count_ - at < header.bytes) return Verdict::kIncomplete;
  if (!crc_is_right({buffer_.data() + at, header.end}, header.entry->crc_extra)) return Verdict::kBadCrc;
  return header.is_old ? Verdict::kMavlink1 : Verdict::kGood;
}

/// The candidate at the front.
MavlinkParser::Candidate MavlinkParser::examine() const {
  const Header header = read_header(0);
  switch (header.state) {
    case Header::State::kIncompatible:
      return {Verdict::kIncompatible, 1};
    case Header::State::kKnown:
      return {examine_known(0, header), header.bytes};
    case Header::State::kForeign:
      return {examine_foreign(header), header.bytes};
    default:
      return {Verdict::kIncomplete, kMavlinkMaxFrame};
  }
}

/// The front holds a frame whose checksum we cannot check, since its message is not in the table. It is one
/// if what follows it is one (at the latest the last of kForeignChain must be known) and no two good frames
/// stand inside of it; otherwise it is a false start.
MavlinkParser::Verdict MavlinkParser::examine_foreign(const Header& front) const {
  const Verdict verdict = front.is_old ? Verdict::kMavlink1 : Verdict::kUnknown;
  // With a full buffer no more bytes come before something is decided.
  const Verdict too_few = count_ < buffer_.size() ? Verdict::kIncomplete : verdict;
  std::size_t at = front.bytes;
  if (count_ <= at) return too_few;
  if (find_two_frames(at) > 0) return Verdict::kBadCrc;
  for (std::size_t i = 0; i < kForeignChain; ++i) {
    if (count_ <= at) return too_few;
    if (!starts_frame(buffer_[at])) return Verdict::kBadCrc;
    const Header header = read_header(at);
    if (header.state == Header::State::kIncompatible) return Verdict::kBadCrc;
    if (header.state == Header::State::kShort) return too_few;
    if (header.state == Header::State::kKnown) {
      const Verdict next = examine_known(at, header);
      if (next == Verdict::kIncomplete) return too_few;
      return next == Verdict::kBadCrc ? Verdict::kBadCrc : verdict;
    }
    at += header.bytes;
  }
  return verdict;
}

/// Bytes of the good frame at `at`, 0 if there is none.
std::size_t MavlinkParser::good_frame_bytes(std::size_t at) const {
  if (at >= count_ || buffer_[at] != kMavlink2Start) return 0;
  const Header header = read_header(at);
  return header.state == Header::State::kKnown && examine_known(at, header) == Verdict::kGood ? header.bytes
                                                                                              : 0;
}

/// Where two good frames in a row begin behind the start byte at the front and before `end`; 0 if nowhere.
/// Two, so that a frame inside of another one's payload (a log that is downloaded) is not taken for one of
/// the stream.
std::size_t MavlinkParser::find_two_frames(std::size_t end) const {
  for (std::size_t at = 1; at < end; ++at) {
    const std::size_t bytes = good_frame_bytes(at);
    if (bytes > 0 && good_frame_bytes(at + bytes) > 0) return at;
  }
  return 0;
}

bool MavlinkParser::signature_is_good(std::size_t bytes) {
  if (!verifier_) return true;
  if (buffer_[kFlagsAt] != kMavlinkSignedFlag) {
    ++counts_.not_signed;
    return false;
  }
  const std::size_t frame = bytes - kMavlinkSignatureBytes;
  const auto check = verifier_->check(
      {buffer_.data(), frame},
      std::span<const std::uint8_t, kMavlinkSignatureBytes>(buffer_.data() + frame, kMavlinkSignatureBytes));
  if (check == MavlinkSignatureCheck::kReplayed) ++counts_.replayed;
  if (check == MavlinkSignatureCheck::kWrong || check == MavlinkSignatureCheck::kTooManyStreams)
    ++counts_.bad_signature;
  return check == MavlinkSignatureCheck::kGood;
}

/// Takes the good frame of `bytes` bytes at the front; nothing if its signature is not.
std::optional<MavlinkFrame> MavlinkParser::accept(std::size_t bytes) {
  std::optional<MavlinkFrame> result;
  if (signature_is_good(bytes)) {
    MavlinkFrame& frame = result.emplace();
    frame.length = buffer_[kLengthAt];
    frame.is_signed = buffer_[kFlagsAt] == kMavlinkSignedFlag;
    frame.sequence = buffer_[4];
    frame.from = {buffer_[5], buffer_[6]};
    frame.message = message_number(buffer_.data());
    for (std::size_t i = 0; i < frame.length; ++i) frame.payload[i] = buffer_[kMavlinkHeaderBytes + i];
    ++counts_.frames;
  }
  drop(bytes);
  return result;
}

/// Drops a candidate that is no good frame; false if it needs more bytes.
bool MavlinkParser::refuse(const Candidate& candidate, bool at_end) {
  std::size_t dropped = 1;  // a false start: what is behind it is read again
  switch (candidate.verdict) {
    case Verdict::kMavlink1:
      ++counts_.mavlink1;
      dropped = candidate.bytes;
      break;
    case Verdict::kUnknown:
      ++counts_.unknown_message;
      dropped = candidate.bytes;
      break;
    case Verdict::kIncompatible:
      ++counts_.incompatible;
      break;
    case Verdict::kIncomplete: {
      const std::size_t resume = find_two_frames(count_);
      if (resume == 0 && !at_end) return false;
      if (at_end &&
          candidate.bytes <= count_) {  // of an unknown message, and nothing comes that speaks against it
        ++(buffer_[0] == kMavlink1Start ? counts_.mavlink1 : counts_.unknown_message);
        dropped = candidate.bytes;
        break;
      }
      ++counts_.cut_off;
      if (resume > 0) dropped = resume;
      counts_.skipped_bytes += dropped;
      break;
    }
    default:
      ++counts_.bad_crc;
      break;
  }
  if (dropped == 1 && candidate.verdict != Verdict::kIncomplete) ++counts_.skipped_bytes;
  drop(dropped);
  return true;
}

std::optional<MavlinkFrame> MavlinkParser::next(bool at_end) {
  while (true) {
    skip_to_start();
    if (count_ == 0) return std::nullopt;
    const Candidate candidate = examine();
    if (candidate.verdict == Verdict::kGood) {
      if (auto frame = accept(candidate.bytes)) return frame;
    } else if (!refuse(candidate, at_end)) {
      return std::nullopt;
    }
  }
}

}  // namespace hm
