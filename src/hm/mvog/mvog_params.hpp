#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Everything about the multi-volume occupancy grid (dissertation 2.5).
struct MvogParams {
  double resolution_m = 0.10;
  /// Share of hits from which a volume counts as occupied.
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
               "edge of a column; heights are kept to half of it",
               ParamLevel::kBasic},
      self.resolution_m);
    v(ParamDoc{"evidence_cap", {1, 15}, "observations that a volume remembers, so that it follows change"},
      self.evidence_cap);
    v(ParamDoc{"same_view_cap", {1, 15}, "the same for scans of one pose, so that they do not harden it"},
      self.same_view_cap);
    v(ParamDoc{"same_view_distance_cell", {0, 100}, "scans from closer together than this are of one pose"},
      self.same_view_distance_cell);
    v(ParamDoc{"glancing_period",
               {1, 1000},
               "beams that may glance along the surface they end on count in one of this many scans"},
      self.glancing_period);
    v(ParamDoc{"merge_sigmas",
               {0, 10},
               "neighbouring volumes are one when their counts differ by less; 0: only equal ones"},
      self.merge_sigmas);
    v(ParamDoc{"fill_slivers", {}, "unknown gaps of half a cell between free volumes become free"},
      self.fill_slivers);
    v(ParamDoc{"max_map_mb", {0, 1e6}, "memory cap for the map; 0 for none", ParamLevel::kBasic},
      self.max_map_mb);
  }
};

/// An error naming what contradicts.
Result<void> check_params(const MvogParams& params);

}  // namespace hm
