#pragma once
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/map/map_file.hpp"

namespace hm {

/// A page holds 4 x 4 x 4 blocks and is one row of the file.
inline constexpr int kMapPageBlocks = 64;

/// Key of a page: its blocks have the keys 4 * key + (0..3). Sorted by z, then y, then x.
struct MapPageKey {
  std::int32_t z = 0, y = 0, x = 0;
  auto operator<=>(const MapPageKey&) const = default;
};
MapPageKey page_of(const MapBlockKey& key);
/// Index of a block in its page, 0..63, x fastest; and the inverse.
int block_in_page(const MapBlockKey& key);
MapBlockKey block_key(const MapPageKey& page, int block);
std::string to_string(const MapPageKey& page);

/// Directory entry of a page: its row, one bit per stored block, one per block with colours, and the checksum
/// of its contents.
struct MapPageEntry {
  std::int64_t row = 0;
  std::uint64_t blocks = 0;
  std::uint64_t colors = 0;
  std::uint32_t checksum = 0;
};

/// Blocks of a page by block_in_page(); nullptr: missing.
struct MapPageBlocks {
  std::array<const std::uint32_t*, kMapPageBlocks> voxels{};
  std::array<const std::uint32_t*, kMapPageBlocks> colors{};
};

/// Encodes pages to bytes and back: 16-bit differences from voxel to voxel, split into byte planes, zstd
/// level 1 with its checksum. The bytes repeat key and masks, so that a misplaced page is detected.
class MapPageCodec {
 public:
  MapPageCodec();
  ~MapPageCodec();
  MapPageCodec(MapPageCodec&&) noexcept;
  MapPageCodec& operator=(MapPageCodec&&) noexcept;

  /// Encodes a page; the bytes are valid until the next call. Sets everything but the row in `entry`.
  std::span<const std::byte> encode(const MapPageKey& key, const MapPageBlocks& blocks, MapPageEntry& entry);
  /// Decodes a page; the blocks are valid until the next decode(). Error (without location) when the bytes
  /// are damaged or not the page that `entry` describes.
  Result<MapPageBlocks> decode(std::span<const std::byte> bytes, const MapPageKey& key,
                               const MapPageEntry& entry);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
