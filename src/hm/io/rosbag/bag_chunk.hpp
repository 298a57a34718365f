#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hm::detail {

/// What came out of a compressed chunk: everything up to the point where it is cut off or damaged.
struct DecompressedChunk {
  std::vector<std::uint8_t> bytes;
  std::string problem;  ///< empty when it was whole
};

/// Decompresses the data of a chunk that should give `size` bytes: "none", "bz2", or "lz4" (LZ4 frames).
DecompressedChunk decompress_chunk(std::string_view compression, std::span<const std::uint8_t> data,
                                   std::uint32_t size);

}  // namespace hm::detail
