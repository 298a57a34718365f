#pragma once
#include <compare>
#include <cstdint>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Side of a volume, a cube of 8 x 8 x 8 voxels, x fastest, then y, then z (dissertation 4.2.5, 4.2.7).
inline constexpr int kVolumeSide = 8;
inline constexpr int kVolumeVoxels = kVolumeSide * kVolumeSide * kVolumeSide;

/// Key of a volume: its voxels have the world indices 8 * key + (0..7) on each axis.
struct VolumeKey {
  std::int32_t x = 0, y = 0, z = 0;
  auto operator<=>(const VolumeKey&) const = default;
};

/// Distance and weight of a voxel in 32 bits: low half the signed distance to the surface in units of
/// sdf_unit_m (positive outside, i.e. in front), high half the accumulated weight in 1/256 of an observation
/// at the narrowest truncation. Weight 0: unknown (the distance is then 0 too).
struct TsdfVoxel {
  std::uint32_t bits = 0;

  [[nodiscard]] std::int16_t sdf() const { return static_cast<std::int16_t>(bits & 0xffffu); }
  [[nodiscard]] std::uint16_t weight() const { return static_cast<std::uint16_t>(bits >> 16u); }
  static TsdfVoxel make(std::int16_t sdf, std::uint16_t weight) {
    return {static_cast<std::uint32_t>(static_cast<std::uint16_t>(sdf)) | static_cast<std::uint32_t>(weight)
                                                                              << 16u};
  }
  bool operator==(const TsdfVoxel&) const = default;
};
inline constexpr int kWeightOne = 256;

/// Colour of a voxel in 32 bits: red in the lowest byte, green, blue, then the colour's own weight in
/// observations (0: no colour).
struct ColorVoxel {
  std::uint32_t bits = 0;
  [[nodiscard]] std::uint8_t r() const { return static_cast<std::uint8_t>(bits); }
  [[nodiscard]] std::uint8_t g() const { return static_cast<std::uint8_t>(bits >> 8u); }
  [[nodiscard]] std::uint8_t b() const { return static_cast<std::uint8_t>(bits >> 16u); }
  [[nodiscard]] std::uint8_t weight() const { return static_cast<std::uint8_t>(bits >> 24u); }
  static ColorVoxel make(std::uint8_t r, std::uint8_t g, std::uint8_t b, std::uint8_t weight) {
    return {static_cast<std::uint32_t>(r) | static_cast<std::uint32_t>(g) << 8u |
            static_cast<std::uint32_t>(b) << 16u | static_cast<std::uint32_t>(weight) << 24u};
  }
  bool operator==(const ColorVoxel&) const = default;
};

/// Voxels of one volume in memory. Both arrays hold kVolumeVoxels entries at 64-byte alignment and belong to
/// the VolumeGrid's pools.
struct Volume {
  VolumeKey key;
  TsdfVoxel* voxels = nullptr;
  ColorVoxel* colors = nullptr;  ///< nullptr while no voxel near the surface has a colour
};

/// Index of a voxel in its volume.
constexpr int voxel_offset(int x, int y, int z) { return (z * kVolumeSide + y) * kVolumeSide + x; }

/// Outermost layers of the volume that a voxel belongs to: bit 0..5 = low x, high x, low y, high y, low z,
/// high z.
constexpr std::uint8_t border_layers_of(int x, int y, int z) {
  const auto layers = [](int at, int bit) {
    return at == 0 ? 1 << bit : at == kVolumeSide - 1 ? 2 << bit : 0;
  };
  return static_cast<std::uint8_t>(layers(x, 0) | layers(y, 2) | layers(z, 4));
}

}  // namespace hm
