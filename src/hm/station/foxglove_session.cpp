#include "hm/station/foxglove_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <span>

#include "hm/core/bytes/little_endian.hpp"
#include "hm/io/bytes/json.hpp"

namespace hm {
namespace {

constexpr std::uint8_t kMessageData = 1;
constexpr int kWarning = 1, kError = 2;  // levels of a status
constexpr std::size_t kMaxTexts = 100;

std::optional<std::uint32_t> id_of(const std::int64_t* id) {
  if (!id || *id < 0 || *id > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(*id);
}

/// Channel of a subscription; nothing if there is none.
std::optional<FoxgloveChannel> channel_of(std::uint32_t id) {
  const auto* found =
      std::find(kFoxgloveChannels.begin(), kFoxgloveChannels.end(), static_cast<FoxgloveChannel>(id));
  if (found == kFoxgloveChannels.end()) return std::nullopt;
  return *found;
}

}  // namespace

std::optional<std::string> foxglove_protocol(const std::vector<std::string>& offered) {
  for (const char* name : {"foxglove.sdk.v1", "foxglove.websocket.v1"})
    if (std::find(offered.begin(), offered.end(), name) != offered.end()) return name;
  return std::nullopt;
}

FoxgloveSession::FoxgloveSession(const LiveStore& store) : store_(store) {
  const auto info = JsonValue::object({{"op", "serverInfo"},
                                       {"name", "housemartin"},
                                       {"capabilities", JsonValue::array()},
                                       {"supportedEncodings", JsonValue::array()},
                                       {"metadata", JsonValue::object()},
                                       {"sessionId", store.session()}});
  auto channels = JsonValue::array();
  for (const auto channel : kFoxgloveChannels) channels.push_back(foxglove_advertisement(channel));
  texts_.push_back(to_json_text(info, JsonStyle::kCompact));
  texts_.push_back(
      to_json_text(JsonValue::object({{"op", "advertise"}, {"channels", channels}}), JsonStyle::kCompact));
}

void FoxgloveSession::tell(int level, std::string text) {
  const auto status = JsonValue::object({{"op", "status"}, {"level", level}, {"message", std::move(text)}});
  if (texts_.size() < kMaxTexts) texts_.push_back(to_json_text(status, JsonStyle::kCompact));
}

WebOutput FoxgloveSession::receive(std::string_view message, bool is_text, Duration) {
  if (!is_text) return WebClose{WebClose::kData, "this server takes no data"};
  const auto json = parse_json(message, "message");
  if (!json) return WebClose{WebClose::kProtocol, "no JSON: " + json.error().message};
  const auto* op = json->find_as<std::string>("op");
  if (!op) return WebClose{WebClose::kProtocol, "a message needs an op"};
  std::optional<std::string> wrong;
  if (*op == "subscribe")
    wrong = subscribe(*json);
  else if (*op == "unsubscribe")
    wrong = unsubscribe(*json);
  else
    tell(kWarning, fmt::format("op '{}' is not served", op->substr(0, 40)));
  if (wrong) return WebClose{WebClose::kProtocol, std::move(*wrong)};
  return {};
}

std::optional<std::string> FoxgloveSession::subscribe(const JsonValue& message) {
  const auto* list = message.find_as<JsonValue::Array>("subscriptions");
  if (!list) return "subscribe needs subscriptions";
  for (const JsonValue& one : *list) {
    const auto id = id_of(one.find_as<std::int64_t>("id")),
               channel_id = id_of(one.find_as<std::int64_t>("channelId"));
    if (!id || !channel_id) return "a subscription needs an id and a channelId";
    const auto channel = channel_of(*channel_id);
    if (!channel || subscriptions_.contains(*id) || subscriptions_.size() >= kMaxSubscriptions) {
      tell(kError, fmt::format("subscription {} to channel {} is refused", *id, *channel_id));
      continue;
    }
    subscriptions_.emplace(*id, *channel);
    // What there is now is sent at once; the events so far wait in any case.
    if (*channel != FoxgloveChannel::kLog &&
        std::find(dirty_.begin(), dirty_.end(), *channel) == dirty_.end())
      dirty_.push_back(*channel);
  }
  return std::nullopt;
}

std::optional<std::string> FoxgloveSession::unsubscribe(const JsonValue& message) {
  const auto* list = message.find_as<JsonValue::Array>("subscriptionIds");
  if (!list) return "unsubscribe needs subscriptionIds";
  for (const JsonValue& one : *list) {
    const auto id = id_of(one.as_integer());
    if (!id) return "subscriptionIds has to be a list of ids";
    subscriptions_.erase(*id);
  }
  return std::nullopt;
}

void FoxgloveSession::collect() {
  changes_.clear();
  seen_change_ = store_.changes_after(seen_change_, changes_);
  for (const LiveChange& change : changes_) {
    if (change.slot.kind == LiveKind::kEvent) {
      events_.insert(change.slot);
      continue;
    }
    for (const auto channel : kFoxgloveChannels)
      if (foxglove_source(channel) == change.slot.kind &&
          std::find(dirty_.begin(), dirty_.end(), channel) == dirty_.end())
        dirty_.push_back(channel);
  }
}

WebOutput FoxgloveSession::next(Duration now) {
  if (!copies_.empty()) {
    WebMessage copy = std::move(copies_.front());
    copies_.pop_front();
    return copy;
  }
  if (!texts_.empty()) {
    WebMessage text = WebMessage::of_text(texts_.front());
    texts_.pop_front();
    return text;
  }
  collect();
  if (auto message = next_event()) return std::move(*message);
  if (auto message = next_state(now)) return std::move(*message);
  return {};
}

std::optional<WebMessage> FoxgloveSession::next_event() {
  const bool wanted = std::any_of(subscriptions_.begin(), subscriptions_.end(),
                                  [](const auto& one) { return one.second == FoxgloveChannel::kLog; });
  while (wanted && !events_.empty()) {
    const auto event = store_.read(*events_.begin());
    events_.erase(events_.begin());
    const auto message = event ? foxglove_log(*event) : std::nullopt;
    if (message) return data(FoxgloveChannel::kLog, *message);
  }
  // Those that the store has dropped are of no use here either.
  while (events_.size() > LiveStore::kMaxEvents) events_.erase(events_.begin());
  return std::nullopt;
}

std::optional<WebMessage> FoxgloveSession::next_state(Duration now) {
  for (auto it = dirty_.begin(); it != dirty_.end();) {
    const FoxgloveChannel channel = *it;
    const bool wanted = std::any_of(subscriptions_.begin(), subscriptions_.end(),
                                    [&](const auto& one) { return one.second == channel; });
    const auto sent = sent_at_.find(channel);
    const bool too_early = foxglove_source(channel) == LiveKind::kPath && sent != sent_at_.end() &&
                           now.ns - sent->second.ns < kPathPeriod.ns;
    if (wanted && too_early) {
      ++it;
      continue;
    }
    it = dirty_.erase(it);
    const auto message = wanted ? foxglove_message(store_, channel) : std::nullopt;
    if (!message) continue;
    sent_at_[channel] = now;
    return data(channel, *message);
  }
  return std::nullopt;
}

/// The message for the first subscription to the channel; the same for the others waits.
WebMessage FoxgloveSession::data(FoxgloveChannel channel, const FoxgloveMessage& message) {
  const std::string text = to_json_text(message.value, JsonStyle::kCompact);
  const auto bytes = std::as_bytes(std::span(text));
  const auto body = std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end());
  for (const auto& [id, subscribed] : subscriptions_) {
    if (subscribed != channel) continue;
    std::array<std::uint8_t, 1 + 4 + 8> header{kMessageData};
    store_little_endian(header.data() + 1, id);
    store_little_endian(header.data() + 5, static_cast<std::uint64_t>(message.stamp.ns));
    WebMessage& copy = copies_.emplace_back();
    const auto head = std::as_bytes(std::span(header));
    copy.head.assign(head.begin(), head.end());
    copy.body = body;
  }
  WebMessage first = std::move(copies_.front());
  copies_.pop_front();
  return first;
}

}  // namespace hm
