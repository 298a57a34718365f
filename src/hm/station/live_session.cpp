#include "hm/station/live_session.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "hm/core/bytes/little_endian.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

constexpr std::int64_t kProtocol = 1;
constexpr std::uint32_t kHelloSequence = 1;

WebClose wrong(std::string reason) { return {WebClose::kProtocol, std::move(reason)}; }

std::optional<std::int64_t> in_range(const std::int64_t* integer, std::int64_t least, std::int64_t most) {
  if (!integer || *integer < least || *integer > most) return std::nullopt;
  return *integer;
}

std::optional<Vec3> vector_of(const JsonValue::Array& list) {
  if (list.size() != 3) return std::nullopt;
  Vec3 result;
  for (std::size_t i = 0; i < 3; ++i)
    result[static_cast<Eigen::Index>(i)] = list[i].number_or(std::numeric_limits<double>::quiet_NaN());
  if (!result.allFinite()) return std::nullopt;
  return result;
}

/// Header, and of a mesh page the part of the payload with the age brought up to now; the rest is not copied.
WebMessage to_message(const QueuedFrame& frame) {
  WebMessage message;
  message.head = live_header(frame.kind, frame.sequence, frame.stamp);
  message.body = frame.payload;
  if (frame.kind != LiveKind::kMeshPage) return message;
  constexpr std::size_t kEnd = kMeshPageAgeOffset + sizeof(float);
  if (frame.payload->size() < kEnd) return message;
  std::array<std::uint8_t, sizeof(float)> bytes{};
  std::memcpy(bytes.data(), frame.payload->data() + kMeshPageAgeOffset, bytes.size());
  float age_s = 0;
  load_little_endian(bytes.data(), age_s);
  store_little_endian(bytes.data(), age_s + frame.age_s);
  message.head.insert(message.head.end(), frame.payload->begin(),
                      frame.payload->begin() + kMeshPageAgeOffset);
  for (const auto byte : bytes) message.head.push_back(static_cast<std::byte>(byte));
  message.body_offset = kEnd;
  return message;
}

}  // namespace

LiveSession::LiveSession(const LiveSessionContext& context, Duration now)
    : context_(context), queue_(context.store, kHelloSequence + 1), opened_(now) {}

WebOutput LiveSession::next(Duration now) {
  if (!hello_sent_) {
    hello_sent_ = true;
    WebMessage message;
    message.head = live_header(LiveKind::kHello, kHelloSequence, {});
    const auto text = text_bytes(context_.hello);
    message.head.insert(message.head.end(), text.begin(), text.end());
    return message;
  }
  if (!greeted_) {
    if (now.ns - opened_.ns < kHelloPatience.ns) return {};
    return WebClose{WebClose::kPolicy, "no hello within 10 s", Refused::kSilent};
  }
  if (const auto frame = queue_.next(now)) return to_message(*frame);
  return {};
}

WebOutput LiveSession::receive(std::string_view message, bool is_text, Duration now) {
  if (!is_text) return WebClose{WebClose::kData, "binary messages are not taken here"};
  const auto json = parse_json(message, "message");
  if (!json) return wrong("no JSON: " + json.error().message);
  const auto* type = json->find_as<std::string>("type");
  if (!type) return wrong("a message needs a type");
  Refusal refusal;
  if (*type == "hello")
    refusal = hello(*json);
  else if (!greeted_)
    refusal = wrong("the first message has to be hello");
  else if (*type == "view")
    refusal = view(*json);
  else if (*type == "ack")
    refusal = ack(*json, now);
  else if (*type == "replay")
    refusal = replay(*json);
  else
    refusal = wrong("type '" + type->substr(0, 40) + "' is not known");
  if (refusal) return std::move(*refusal);
  return {};
}

LiveSession::Refusal LiveSession::hello(const JsonValue& message) {
  if (greeted_) return wrong("hello was said before");
  if (!in_range(message.find_as<std::int64_t>("protocol"), kProtocol, kProtocol))
    return wrong("this server speaks protocol 1 of the live view");
  if (message.text_at("session") == context_.store.session())
    if (auto refusal = know_pages(message)) return refusal;
  if (const JsonValue* all_levels = message.find("all_levels")) {
    if (!all_levels->as_bool()) return wrong("all_levels has to be true or false");
    if (*all_levels->as_bool()) queue_.want_all_levels();
  }
  const bool* more = message.find_as<bool>("more");
  greeted_ = !(more && *more);
  return std::nullopt;
}

LiveSession::Refusal LiveSession::know_pages(const JsonValue& message) {
  const JsonValue* value = message.find("pages");
  if (!value) return std::nullopt;
  const auto* list = value->as_array();
  if (!list || list->size() % 5 != 0) return wrong("pages has to be a list of x, y, z, version, level");
  known_pages_ += list->size() / 5;
  if (known_pages_ > kMaxKnownPages) return WebClose{WebClose::kPolicy, "too many pages"};
  constexpr std::int64_t kLeast = std::numeric_limits<std::int32_t>::min(), kMost = -(kLeast + 1);
  for (std::size_t i = 0; i < list->size(); i += 5) {
    std::array<std::optional<std::int64_t>, 5> numbers;
    for (std::size_t k = 0; k < 3; ++k) numbers[k] = in_range((*list)[i + k].as_integer(), kLeast, kMost);
    numbers[3] = in_range((*list)[i + 3].as_integer(), 0, std::numeric_limits<std::uint32_t>::max());
    numbers[4] = in_range((*list)[i + 4].as_integer(), 0, 2);
    for (const auto& number : numbers)
      if (!number) return wrong("pages holds what is no x, y, z, version, level");
    const PageKey key{static_cast<std::int32_t>(*numbers[0]), static_cast<std::int32_t>(*numbers[1]),
                      static_cast<std::int32_t>(*numbers[2])};
    queue_.know(key, static_cast<std::uint32_t>(*numbers[3]), static_cast<std::uint8_t>(*numbers[4]));
  }
  return std::nullopt;
}

LiveSession::Refusal LiveSession::view(const JsonValue& message) {
  const auto position = vector_of(message.list_at("position"));
  const auto direction = vector_of(message.list_at("direction"));
  if (!position || !direction || !(direction->norm() > 0)) return wrong("view needs position and direction");
  queue_.look(*position, *direction);
  return std::nullopt;
}

LiveSession::Refusal LiveSession::ack(const JsonValue& message, Duration now) {
  const auto sequence = in_range(message.find_as<std::int64_t>("sequence"), kHelloSequence,
                                 std::numeric_limits<std::uint32_t>::max());
  if (!sequence) return wrong("ack of a frame that was not sent");
  switch (queue_.acknowledge(static_cast<std::uint32_t>(*sequence), now)) {
    case Acknowledged::kTaken:
      break;
    case Acknowledged::kNeverSent:
      return wrong("ack of a frame that was not sent");
    case Acknowledged::kBackwards:
      return wrong("ack of a frame before one that was acknowledged");
  }
  return std::nullopt;
}

LiveSession::Refusal LiveSession::replay(const JsonValue& message) {
  if (!context_.replay) return WebClose{WebClose::kPolicy, "this is no replay"};
  ReplayRequest request;
  const JsonValue* paused = message.find("paused");
  if (paused && !paused->as_bool()) return wrong("paused has to be true or false");
  if (paused) request.paused = *paused->as_bool();
  for (const auto& [name, number] :
       {std::pair{"speed", &request.speed}, std::pair{"seek_s", &request.seek_s}}) {
    const JsonValue* value = message.find(name);
    if (!value) continue;
    *number = value->number_or(std::numeric_limits<double>::quiet_NaN());
    if (!std::isfinite(**number)) return wrong(std::string(name) + " has to be a number");
  }
  if (request.speed && !(*request.speed > 0)) return wrong("speed has to be above 0");
  context_.replay(request);
  return std::nullopt;
}

}  // namespace hm
