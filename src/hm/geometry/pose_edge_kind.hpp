#pragma once
#include <cstdint>
#include <string_view>

namespace hm {

/// What an edge of a pose graph comes from.
enum class PoseEdgeKind : std::uint8_t {
  kOdometry,  ///< between consecutive poses
  kLoop,      ///< a place seen again
};
std::string_view to_string(PoseEdgeKind kind);

}  // namespace hm
