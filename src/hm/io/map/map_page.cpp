#include "hm/io/map/map_page.hpp"

#include <fmt/format.h>
#include <zstd.h>
#include <zstd_errors.h>

#include <bit>
#include <cstring>
#include <new>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr int kCompressionLevel = 1;
constexpr std::size_t kChecksumBytes = 4;  ///< at the end of a zstd frame: low half of XXH64 of the contents
constexpr std::size_t kMaxWords = 2 * kMapPageBlocks * kMapBlockVoxels;

/// Start of a page.
struct Prefix {
  std::int32_t x, y, z, reserved;
  std::uint64_t blocks, colors;
};
static_assert(sizeof(Prefix) == 32);

std::size_t word_count(std::uint64_t blocks, std::uint64_t colors) {
  return static_cast<std::size_t>(std::popcount(blocks) + std::popcount(colors)) * kMapBlockVoxels;
}

std::uint8_t byte_of(std::uint32_t value, unsigned shift) {
  return static_cast<std::uint8_t>(value >> shift);
}

/// Encodes the differences of both 16-bit halves to the previous word as four byte planes (lowest first).
void split_planes(std::span<const std::uint32_t> words, std::uint8_t* planes) {
  const std::size_t n = words.size();
  std::uint32_t before = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t word = words[i];
    const std::uint32_t low = (word & 0xffffu) - (before & 0xffffu);
    const std::uint32_t high = (word >> 16u) - (before >> 16u);
    planes[i] = byte_of(low, 0);
    planes[n + i] = byte_of(low, 8);
    planes[2 * n + i] = byte_of(high, 0);
    planes[3 * n + i] = byte_of(high, 8);
    before = word;
  }
}

void join_planes(const std::uint8_t* planes, std::span<std::uint32_t> words) {
  const std::size_t n = words.size();
  std::uint32_t low = 0, high = 0;
  for (std::size_t i = 0; i < n; ++i) {
    low += planes[i] | static_cast<std::uint32_t>(planes[n + i]) << 8u;
    high += planes[2 * n + i] | static_cast<std::uint32_t>(planes[3 * n + i]) << 8u;
    words[i] = (low & 0xffffu) | high << 16u;
  }
}

struct CompressorDeleter {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
};
struct DecompressorDeleter {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

/// zstd allocates its tables on first use: that can fail as any allocation can.
void check_result(std::size_t size) {
  if (ZSTD_getErrorCode(size) == ZSTD_error_memory_allocation) throw std::bad_alloc();
  HM_CHECK(!ZSTD_isError(size), "zstd: {}", ZSTD_getErrorName(size));
}

tl::unexpected<Error> damaged(std::string why) { return fail(ErrorCode::kCorrupted, "", "{}", why); }

}  // namespace

MapPageKey page_of(const MapBlockKey& key) { return {key[2] >> 2, key[1] >> 2, key[0] >> 2}; }

int block_in_page(const MapBlockKey& key) { return ((key[2] & 3) * 4 + (key[1] & 3)) * 4 + (key[0] & 3); }

MapBlockKey block_key(const MapPageKey& page, int block) {
  return {page.x * 4 + (block & 3), page.y * 4 + (block >> 2 & 3), page.z * 4 + (block >> 4)};
}

std::string to_string(const MapPageKey& page) {
  const MapBlockKey first = block_key(page, 0), last = block_key(page, kMapPageBlocks - 1);
  return fmt::format("page of blocks ({}, {}, {}) to ({}, {}, {})", first[0], first[1], first[2], last[0],
                     last[1], last[2]);
}

struct MapPageCodec::Impl {
  std::unique_ptr<ZSTD_CCtx, CompressorDeleter> compressor{ZSTD_createCCtx()};
  std::unique_ptr<ZSTD_DCtx, DecompressorDeleter> decompressor{ZSTD_createDCtx()};
  std::vector<std::uint32_t> words;    ///< of the page being encoded
  std::vector<std::uint32_t> decoded;  ///< of the decoded page; decode() returns pointers into it
  std::vector<std::uint8_t> plain;
  std::vector<std::byte> packed;
};

MapPageCodec::MapPageCodec() : impl_(std::make_unique<Impl>()) {
  if (!impl_->compressor || !impl_->decompressor) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(impl_->compressor.get(), ZSTD_c_compressionLevel, kCompressionLevel);
  ZSTD_CCtx_setParameter(impl_->compressor.get(), ZSTD_c_checksumFlag, 1);
  impl_->words.reserve(kMaxWords);
  impl_->packed.resize(ZSTD_compressBound(sizeof(Prefix) + kMaxWords * 4));
}
MapPageCodec::~MapPageCodec() = default;
MapPageCodec::MapPageCodec(MapPageCodec&&) noexcept = default;
MapPageCodec& MapPageCodec::operator=(MapPageCodec&&) noexcept = default;

std::span<const std::byte> MapPageCodec::encode(const MapPageKey& key, const MapPageBlocks& blocks,
                                                MapPageEntry& entry) {
  entry.blocks = entry.colors = 0;
  impl_->words.clear();
  const auto gather = [&](const std::array<const std::uint32_t*, kMapPageBlocks>& planes,
                          std::uint64_t& mask) {
    for (std::size_t i = 0; i < planes.size(); ++i) {
      if (!planes[i]) continue;
      mask |= std::uint64_t{1} << i;
      impl_->words.insert(impl_->words.end(), planes[i], planes[i] + kMapBlockVoxels);
    }
  };
  gather(blocks.voxels, entry.blocks);
  gather(blocks.colors, entry.colors);
  HM_CHECK((entry.colors & ~entry.blocks) == 0, "a block with colours but no voxels");

  const Prefix prefix{key.x, key.y, key.z, 0, entry.blocks, entry.colors};
  impl_->plain.resize(sizeof prefix + impl_->words.size() * 4);
  std::memcpy(impl_->plain.data(), &prefix, sizeof prefix);
  split_planes(impl_->words, impl_->plain.data() + sizeof prefix);
  const std::size_t size = ZSTD_compress2(impl_->compressor.get(), impl_->packed.data(), impl_->packed.size(),
                                          impl_->plain.data(), impl_->plain.size());
  check_result(size);
  std::memcpy(&entry.checksum, impl_->packed.data() + size - kChecksumBytes, kChecksumBytes);
  return {impl_->packed.data(), size};
}

Result<MapPageBlocks> MapPageCodec::decode(std::span<const std::byte> bytes, const MapPageKey& key,
                                           const MapPageEntry& entry) {
  const std::size_t words = word_count(entry.blocks, entry.colors);
  const std::size_t size = sizeof(Prefix) + words * 4;
  if (bytes.size() <= kChecksumBytes || ZSTD_getFrameContentSize(bytes.data(), bytes.size()) != size)
    return damaged("its size is not what the directory says");
  std::uint32_t checksum = 0;
  std::memcpy(&checksum, bytes.data() + bytes.size() - kChecksumBytes, kChecksumBytes);
  if (checksum != entry.checksum) return damaged("its checksum is not the directory's");

  impl_->plain.resize(size);
  const std::size_t got =
      ZSTD_decompressDCtx(impl_->decompressor.get(), impl_->plain.data(), size, bytes.data(), bytes.size());
  if (ZSTD_getErrorCode(got) == ZSTD_error_memory_allocation) throw std::bad_alloc();
  if (ZSTD_isError(got)) return damaged(ZSTD_getErrorName(got));
  Prefix prefix{};
  std::memcpy(&prefix, impl_->plain.data(), sizeof prefix);
  if (got != size || prefix.x != key.x || prefix.y != key.y || prefix.z != key.z ||
      prefix.blocks != entry.blocks || prefix.colors != entry.colors)
    return damaged("it is another page than the directory says");

  impl_->decoded.resize(words);
  join_planes(impl_->plain.data() + sizeof prefix, impl_->decoded);
  MapPageBlocks blocks;
  const std::uint32_t* next = impl_->decoded.data();
  const auto scatter = [&](std::array<const std::uint32_t*, kMapPageBlocks>& planes, std::uint64_t mask) {
    for (std::size_t i = 0; i < planes.size(); ++i) {
      if ((mask >> i & 1u) == 0) continue;
      planes[i] = next;
      next += kMapBlockVoxels;
    }
  };
  scatter(blocks.voxels, entry.blocks);
  scatter(blocks.colors, entry.colors);
  return blocks;
}

}  // namespace hm
