#pragma once
#include <cstdint>
#include <string_view>

namespace hm {

/// Origin of a pose graph edge.
enum class PoseEdgeKind : std::uint8_t {
  kOdometry,  ///< between consecutive poses
  kLoop,      ///< a loop closure
};
std::string_view to_string(PoseEdgeKind kind);

}  // namespace hm
