#include "hm/station/live_frames.hpp"

#include <array>
#include <cstring>
#include <type_traits>
#include <utility>

#include "hm/core/bytes/little_endian.hpp"
#include "hm/core/check.hpp"
#include "hm/io/bytes/byte_cursor.hpp"

namespace hm {
namespace {

constexpr const char* kWhere = "frame of the live view";

/// Appends the fields of a frame to a payload.
class PayloadWriter {
 public:
  template <class T>
  void number(const T& value) {
    std::array<std::uint8_t, sizeof(T)> bytes{};
    store_little_endian(bytes.data(), value);
    for (const auto byte : bytes) bytes_.push_back(static_cast<std::byte>(byte));
  }
  template <class E>
  void choice(const E& value) {
    number(value);
  }
  void below(std::uint8_t value, std::uint8_t) { number(value); }
  void flag(bool value) { number(static_cast<std::uint8_t>(value ? 1 : 0)); }
  void zeros(std::size_t count) { bytes_.resize(bytes_.size() + count); }
  template <class T>
  void size(const T& list) {
    number(static_cast<std::uint32_t>(list.size()));
  }
  template <class T>
  void check_size(const T& list, std::size_t size) {
    HM_CHECK(list.size() == size, "{} cells instead of {}", list.size(), size);
  }
  template <class T>
  void rest_size(const T&) {}
  template <class T>
  void data(const T& list) {
    if constexpr (std::is_same_v<typename T::value_type, Eigen::Vector3f>) {
      for (const auto& element : list) vector(element);
    } else {
      const auto* begin = reinterpret_cast<const std::byte*>(list.data());
      bytes_.insert(bytes_.end(), begin, begin + list.size());
    }
  }
  template <class V>
  void vector(const V& values) {
    for (const auto value : values) number(value);
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

/// The inverse: fills the fields of a frame, in the same order.
class PayloadReader {
 public:
  explicit PayloadReader(std::span<const std::byte> payload)
      : cursor_({reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size()}) {}
  template <class T>
  void number(T& value) {
    const auto bytes = cursor_.take(sizeof(T));
    if (cursor_.ok()) load_little_endian(bytes.data(), value);
  }
  template <class E>
  void choice(E& value) {
    std::uint8_t code = 0;
    number(code);
    valid_ = valid_ && code < static_cast<std::uint8_t>(E::kEnd);
    if (valid_) value = static_cast<E>(code);
  }
  void below(std::uint8_t& value, std::uint8_t limit) {
    number(value);
    valid_ = valid_ && value < limit;
  }
  void flag(bool& value) {
    std::uint8_t code = 0;
    number(code);
    valid_ = valid_ && code <= 1;
    value = code == 1;
  }
  void zeros(std::size_t count) {
    for (const auto byte : cursor_.take(count)) valid_ = valid_ && byte == 0;
  }
  template <class T>
  void size(T& list) {
    std::uint32_t count = 0;
    number(count);
    check_size(list, count);
  }
  /// Nothing is allocated beyond what the payload can fill.
  template <class T>
  void check_size(T& list, std::size_t count) {
    constexpr std::size_t kElement = std::is_same_v<typename T::value_type, Eigen::Vector3f> ? 12 : 1;
    if (cursor_.ok() && count <= cursor_.remaining() / kElement)
      list.resize(count);
    else
      (void)cursor_.take(cursor_.remaining() + 1);
  }
  template <class T>
  void rest_size(T& list) {
    list.resize(cursor_.remaining());
  }
  template <class T>
  void data(T& list) {
    if constexpr (std::is_same_v<typename T::value_type, Eigen::Vector3f>) {
      for (auto& element : list) vector(element);
    } else {
      const auto bytes = cursor_.take(list.size());
      if (!bytes.empty()) std::memcpy(list.data(), bytes.data(), bytes.size());
    }
  }
  template <class V>
  void vector(V& values) {
    for (auto& value : values) number(value);
  }
  [[nodiscard]] Result<void> end() const {
    if (!cursor_.ok()) return fail(ErrorCode::kTruncated, kWhere, "the payload ends too early");
    if (!valid_) return fail(ErrorCode::kCorrupted, kWhere, "a field has a value that it cannot have");
    if (cursor_.remaining() != 0)
      return fail(ErrorCode::kCorrupted, kWhere, "{} bytes are left over", cursor_.remaining());
    return {};
  }

 private:
  detail::ByteCursor cursor_;
  bool valid_ = true;
};

// The fields of each frame, in the order of the wire; `frame` is const for the writer.
void visit_key(auto& a, auto& key) {
  a.number(key.x);
  a.number(key.y);
  a.number(key.z);
}
template <class Frame, class Given>
concept Is = std::is_same_v<std::remove_const_t<Given>, Frame>;

template <class F>
void visit(auto& a, F& frame) {
  if constexpr (Is<MeshPageFrame, F>) {
    visit_key(a, frame.key);
    a.number(frame.version);
    a.below(frame.level, std::uint8_t{3});
    a.flag(frame.has_colors);
    a.zeros(2);
    a.number(frame.vertices);
    a.number(frame.indices);
    // Both sizes stand before the data of either.
    a.size(frame.vertex_bytes);
    a.size(frame.index_bytes);
    a.vector(frame.origin_m);
    a.number(frame.quantum_m);
    a.number(frame.age_s);
    a.data(frame.vertex_bytes);
    a.data(frame.index_bytes);
  } else if constexpr (Is<PageGoneFrame, F>) {
    visit_key(a, frame.key);
    a.number(frame.version);
  } else if constexpr (Is<PoseFrame, F>) {
    a.choice(frame.which);
    a.choice(frame.state);
    a.zeros(2);
    a.number(frame.deviation_m);
    a.vector(frame.position_m);
    a.vector(frame.orientation.coeffs());
    a.number(frame.half_width_rad);
    a.number(frame.half_height_rad);
  } else if constexpr (Is<PathFrame, F>) {
    a.choice(frame.which);
    a.zeros(3);
    a.number(frame.first);
    a.number(frame.total);
    a.size(frame.points_m);
    a.data(frame.points_m);
  } else if constexpr (Is<ScanFrame, F>) {
    a.choice(frame.which);
    a.zeros(3);
    a.size(frame.points_m);
    a.data(frame.points_m);
  } else if constexpr (Is<PlanFrame, F>) {
    a.choice(frame.state);
    a.zeros(3);
    a.size(frame.reason);
    a.size(frame.points_m);
    a.data(frame.reason);
    a.data(frame.points_m);
  } else if constexpr (Is<GridTileFrame, F>) {
    a.number(frame.x);
    a.number(frame.y);
    a.number(frame.version);
    a.number(frame.cell_m);
    a.number(frame.height_m);
    a.number(frame.side);
    a.zeros(2);
    a.check_size(frame.cells, static_cast<std::size_t>(frame.side) * frame.side);
    a.data(frame.cells);
  } else if constexpr (Is<PictureFrame, F>) {
    a.choice(frame.which);
    a.choice(frame.format);
    a.number(frame.width);
    a.number(frame.height);
    a.zeros(2);
    a.rest_size(frame.file);
    a.data(frame.file);
  } else {
    a.rest_size(frame.text);
    a.data(frame.text);
  }
}

template <class Frame>
Result<LiveFrame> decode(std::span<const std::byte> payload) {
  Frame frame;
  PayloadReader reader(payload);
  visit(reader, frame);
  if (const auto end = reader.end(); !end) return forward_error(end);
  return LiveFrame(std::move(frame));
}

}  // namespace

std::vector<std::byte> to_payload(const LiveFrame& frame) {
  PayloadWriter writer;
  std::visit([&](const auto& kind) { visit(writer, kind); }, frame);
  return writer.take();
}

std::vector<std::byte> live_header(LiveKind kind, std::uint32_t sequence, Time stamp) {
  PayloadWriter writer;
  writer.number(kLiveVersion);
  writer.number(kind);
  writer.number(std::uint16_t{0});
  writer.number(sequence);
  writer.number(stamp.ns);
  return writer.take();
}

Result<LiveFrame> decode_live_payload(LiveKind kind, std::span<const std::byte> payload) {
  switch (kind) {
    case LiveKind::kHello:
    case LiveKind::kTelemetry:
    case LiveKind::kEvent:
    case LiveKind::kStatistics:
      return decode<JsonFrame>(payload);
    case LiveKind::kMeshPage:
      return decode<MeshPageFrame>(payload);
    case LiveKind::kPageGone:
      return decode<PageGoneFrame>(payload);
    case LiveKind::kPose:
      return decode<PoseFrame>(payload);
    case LiveKind::kPath:
      return decode<PathFrame>(payload);
    case LiveKind::kScan:
      return decode<ScanFrame>(payload);
    case LiveKind::kPlan:
      return decode<PlanFrame>(payload);
    case LiveKind::kGridTile:
      return decode<GridTileFrame>(payload);
    case LiveKind::kPicture:
      return decode<PictureFrame>(payload);
  }
  return fail(ErrorCode::kUnsupported, kWhere, "kind {} is not known", static_cast<int>(kind));
}

Result<LiveMessage> decode_live_message(std::span<const std::byte> bytes) {
  if (bytes.size() < kLiveHeaderBytes)
    return fail(ErrorCode::kTruncated, kWhere, "{} bytes only", bytes.size());
  PayloadReader reader(bytes.first(kLiveHeaderBytes));
  std::uint8_t version = 0, kind = 0;
  std::uint16_t flags = 0;
  LiveMessage message;
  reader.number(version);
  reader.number(kind);
  reader.number(flags);
  reader.number(message.sequence);
  reader.number(message.stamp.ns);
  if (version != kLiveVersion)
    return fail(ErrorCode::kUnsupported, kWhere, "version {} instead of {}", version, kLiveVersion);
  if (flags != 0) return fail(ErrorCode::kCorrupted, kWhere, "flags {:#x}", flags);
  message.kind = static_cast<LiveKind>(kind);
  auto frame = decode_live_payload(message.kind, bytes.subspan(kLiveHeaderBytes));
  if (!frame) return forward_error(frame);
  message.frame = std::move(*frame);
  return message;
}

std::vector<std::byte> text_bytes(std::string_view text) {
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

std::string_view bytes_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace hm
