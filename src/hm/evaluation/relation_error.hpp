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
    v(ParamDoc{"max_gap_s", {0, 1e6}, "poses further apart in time are not interpolated between"},
      self.max_gap_s);
    v(ParamDoc{"max_extrapolation_s", {0, 1e6}, "the first and last pose hold for so long beyond the ends"},
      self.max_extrapolation_s);
  }
};

/// How the estimated motion between two moments differs from the true one.
struct RelationError {
  std::size_t relation = 0;  ///< its index
  double translation_m = 0;  ///< length of the translation of T_true^-1 * T_estimate
  double rotation_rad = 0;   ///< angle of its rotation, 0 to pi
};

/// Errors of relative poses; independent of the frame that the trajectory is in, and of how errors add up
/// along it.
struct RelationErrors {
  Summary translation_m;         ///< `mean` is the published number
  double translation_std_m = 0;  ///< of the sample (n - 1)
  Summary rotation_rad;
  double rotation_std_rad = 0;
  std::size_t unmatched = 0;          ///< relations of which the trajectory does not know both moments
  std::vector<RelationError> errors;  ///< of the others, in their order
};

/// Errors of the relative poses of a trajectory against known ones (Kuemmerle et al., "On Measuring the
/// Accuracy of SLAM Algorithms", 2009, section 3: mean absolute translational and rotational error). The
/// pose of a moment is interpolated. An error when no relation lies within the trajectory.
Result<RelationErrors> evaluate_relations(const Trajectory& estimate, std::span<const PoseRelation> relations,
                                          const RelationErrorParams& params = {});

}  // namespace hm
