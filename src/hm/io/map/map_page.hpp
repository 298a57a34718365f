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

/// Which page: its blocks have the keys 4 * key + (0..3). Ordered by z, then y, then x.
struct MapPageKey {
  std::int32_t z = 0, y = 0, x = 0;
  auto operator<=>(const MapPageKey&) const = default;
};
MapPageKey page_of(const MapBlockKey& key);
/// The place of a block in its page, 0..63, x fastest; and back.
int block_in_page(const MapBlockKey& key);
MapBlockKey block_key(const MapPageKey& page, int block);
std::string to_string(const MapPageKey& page);

/// What the directory knows of a page: its row, one bit per block that is there, one per block with colours,
/// and the checksum of its contents.
struct MapPageEntry {
  std::int64_t row = 0;
  std::uint64_t blocks = 0;
  std::uint64_t colors = 0;
  std::uint32_t checksum = 0;
};

/// The blocks of a page, by block_in_page(); nullptr: not there.
struct MapPageBlocks {
  std::array<const std::uint32_t*, kMapPageBlocks> voxels{};
  std::array<const std::uint32_t*, kMapPageBlocks> colors{};
};

/// Packs pages into bytes and back: 16-bit differences from voxel to voxel, split into byte planes, zstd
/// level 1 with its checksum. The bytes repeat key and masks, so that a page in the wrong place is noticed.
class MapPageCodec {
 public:
  MapPageCodec();
  ~MapPageCodec();
  MapPageCodec(MapPageCodec&&) noexcept;
  MapPageCodec& operator=(MapPageCodec&&) noexcept;

  /// The packed page, valid until the next call; sets everything but the row in `entry`.
  std::span<const std::byte> encode(const MapPageKey& key, const MapPageBlocks& blocks, MapPageEntry& entry);
  /// The blocks of a packed page, valid until the next decode(). An Error (without a place) when the bytes
  /// are damaged or are not the page that `entry` describes.
  Result<MapPageBlocks> decode(std::span<const std::byte> bytes, const MapPageKey& key,
                               const MapPageEntry& entry);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
