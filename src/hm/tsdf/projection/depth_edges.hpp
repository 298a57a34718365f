#pragma once
#include <cstdint>
#include <span>

#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/tsdf_params.hpp"

namespace hm {

/// Rule for neighbouring readings on different surfaces: a depth step of more than edge_sigmas_ratio *
/// sigma(z) + edge_slope_ratio * (width of a pixel at z), in 16-bit fixed point and the image's own units, so
/// that vector code processes 32 pixels at a time.
struct EdgeRule {
  bool enabled = false;
  std::uint16_t quadratic = 0, linear = 0, constant = 0;

  EdgeRule() = default;
  EdgeRule(const TsdfParams& params, const DepthNoise& noise, const PinholeCamera& camera, double unit_m);
  /// Largest step that is not an edge, in units.
  [[nodiscard]] std::uint16_t threshold(std::uint16_t units) const {
    const auto high_half = [](std::uint32_t a, std::uint32_t b) { return a * b >> 16u; };
    const std::uint32_t sum =
        high_half(high_half(units, units), quadratic) + high_half(units, linear) + constant;
    return static_cast<std::uint16_t>(sum < 65535 ? sum : 65535);
  }
};

/// Three rows of a depth image; at the top and bottom of the image, `above` or `below` is the row itself.
struct DepthRows {
  const std::uint16_t* above = nullptr;
  const std::uint16_t* row = nullptr;
  const std::uint16_t* below = nullptr;
  std::size_t width = 0;
};

/// Filters the readings of one row at depth edges. `units` receives the row without mixed pixels, i.e.
/// readings with a neighbour nearer and the opposite neighbour farther by more than the threshold, which lie
/// between two surfaces. `edge` receives 0xffff at readings with any neighbour beyond the threshold, else 0:
/// a surface ends there or is seen at a grazing angle. Pixels without a reading are ignored. Both outputs
/// must have `width` elements.
void sort_out_edges(const EdgeRule& rule, const DepthRows& rows, std::uint16_t* units, std::uint16_t* edge);

}  // namespace hm
