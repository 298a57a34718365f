#pragma once
#include <array>
#include <span>

#include "hm/laser/height/height_params.hpp"

namespace hm {

/// One surface that several readings of a scan agree on.
struct HeightMode {
  double distance_m = 0;  ///< robust mean of its readings
  double spread_m = 0;    ///< standard deviation of all readings within the half width
  int readings = 0;       ///< within the half width
};

/// The surfaces in one scan, most readings first.
struct HeightModes {
  static constexpr int kMax = 4;
  std::array<HeightMode, kMax> modes{};
  int size = 0;
  double explained_ratio = 0;  ///< share of all readings that belong to one of them
  int rejected = 0;            ///< accumulations of readings that spread too far to be a surface
  [[nodiscard]] std::span<const HeightMode> all() const {
    return {modes.data(), static_cast<std::size_t>(size)};
  }
};

/// The modes of a set of distances (dissertation 2.2.3) without bins: a window of the bin's width slides over
/// the sorted readings, and its fullest place (the narrowest of equals) is climbed to the mean of a biweight;
/// the readings of a mode are taken away before the next is looked for. Shifting all distances shifts the
/// result and changes nothing else. Sorts `distances_m`; no heap.
HeightModes find_height_modes(std::span<double> distances_m, const HeightParams& params);

}  // namespace hm
