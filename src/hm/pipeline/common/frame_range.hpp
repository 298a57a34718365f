#pragma once
#include <algorithm>
#include <cstddef>

#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/mapping_params.hpp"

namespace hm {

/// The frames of a recording that a run uses: begin, begin + stride ... below end.
struct FrameRange {
  std::size_t begin = 0, end = 0, stride = 1;
  [[nodiscard]] std::size_t count() const { return end > begin ? (end - begin + stride - 1) / stride : 0; }
};

/// Frames that begin_frame, frame_stride and frame_limit choose of so many.
inline FrameRange frame_range(const ReconstructionParams& params, std::size_t frame_count) {
  FrameRange range{static_cast<std::size_t>(params.begin_frame), frame_count,
                   static_cast<std::size_t>(params.frame_stride)};
  if (params.frame_limit > 0)
    range.end =
        std::min(range.end, range.begin + static_cast<std::size_t>(params.frame_limit) * range.stride);
  return range;
}

/// A run on so many threads decodes with as many.
inline PrefetchOptions prefetch_options(const ReconstructionParams& params, int threads) {
  return {.ahead = static_cast<std::size_t>(params.prefetch_frames), .readers = threads};
}

}  // namespace hm
