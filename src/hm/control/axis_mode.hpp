#pragma once
#include <array>
#include <cstdint>
#include <string_view>

namespace hm {

/// Control modes of an axis (dissertation 2.3.2).
enum class AxisMode : std::uint8_t {
  kDisabled,  ///< not controlled here
  kDirect,    ///< the command passes through
  kPosition,
  kVelocity,
};
inline constexpr std::array<std::string_view, 4> kAxisModeNames{"disabled", "direct", "position", "velocity"};

}  // namespace hm
