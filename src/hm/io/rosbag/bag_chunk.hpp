#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hm::detail {

/// Contents of a compressed chunk, up to the point where it is truncated or damaged.
struct DecompressedChunk {
  std::vector<std::uint8_t> bytes;
  std::string problem;  ///< empty when complete
};

/// Decompresses a chunk of `size` uncompressed bytes; compression is "none", "bz2", or "lz4" (LZ4 frames).
DecompressedChunk decompress_chunk(std::string_view compression, std::span<const std::uint8_t> data,
                                   std::uint32_t size);

}  // namespace hm::detail
