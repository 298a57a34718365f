#include "hm/geometry/pose_edge_kind.hpp"

namespace hm {

std::string_view to_string(PoseEdgeKind kind) { return kind == PoseEdgeKind::kLoop ? "loop" : "odometry"; }

}  // namespace hm
