#pragma once
#include <array>
#include <span>

#include "hm/laser/height/height_params.hpp"

namespace hm {

/// Surface supported by several readings of a scan.
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
  int rejected = 0;            ///< clusters rejected because of their spread
  [[nodiscard]] std::span<const HeightMode> all() const {
    return {modes.data(), static_cast<std::size_t>(size)};
  }
};

/// Finds the modes of a set of distances (dissertation 2.2.3) without bins: a window of the bin's width
/// slides over the sorted readings; its position with most readings (the narrowest of equals) is refined to a
/// biweight mean; the readings of a mode are removed before the next search. The result is shift-invariant.
/// Sorts `distances_m`; no heap allocation.
HeightModes find_height_modes(std::span<double> distances_m, const HeightParams& params);

}  // namespace hm
