#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>

#include "hm/tsdf/grid/volume.hpp"

namespace hm {

/// Losslessly compressed voxels of a volume, without the zero ones: about 2/5 of the memory for a house. Used
/// for idle volumes and snapshots.
class PackedVolume {
 public:
  PackedVolume() = default;
  /// Packs voxels; `colors` may be nullptr for no colour plane. Both arrays hold kVolumeVoxels entries.
  static PackedVolume pack(const TsdfVoxel* voxels, const ColorVoxel* colors);
  [[nodiscard]] PackedVolume copy() const;

  [[nodiscard]] bool empty() const { return !words_; }
  [[nodiscard]] bool has_colors() const;
  /// Writes all voxels, and all colours if there is a colour plane (else `colors` is unchanged).
  void unpack(TsdfVoxel* voxels, ColorVoxel* colors) const;
  /// True when a known voxel lies on or behind a surface (distance <= 0).
  [[nodiscard]] bool holds_interior() const;
  /// Memory of the contents in bytes.
  [[nodiscard]] std::size_t bytes() const;

 private:
  // Number of voxels (bits 0..15), of colours (16..30), colour plane or not (31); then for each plane a mask
  // of 512 bits and the words that are not zero; then one word that is read but not used.
  std::unique_ptr<std::uint32_t[]> words_;
};

}  // namespace hm
