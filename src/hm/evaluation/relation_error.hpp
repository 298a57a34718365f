#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/core/statistics.hpp"
#include "hm/geometry/pose_relation.hpp"
#include "hm/geometry/trajectory.hpp"

namespace hm {

struct RelationErrorParams {
  double max_gap_s = 1.0;
  double max_extrapolation_s = 0.02;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_gap_s", {0, 1e6}, "largest time between two poses for interpolation"}, self.max_gap_s);
    v(ParamDoc{"max_extrapolation_s",
               {0, 1e6},
               "time for which the first and last pose are valid beyond the ends"},
      self.max_extrapolation_s);
  }
};

/// Error of the estimated motion between two times.
struct RelationError {
  std::size_t relation = 0;  ///< index of the relation
  double translation_m = 0;  ///< length of the translation of T_true^-1 * T_estimate
  double rotation_rad = 0;   ///< angle of its rotation, 0 to pi
};

/// Errors of relative poses, independent of the trajectory's frame and of accumulated drift.
struct RelationErrors {
  Summary translation_m;         ///< `mean` is the published number
  double translation_std_m = 0;  ///< of the sample (n - 1)
  Summary rotation_rad;
  double rotation_std_rad = 0;
  std::size_t unmatched = 0;          ///< relations whose times are not both covered by the trajectory
  std::vector<RelationError> errors;  ///< of the matched relations, in their order
};

/// Compares the relative poses of a trajectory with known ones (Kuemmerle et al., "On Measuring the Accuracy
/// of SLAM Algorithms", 2009, section 3: mean absolute translational and rotational error). Poses are
/// interpolated in time. Error when no relation lies within the trajectory.
Result<RelationErrors> evaluate_relations(const Trajectory& estimate, std::span<const PoseRelation> relations,
                                          const RelationErrorParams& params = {});

}  // namespace hm
