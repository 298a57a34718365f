#include "hm/io/rgbd/frame_archive.hpp"

#include <zstd.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "hm/core/check.hpp"

namespace hm {
namespace {

/// Fastest zstd level: most of the compression comes from encoding differences of neighbours.
constexpr int kArchiveLevel = 1;

using Bytes = std::vector<std::uint8_t>;

Bytes compress(const Bytes& plain) {
  Bytes packed(ZSTD_compressBound(plain.size()));
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), kArchiveLevel);
  HM_CHECK(!ZSTD_isError(size), "zstd: {}", ZSTD_getErrorName(size));
  return {packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size)};
}

Bytes decompress(const Bytes& packed, std::size_t plain_size) {
  Bytes plain(plain_size);
  const std::size_t size = ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size());
  HM_CHECK(size == plain_size, "{} bytes, not {}", size, plain_size);
  return plain;
}

/// Packs differences to the left pixel: first all low bytes, then all high bytes, signs in the lowest bit.
Bytes pack_depth(const Image<std::uint16_t>& depth) {
  Bytes plain(2 * depth.size());
  std::size_t at = 0;
  for (int y = 0; y < depth.height(); ++y) {
    std::uint16_t left = 0;
    for (const std::uint16_t value : depth.row(y)) {
      const auto difference = static_cast<std::int16_t>(value - left);
      const auto folded = static_cast<std::uint16_t>(difference < 0 ? ~(difference * 2) : difference * 2);
      plain[at] = static_cast<std::uint8_t>(folded);
      plain[at + depth.size()] = static_cast<std::uint8_t>(folded >> 8u);
      left = value;
      ++at;
    }
  }
  return compress(plain);
}

Image<std::uint16_t> unpack_depth(const Bytes& packed, int width, int height) {
  Image<std::uint16_t> depth(width, height);
  const Bytes plain = decompress(packed, 2 * depth.size());
  std::size_t at = 0;
  for (int y = 0; y < height; ++y) {
    std::uint16_t left = 0;
    for (std::uint16_t& value : depth.row(y)) {
      const int folded = plain[at] | plain[at + depth.size()] << 8;
      const int difference = (folded & 1) != 0 ? ~(folded >> 1) : folded >> 1;
      value = left = static_cast<std::uint16_t>(left + difference);
      ++at;
    }
  }
  return depth;
}

/// Packs differences to the left pixel by channel; for red and blue relative to green's difference.
Bytes pack_color(const Image<Rgb8>& color) {
  Bytes plain(3 * color.size());
  std::size_t at = 0;
  for (int y = 0; y < color.height(); ++y) {
    Rgb8 left;
    for (const Rgb8& value : color.row(y)) {
      const int green = value.g - left.g;
      plain[at] = static_cast<std::uint8_t>(green);
      plain[at + color.size()] = static_cast<std::uint8_t>(value.r - left.r - green);
      plain[at + 2 * color.size()] = static_cast<std::uint8_t>(value.b - left.b - green);
      left = value;
      ++at;
    }
  }
  return compress(plain);
}

Image<Rgb8> unpack_color(const Bytes& packed, int width, int height) {
  Image<Rgb8> color(width, height);
  const Bytes plain = decompress(packed, 3 * color.size());
  std::size_t at = 0;
  for (int y = 0; y < height; ++y) {
    Rgb8 left;
    for (Rgb8& value : color.row(y)) {
      const int green = plain[at];
      left.g = static_cast<std::uint8_t>(left.g + green);
      left.r = static_cast<std::uint8_t>(left.r + plain[at + color.size()] + green);
      left.b = static_cast<std::uint8_t>(left.b + plain[at + 2 * color.size()] + green);
      value = left;
      ++at;
    }
  }
  return color;
}

/// Frame without images, and its packed images.
struct KeptFrame {
  RgbdFrame frame;
  int depth_width = 0, depth_height = 0, color_width = 0, color_height = 0;
  Bytes depth, color;
  [[nodiscard]] std::size_t bytes() const { return sizeof(KeptFrame) + depth.size() + color.size(); }
};

KeptFrame pack_frame(const RgbdFrame& frame) {
  KeptFrame kept;
  kept.frame.index = frame.index;
  kept.frame.stamp = frame.stamp;
  kept.frame.color_stamp = frame.color_stamp;
  kept.frame.depth.unit_m = frame.depth.unit_m;
  kept.frame.T_world_camera = frame.T_world_camera;
  kept.depth_width = frame.depth.width(), kept.depth_height = frame.depth.height();
  kept.color_width = frame.color.width(), kept.color_height = frame.color.height();
  kept.depth = pack_depth(frame.depth.units);
  kept.color = pack_color(frame.color);
  return kept;
}

RgbdFrame with_depth(const KeptFrame& kept) {
  RgbdFrame frame = kept.frame;
  frame.depth.units = unpack_depth(kept.depth, kept.depth_width, kept.depth_height);
  return frame;
}

}  // namespace

struct FrameArchive::Impl {
  PinholeCamera camera;
  std::size_t max_bytes = 0;
  mutable std::mutex mutex;  ///< of what follows
  std::map<std::size_t, std::shared_ptr<const KeptFrame>> frames;
  std::size_t bytes = 0;

  Result<std::shared_ptr<const KeptFrame>> find(std::size_t index) const {
    const std::scoped_lock lock(mutex);
    const auto found = frames.find(index);
    if (found == frames.end())
      return fail(ErrorCode::kNotFound, fmt::format("frame {}", index), "it was not kept");
    return found->second;
  }
};

FrameArchive::FrameArchive(const PinholeCamera& camera, std::size_t max_bytes)
    : impl_(std::make_unique<Impl>()) {
  HM_CHECK(camera.distortion.is_zero(), "the camera has lens distortion");
  impl_->camera = camera;
  impl_->max_bytes = max_bytes;
}
FrameArchive::~FrameArchive() = default;

Result<void> FrameArchive::keep(const RgbdFrame& frame) {
  auto kept = std::make_shared<const KeptFrame>(pack_frame(frame));
  const std::scoped_lock lock(impl_->mutex);
  const auto old = impl_->frames.find(frame.index);
  const std::size_t freed = old == impl_->frames.end() ? 0 : old->second->bytes();
  const std::size_t bytes = impl_->bytes - freed + kept->bytes();
  if (impl_->max_bytes != 0 && bytes > impl_->max_bytes)
    return fail(ErrorCode::kOutOfMemory, fmt::format("frame {}", frame.index),
                "keeping it takes {} bytes, more than the {} that {} kept frames leave of {}", kept->bytes(),
                impl_->max_bytes - std::min(impl_->max_bytes, impl_->bytes - freed), impl_->frames.size(),
                impl_->max_bytes);
  impl_->bytes = bytes;
  impl_->frames[frame.index] = std::move(kept);
  return {};
}

PinholeCamera FrameArchive::camera() const { return impl_->camera; }

Result<RgbdFrame> FrameArchive::read(std::size_t index) const {
  const auto kept = impl_->find(index);
  if (!kept) return forward_error(kept);
  RgbdFrame frame = with_depth(**kept);
  frame.color = unpack_color((*kept)->color, (*kept)->color_width, (*kept)->color_height);
  return frame;
}

Result<RgbdFrame> FrameArchive::read_depth(std::size_t index) const {
  const auto kept = impl_->find(index);
  if (!kept) return forward_error(kept);
  return with_depth(**kept);
}

std::size_t FrameArchive::frame_count() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->frames.size();
}

std::size_t FrameArchive::bytes() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->bytes;
}

}  // namespace hm
