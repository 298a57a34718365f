#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hm/link/codec/mavlink_frame.hpp"

namespace hm {

/// Counts of a parser. A candidate is what follows a start byte; noise has some too.
struct MavlinkParserCounts {
  std::uint64_t frames = 0;           ///< accepted
  std::uint64_t mavlink1 = 0;         ///< frames of MAVLink 1, skipped
  std::uint64_t unknown_message = 0;  ///< complete frames of a message that is not in the table, skipped
  std::uint64_t incompatible = 0;     ///< candidates with an incompatible flag that we do not know
  std::uint64_t bad_crc = 0;          ///< candidates with a wrong checksum
  std::uint64_t cut_off = 0;          ///< candidates that good frames or silence ended
  std::uint64_t bad_signature = 0;    ///< frames whose signature is wrong
  std::uint64_t replayed = 0;         ///< signed frames whose stamp was not new
  std::uint64_t not_signed = 0;       ///< frames without the signature that is demanded
  std::uint64_t skipped_bytes = 0;    ///< bytes that belong to no frame
};

/// Finds frames in a stream of bytes. After a false start (noise, a damaged length) the bytes behind it are
/// read again. While a candidate is incomplete, two good frames in a row inside of it end it: a false start
/// delays at most two frames, and swallows at most one (if it looks like a message that we do not know).
class MavlinkParser {
 public:
  /// With a verifier, only signed frames are accepted; it must outlive the parser.
  explicit MavlinkParser(MavlinkVerifier* verifier = nullptr) : verifier_(verifier) {}

  /// Takes as many bytes as there is room for (at least one after next() returned nothing), and returns how
  /// many.
  std::size_t push(std::span<const std::uint8_t> bytes);
  /// The next frame, or nothing until more bytes come.
  std::optional<MavlinkFrame> next() { return next(false); }
  /// As next(), but the bytes so far are all that come: at the end of a datagram, or after a silence. Call it
  /// until it returns nothing.
  std::optional<MavlinkFrame> next_at_end() { return next(true); }

  /// Calls `handle(const MavlinkFrame&)` for each frame in a piece of a stream.
  template <class Handle>
  void parse(std::span<const std::uint8_t> bytes, Handle&& handle) {
    while (!bytes.empty()) {
      bytes = bytes.subspan(push(bytes));
      while (const auto frame = next()) handle(*frame);
    }
  }
  [[nodiscard]] const MavlinkParserCounts& counts() const { return counts_; }

 private:
  enum class Verdict : std::uint8_t { kIncomplete, kGood, kMavlink1, kUnknown, kIncompatible, kBadCrc };
  struct Candidate {
    Verdict verdict;
    std::size_t bytes;  ///< of the whole frame, as far as known
  };
  struct Header {
    enum class State : std::uint8_t { kShort, kIncompatible, kKnown, kForeign };
    State state = State::kShort;
    bool is_old = false;                             ///< MAVLink 1
    std::size_t payload_at = 0, end = 0, bytes = 0;  ///< `end` of the payload, `bytes` of the whole frame
    const MavlinkTableEntry* entry = nullptr;
  };
  std::optional<MavlinkFrame> next(bool at_end);
  [[nodiscard]] Header read_header(std::size_t at) const;
  [[nodiscard]] Candidate examine() const;
  [[nodiscard]] Verdict examine_known(std::size_t at, const Header& header) const;
  [[nodiscard]] Verdict examine_foreign(const Header& front) const;
  [[nodiscard]] std::size_t good_frame_bytes(std::size_t at) const;
  [[nodiscard]] std::size_t find_two_frames(std::size_t end) const;
  std::optional<MavlinkFrame> accept(std::size_t bytes);
  bool refuse(const Candidate& candidate, bool at_end);
  [[nodiscard]] bool signature_is_good(std::size_t bytes);
  void drop(std::size_t bytes);
  void skip_to_start();

  std::array<std::uint8_t, 2 * kMavlinkMaxFrame> buffer_{};
  std::size_t count_ = 0;
  MavlinkVerifier* verifier_;
  MavlinkParserCounts counts_;
};

}  // namespace hm
