#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of meshing, and of cleaning the whole mesh.
struct MeshParams {
  double min_weight_ratio = 0.0;
  /// 9 in 10 of the floating pieces caused by noise in real recordings are smaller.
  double min_piece_size_m = 0.05;
  double simplify_keep_ratio = 1.0;
  double simplify_error_m = 0.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"min_weight_ratio",
               {0, 255},
               "minimum weight of a meshed voxel, in observations at the narrowest truncation; larger drops "
               "uncertain surfaces; 0: any",
               ParamLevel::kBasic},
      self.min_weight_ratio);
    v(
        ParamDoc{
            "min_piece_size_m",
            {0, 1e3},
            "unconnected pieces of the finished mesh whose bounding box has a shorter diagonal are removed, "
            "except the one of most triangles; 0: none",
            ParamLevel::kBasic},
        self.min_piece_size_m);
    v(ParamDoc{"simplify_keep_ratio",
               {0, 1},
               "simplification: share of the triangles to keep; 1: all",
               ParamLevel::kBasic},
      self.simplify_keep_ratio);
    v(ParamDoc{"simplify_error_m",
               {0, 10},
               "simplification: largest deviation of the surface; 0: limited by the keep ratio only",
               ParamLevel::kBasic},
      self.simplify_error_m);
  }
};

}  // namespace hm
