#include "hm/io/rosbag/bag_chunk.hpp"

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>

#include <algorithm>

namespace hm::detail {
namespace {

constexpr std::size_t kStepBytes = std::size_t{1} << 20;

/// Calls `produce(room, count)` until it is done, with room for another megabyte each time, up to `size`
/// bytes in total, so that a damaged size costs no memory.
template <class Produce>
void produce_all(std::vector<std::uint8_t>& bytes, std::size_t size, const Produce& produce) {
  bool more = true;
  while (more && bytes.size() < size) {
    const std::size_t before = bytes.size();
    bytes.resize(std::min(size, before + kStepBytes));
    std::size_t count = bytes.size() - before;
    more = produce(bytes.data() + before, count);
    bytes.resize(before + count);
  }
}

DecompressedChunk decompress_bz2(std::span<const std::uint8_t> data, std::uint32_t size) {
  DecompressedChunk chunk;
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) {
    chunk.problem = "bzip2 cannot be started";
    return chunk;
  }
  std::vector<char> input(data.begin(), data.end());  // the library wants it writable
  stream.next_in = input.data();
  stream.avail_in = static_cast<unsigned>(input.size());
  produce_all(chunk.bytes, size, [&](std::uint8_t* out, std::size_t& count) {
    stream.next_out = reinterpret_cast<char*>(out);
    stream.avail_out = static_cast<unsigned>(count);
    const int status = BZ2_bzDecompress(&stream);
    count -= stream.avail_out;
    if (status != BZ_OK && status != BZ_STREAM_END) chunk.problem = "its bzip2 data are damaged";
    return status == BZ_OK && (stream.avail_in > 0 || stream.avail_out == 0);
  });
  BZ2_bzDecompressEnd(&stream);
  return chunk;
}

DecompressedChunk decompress_lz4(std::span<const std::uint8_t> data, std::uint32_t size) {
  DecompressedChunk chunk;
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) {
    chunk.problem = "lz4 cannot be started";
    return chunk;
  }
  produce_all(chunk.bytes, size, [&](std::uint8_t* out, std::size_t& count) {
    std::size_t produced = count, consumed = data.size();
    const std::size_t status = LZ4F_decompress(context, out, &produced, data.data(), &consumed, nullptr);
    if (LZ4F_isError(status)) {
      chunk.problem = fmt::format("its lz4 data are damaged ({})", LZ4F_getErrorName(status));
      count = 0;
      return false;
    }
    data = data.subspan(consumed);
    const bool output_full = produced == count;
    count = produced;
    return status != 0 && (!data.empty() || output_full);
  });
  LZ4F_freeDecompressionContext(context);
  return chunk;
}

}  // namespace

DecompressedChunk decompress_chunk(std::string_view compression, std::span<const std::uint8_t> data,
                                   std::uint32_t size) {
  DecompressedChunk chunk;
  if (compression == "none")
    chunk.bytes.assign(data.begin(), data.end());
  else if (compression == "bz2")
    chunk = decompress_bz2(data, size);
  else if (compression == "lz4")
    chunk = decompress_lz4(data, size);
  else
    chunk.problem = fmt::format("its compression `{}` is unknown", compression);
  if (chunk.problem.empty() && chunk.bytes.size() != size)
    chunk.problem = fmt::format("it gives {} bytes instead of {}", chunk.bytes.size(), size);
  return chunk;
}

}  // namespace hm::detail
