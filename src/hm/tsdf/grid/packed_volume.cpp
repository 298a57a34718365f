#include "hm/tsdf/grid/packed_volume.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace hm {
namespace {

constexpr std::size_t kMaskWords = kVolumeVoxels / 32;
constexpr std::uint32_t kColorPlane = 1u << 31u;
constexpr std::uint32_t kCountMask = 0x7fffu;

/// Writes mask and words (and one word more); returns the number of words that are not zero.
std::uint32_t pack_plane(const std::uint32_t* plane, std::uint32_t* to) {
  std::uint32_t* next = to + kMaskWords;
  for (std::size_t group = 0; group < kMaskWords; ++group, plane += 32) {
    std::uint32_t mask = 0;
    for (unsigned half = 0; half < 32; half += 16) {
      std::uint32_t any = 0;
      for (unsigned i = 0; i < 16; ++i) any |= plane[half + i];
      if (any == 0) continue;
      for (unsigned i = half; i < half + 16; ++i) {
        const std::uint32_t kept = plane[i] != 0 ? 1 : 0;
        *next = plane[i];
        next += kept;
        mask |= kept << i;
      }
    }
    to[group] = mask;
  }
  return static_cast<std::uint32_t>(next - to - kMaskWords);
}

/// Reads mask and words (and one word more).
void unpack_plane(const std::uint32_t* from, std::uint32_t* plane) {
  const std::uint32_t* next = from + kMaskWords;
  for (std::size_t group = 0; group < kMaskWords; ++group, plane += 32) {
    const std::uint32_t mask = from[group];
    if (mask == 0) {
      std::memset(plane, 0, 32 * sizeof *plane);
    } else if (mask == ~std::uint32_t{0}) {
      std::memcpy(plane, next, 32 * sizeof *plane);
      next += 32;
    } else {
      for (unsigned i = 0; i < 32; ++i) {
        const std::uint32_t kept = mask >> i & 1u;
        plane[i] = *next & (0u - kept);
        next += kept;
      }
    }
  }
}

std::size_t word_count(std::uint32_t header) {
  const std::size_t voxels = header & kCountMask, colors = header >> 16u & kCountMask;
  return 1 + kMaskWords + voxels + ((header & kColorPlane) != 0 ? kMaskWords + colors : 0) + 1;
}

}  // namespace

PackedVolume PackedVolume::pack(const TsdfVoxel* voxels, const ColorVoxel* colors) {
  static_assert(sizeof(TsdfVoxel) == 4 && sizeof(ColorVoxel) == 4);
  std::uint32_t scratch[2 * (kMaskWords + kVolumeVoxels) + 2];
  scratch[0] = pack_plane(&voxels->bits, scratch + 1);
  if (colors)
    scratch[0] |= kColorPlane | pack_plane(&colors->bits, scratch + 1 + kMaskWords + scratch[0]) << 16u;
  const std::size_t count = word_count(scratch[0]);
  scratch[count - 1] = 0;
  PackedVolume packed;
  packed.words_ = std::make_unique_for_overwrite<std::uint32_t[]>(count);
  std::copy_n(scratch, count, packed.words_.get());
  return packed;
}

PackedVolume PackedVolume::copy() const {
  PackedVolume other;
  if (empty()) return other;
  const std::size_t count = word_count(words_[0]);
  other.words_ = std::make_unique_for_overwrite<std::uint32_t[]>(count);
  std::copy_n(words_.get(), count, other.words_.get());
  return other;
}

bool PackedVolume::has_colors() const { return words_ && (words_[0] & kColorPlane) != 0; }

void PackedVolume::unpack(TsdfVoxel* voxels, ColorVoxel* colors) const {
  unpack_plane(words_.get() + 1, &voxels->bits);
  if (has_colors()) unpack_plane(words_.get() + 1 + kMaskWords + (words_[0] & kCountMask), &colors->bits);
}

bool PackedVolume::holds_interior() const {
  if (empty()) return false;
  const std::uint32_t* first = words_.get() + 1 + kMaskWords;
  return std::any_of(first, first + (words_[0] & kCountMask), [](std::uint32_t bits) {
    return TsdfVoxel{bits}.weight() > 0 && TsdfVoxel{bits}.sdf() <= 0;
  });
}

std::size_t PackedVolume::bytes() const { return words_ ? word_count(words_[0]) * sizeof(std::uint32_t) : 0; }

}  // namespace hm
