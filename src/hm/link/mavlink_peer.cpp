#include "hm/link/mavlink_peer.hpp"

#include <algorithm>
#include <array>

namespace hm {
namespace {

/// Senders that are remembered at most: whoever makes up addresses gets no memory for it.
constexpr std::size_t kMaxRemotes = 32;
/// Reads in one step, so that a flood of bytes cannot hold up the rest of the program.
constexpr int kMaxReads = 64;

/// From this gap of sequence numbers on a frame is one that came late or twice.
constexpr std::uint8_t kLateGap = 128;

bool is_autopilot(const MavHeartbeat& heartbeat) {
  return heartbeat.autopilot != kMavAutopilotInvalid && heartbeat.type != kMavTypeGroundStation;
}

}  // namespace

MavlinkPeer::MavlinkPeer(Transport& transport, const MavlinkPeerOptions& options)
    : transport_(transport), options_(options), parser_() {
  if (!options.key) return;
  signer_.emplace(*options.key, options.signing_link);
  verifier_.emplace(*options.key);
  parser_ = MavlinkParser(&*verifier_);
}

void MavlinkPeer::set_signing_time(std::uint64_t unix_us) {
  constexpr std::uint64_t kEpochUs = kMavlinkEpochUnixSeconds * 1'000'000, kUsPerTick = 10;
  if (!signer_ || unix_us < kEpochUs) return;
  signer_->set_ticks((unix_us - kEpochUs) / kUsPerTick);
  verifier_->set_ticks((unix_us - kEpochUs) / kUsPerTick);
}

bool MavlinkPeer::send_frame(const MavlinkFrame& frame) {
  MavlinkBytes bytes{};
  const std::size_t count = write_mavlink_frame(frame, bytes, signer_ ? &*signer_ : nullptr);
  ++sequence_;
  const bool sent = transport_.write(std::span(bytes).first(count));
  unsent_ += !sent;
  return sent;
}

void MavlinkPeer::send_text(std::uint8_t severity, std::string_view text) {
  MavStatusText message;
  const std::size_t part = message.text.size();
  message.severity = severity;
  if (text.size() > part) {
    if (++text_id_ == 0) ++text_id_;  // 0 means a text of one part
    message.id = text_id_;
  }
  text = text.substr(0, part * 255 - 1);
  bool is_last = false;
  while (!is_last) {
    message.text = {};
    std::ranges::copy(text.substr(0, part), message.text.begin());
    send(message);
    ++message.chunk_seq;
    // The last one of several is known by its end before 50 letters.
    is_last = message.id == 0 || text.size() < part;
    text.remove_prefix(std::min(part, text.size()));
  }
}

void MavlinkPeer::step(const std::function<Time()>& clock,
                       const std::function<void(const MavlinkFrame&)>& handle) {
  std::array<std::uint8_t, 2048> buffer{};
  for (int i = 0; i < kMaxReads; ++i) {
    const std::size_t count = transport_.read(buffer);
    if (count == 0) break;
    const Time now = clock();
    const auto use = [&](const MavlinkFrame& frame) {
      if (frame.from == options_.address) return;  // our own, that a router sent back
      receive(frame, now);
      handle(frame);
    };
    parser_.parse(std::span(buffer).first(count), use);
    if (!transport_.is_datagram()) continue;
    while (const auto frame = parser_.next_at_end()) use(*frame);
  }
  send_due(clock());
}

void MavlinkPeer::send_due(Time now) {
  if (is_due(last_heartbeat_, options_.heartbeat_period, now)) send(options_.heartbeat);
  if (options_.timesync_period > Duration{} && is_due(last_timesync_, options_.timesync_period, now))
    send(MavTimesync{0, now.ns});
  if (const auto command = commands_.poll(now)) send(*command);
}

void MavlinkPeer::receive(const MavlinkFrame& frame, Time now) {
  const std::pair key{frame.from.system, frame.from.component};
  auto found = remotes_.find(key);
  if (const auto heartbeat = read_mavlink_message<MavHeartbeat>(frame)) {
    if (found == remotes_.end() && remotes_.size() < kMaxRemotes) {
      found = remotes_.emplace(key, MavlinkRemote{frame.from, {}, {}, 0, 0, frame.sequence}).first;
      order_.push_back(frame.from);
    }
    if (found != remotes_.end()) {
      found->second.heartbeat = *heartbeat;
      found->second.last_heartbeat = now;
    }
  }
  if (found != remotes_.end()) {
    MavlinkRemote& remote = found->second;
    ++remote.frames;
    const auto gap = static_cast<std::uint8_t>(frame.sequence - remote.next_sequence);
    if (gap < kLateGap) {
      remote.lost_frames += gap;
      remote.next_sequence = static_cast<std::uint8_t>(frame.sequence + 1);
    }
  }
  if (const auto message = read_mavlink_message<MavTimesync>(frame)) receive_timesync(frame, *message, now);
  if (const auto ack = read_mavlink_message<MavCommandAck>(frame))
    commands_.receive(*ack, frame.from, options_.address, now);
}

void MavlinkPeer::receive_timesync(const MavlinkFrame& frame, const MavTimesync& message, Time now) {
  if (message.tc1 == 0) {
    send(MavTimesync{now.ns, message.ts1, frame.from.system, frame.from.component});
    return;
  }
  // An answer to our last question, from the one whose clock we follow.
  if (!last_timesync_ || message.ts1 != last_timesync_->ns) return;
  if (!remotes_.contains({frame.from.system, frame.from.component})) return;
  const bool is_clock_alive =
      clock_of_ && remotes_.contains({clock_of_->system, clock_of_->component}) &&
      now - remotes_[{clock_of_->system, clock_of_->component}].last_heartbeat < options_.lost_after;
  if (is_clock_alive && *clock_of_ != frame.from) return;
  if (clock_of_ && *clock_of_ != frame.from) time_sync_ = {};
  clock_of_ = frame.from;
  time_sync_.add(Time{message.ts1}, Time{message.tc1}, now);
}

const MavlinkRemote* MavlinkPeer::autopilot(Time now) const {
  for (const MavlinkAddress& address : order_) {
    const MavlinkRemote& remote = remotes_.at({address.system, address.component});
    if (is_autopilot(remote.heartbeat) && now - remote.last_heartbeat < options_.lost_after) return &remote;
  }
  return nullptr;
}

std::vector<MavlinkRemote> MavlinkPeer::remotes(Time now) const {
  std::vector<MavlinkRemote> result;
  for (const MavlinkAddress& address : order_) {
    const MavlinkRemote& remote = remotes_.at({address.system, address.component});
    if (now - remote.last_heartbeat < options_.lost_after) result.push_back(remote);
  }
  return result;
}

}  // namespace hm
