#pragma once
#include <cstdint>
#include <span>

#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/projection/tsdf_params.hpp"

namespace hm {

/// When neighbouring readings count as different surfaces: a step in depth of more than
/// edge_sigmas_ratio * sigma(z) + edge_slope_ratio * (width of a pixel at z), in 16-bit fixed point and the
/// picture's own units, so that vector code handles 32 pixels at a time.
struct EdgeRule {
  bool enabled = false;
  std::uint16_t quadratic = 0, linear = 0, constant = 0;

  EdgeRule() = default;
  EdgeRule(const TsdfParams& params, const DepthNoise& noise, const PinholeCamera& camera, double unit_m);
  /// The smallest step that is no edge yet, in units.
  [[nodiscard]] std::uint16_t threshold(std::uint16_t units) const {
    const auto high_half = [](std::uint32_t a, std::uint32_t b) { return a * b >> 16u; };
    const std::uint32_t sum =
        high_half(high_half(units, units), quadratic) + high_half(units, linear) + constant;
    return static_cast<std::uint16_t>(sum < 65535 ? sum : 65535);
  }
};

/// Three rows of a depth image; at the top and bottom of the picture, `above` or `below` is the row itself.
struct DepthRows {
  const std::uint16_t* above = nullptr;
  const std::uint16_t* row = nullptr;
  const std::uint16_t* below = nullptr;
  std::size_t width = 0;
};

/// Sorts out the readings of one row at depth edges. `units` becomes the row without mixed pixels: readings
/// with a neighbour nearer and the opposite neighbour farther by more than the threshold, which hang in the
/// air between two surfaces. `edge` becomes 0xffff at readings with any neighbour that far off, else 0: there
/// a surface ends or is seen at a grazing angle. Pixels without reading are no neighbours. Both outputs have
/// room for `width` numbers.
void sort_out_edges(const EdgeRule& rule, const DepthRows& rows, std::uint16_t* units, std::uint16_t* edge);

}  // namespace hm
