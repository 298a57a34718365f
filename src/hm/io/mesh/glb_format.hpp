#pragma once
#include <cstdint>

namespace hm::glb {

// Numbers of the glTF 2.0 specification: chapter 4 (GLB) and the schemas of accessor, bufferView and
// primitive.
inline constexpr std::uint32_t kMagic = 0x46546c67;  ///< "glTF"
inline constexpr std::uint32_t kVersion = 2;
inline constexpr std::uint32_t kJsonChunk = 0x4e4f534a;  ///< "JSON"
inline constexpr std::uint32_t kBinChunk = 0x004e4942;   ///< "BIN"
inline constexpr std::int64_t kUnsignedByte = 5121;
inline constexpr std::int64_t kUnsignedShort = 5123;
inline constexpr std::int64_t kUnsignedInt = 5125;
inline constexpr std::int64_t kFloat = 5126;
inline constexpr std::int64_t kArrayBuffer = 34962;
inline constexpr std::int64_t kElementArrayBuffer = 34963;
inline constexpr std::int64_t kPoints = 0;
inline constexpr std::int64_t kTriangles = 4;

}  // namespace hm::glb
