#pragma once
#include <cstddef>

#include "hm/tsdf/alignment/alignment_step.hpp"
#include "hm/tsdf/alignment/alignment_terms.hpp"
#include "hm/tsdf/alignment/dense_alignment.hpp"

namespace hm {

/// State of one call of align().
class AlignmentRun {
 public:
  AlignmentRun(const AlignmentParams& params, const TsdfParams& tsdf, const VolumeGrid& grid,
               AlignmentPoints& points, const AlignmentPrior& prior)
      : params_(params), tsdf_(tsdf), grid_(grid), points_(points), lookup_(grid), prior_(prior) {
    place_centre();
  }

  void run(AlignmentResult& result);

 private:
  void place_centre();
  /// Sets the width of the robust function: `sigmas` standard deviations of the noise and `extra_sigma_m`
  /// combined (root of the sum of squares).
  void set_widths(double sigmas, double extra_sigma_m);
  [[nodiscard]] AlignmentTerms terms_at(const SE3& pose, std::size_t count);
  [[nodiscard]] AlignmentFit fit_of(const AlignmentTerms& terms, std::size_t count) const;
  [[nodiscard]] Observability seen_at(const SE3& pose);
  [[nodiscard]] Observability observability_of(const AlignmentTerms& terms) const;
  /// Information of geometry and prior together, at `from_prior` from the prior.
  [[nodiscard]] Information with_prior(const Information& geometry, const Observability& seen,
                                       const Vec6& from_prior) const;
  /// Factor from a sum of weights to information: readings close to each other count as one.
  [[nodiscard]] double information_scale(std::size_t round) const;
  [[nodiscard]] double objective(const AlignmentTerms& terms, const SE3& pose, double scale) const;
  /// Searches for surfaces along the rays when the prior is too far off for gradients.
  [[nodiscard]] SE3 search_from(const SE3& start, int& iterations);
  /// Result of a round: pose, sums and observability there.
  struct Refined {
    SE3 pose;
    AlignmentTerms terms;
    Observability seen;
  };
  [[nodiscard]] Refined refine(SE3 pose, std::size_t round, int& iterations);
  /// Refines the directions of the free shifts: the map of a corridor is the same half a metre further on,
  /// which determines its axis better than the normals do.
  void straighten(const SE3& pose, Observability& seen);
  /// Correction of such an axis, within the projection `across`.
  [[nodiscard]] Vec3 tilt_of(const Vec3& axis, const Mat3& across, const SE3& pose);
  /// Factor that reduces the geometry's information (about the centre) by the error S common to all readings:
  /// (H^-1 + S)^-1 = S^-1 (H + S^-1)^-1 H.
  [[nodiscard]] Mat6 information_share(const Mat6& geometry) const;
  /// Pose between the prior and the refined pose that accounts for the common error.
  [[nodiscard]] SE3 weighed(const Refined& refined, std::size_t round) const;
  void judge(AlignmentResult& result) const;
  void describe(std::size_t round, AlignmentResult& result);

  const AlignmentParams& params_;
  const TsdfParams& tsdf_;
  const VolumeGrid& grid_;
  AlignmentPoints& points_;
  VoxelLookup lookup_;
  const AlignmentPrior& prior_;
  TurningCentre centre_;
  Mat6 prior_information_ = Mat6::Zero();  ///< about the centre
  double width_sigmas_ = 1;                ///< see set_widths()
};

}  // namespace hm
