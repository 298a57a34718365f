#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of the multi-volume occupancy grid (dissertation 2.5).
struct MvogParams {
  double resolution_m = 0.10;
  /// Minimum share of hits of an occupied volume.
  double occupied_ratio = 0.33;
  int evidence_cap = 8;
  int same_view_cap = 4;
  double same_view_distance_cell = 0.5;
  int glancing_period = 8;
  double merge_sigmas = 1.0;
  bool fill_slivers = true;
  int max_map_mb = 0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"resolution_m",
               {0.01, 10},
               "edge of a column; vertical resolution is half of it; smaller shows more detail, but takes "
               "more memory",
               ParamLevel::kBasic},
      self.resolution_m);
    v(ParamDoc{"evidence_cap",
               {1, 15},
               "upper limit of observations counted per volume; smaller adapts faster to changes, larger is "
               "more robust to noise"},
      self.evidence_cap);
    v(ParamDoc{"same_view_cap",
               {1, 15},
               "the same limit for scans from one position, so that a standing sensor does not dominate"},
      self.same_view_cap);
    v(ParamDoc{"same_view_distance_cell",
               {0, 100},
               "scans from positions closer than this count as one position"},
      self.same_view_distance_cell);
    v(ParamDoc{"glancing_period",
               {1, 1000},
               "grazing beams near their end count as misses in one of this many scans only; 1: always; "
               "larger preserves floors better"},
      self.glancing_period);
    v(ParamDoc{"merge_sigmas",
               {0, 10},
               "neighbouring volumes are merged when their counts differ by less; larger saves memory, but "
               "loses detail; 0: only equal ones"},
      self.merge_sigmas);
    v(ParamDoc{"fill_slivers", {}, "set unknown gaps of half a cell between free volumes to free"},
      self.fill_slivers);
    v(ParamDoc{"max_map_mb", {0, 1e6}, "memory limit of the map; 0: none", ParamLevel::kBasic},
      self.max_map_mb);
  }
};

/// Checks for contradictions; the error names them.
Result<void> check_params(const MvogParams& params);

}  // namespace hm
