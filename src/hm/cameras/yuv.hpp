#pragma once
#include <cstddef>
#include <span>

#include "hm/geometry/image.hpp"

namespace hm {

/// Converts packed YUV 4:2:2 (YUYV: Y0 U Y1 V; ITU-R BT.601, Y from 16 to 235, which is V4L2's default) to
/// RGB. `row_bytes` is the distance of rows, at least 2 * width; the width is even and all rows are there.
Image<Rgb8> yuyv_to_rgb(std::span<const std::byte> bytes, int width, int height, std::size_t row_bytes);

}  // namespace hm
