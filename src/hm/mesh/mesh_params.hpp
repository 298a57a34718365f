#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// How volumes become a mesh, and what is done with the whole mesh before it is handed out.
struct MeshParams {
  double min_weight_ratio = 0.0;
  int min_piece_triangles = 0;
  /// Unconnected pieces whose box has a shorter diagonal are removed; 0: none.
  static constexpr double kMinPieceDiameter_m = 0.0;
  double simplify_keep_ratio = 1.0;
  double simplify_error_m = 0.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"min_weight_ratio",
               {0, 255},
               "a voxel counts as observed from this weight on, in observations at the narrowest truncation; "
               "0: any",
               ParamLevel::kBasic},
      self.min_weight_ratio);
    v(ParamDoc{"min_piece_triangles",
               {0, 1e9},
               "unconnected pieces with fewer triangles are removed; 0: none",
               ParamLevel::kBasic},
      self.min_piece_triangles);
    v(ParamDoc{"simplify_keep_ratio",
               {0, 1},
               "simplification: share of the triangles to keep; 1: all of them",
               ParamLevel::kBasic},
      self.simplify_keep_ratio);
    v(ParamDoc{"simplify_error_m",
               {0, 10},
               "simplification: how far the surface may move; with 0 the keep ratio alone decides",
               ParamLevel::kBasic},
      self.simplify_error_m);
  }
};

}  // namespace hm
