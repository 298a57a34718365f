#pragma once
#include <cstddef>

#include "hm/tsdf/alignment/alignment_step.hpp"
#include "hm/tsdf/alignment/alignment_terms.hpp"
#include "hm/tsdf/alignment/dense_alignment.hpp"

namespace hm {

/// One call of align(): the scan, the map, and how far it is.
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
  /// Sets where the robust function ends: so many standard deviations, which are larger than the noise asks
  /// for by `extra_sigma_m` (as root of the sum of squares).
  void set_widths(double sigmas, double extra_sigma_m);
  [[nodiscard]] AlignmentTerms terms_at(const SE3& pose, std::size_t count);
  [[nodiscard]] AlignmentFit fit_of(const AlignmentTerms& terms, std::size_t count) const;
  [[nodiscard]] Observability seen_at(const SE3& pose);
  [[nodiscard]] Observability observability_of(const AlignmentTerms& terms) const;
  /// What geometry and prior know together, `from_prior` away from the prior.
  [[nodiscard]] Information with_prior(const Information& geometry, const Observability& seen,
                                       const Vec6& from_prior) const;
  /// Information of one sum of weights: readings near to each other count as one.
  [[nodiscard]] double information_scale(std::size_t round) const;
  [[nodiscard]] double objective(const AlignmentTerms& terms, const SE3& pose, double scale) const;
  /// Seeks surfaces along the rays when the prior is too far off for gradients.
  [[nodiscard]] SE3 search_from(const SE3& start, int& iterations);
  /// Where a round ended, with its sums there and what it held to be seen.
  struct Refined {
    SE3 pose;
    AlignmentTerms terms;
    Observability seen;
  };
  [[nodiscard]] Refined refine(SE3 pose, std::size_t round, int& iterations);
  /// Straightens the free shifts: a corridor's map is the same half a metre on, which tells the axis better
  /// than its normals do.
  void straighten(const SE3& pose, Observability& seen);
  /// By how much an axis is to be tilted, within the projection `across`, for that.
  [[nodiscard]] Vec3 tilt_of(const Vec3& axis, const Mat3& across, const SE3& pose);
  /// What is left of geometry's information (about the centre), as a factor before it, after the error that
  /// all readings share: (H^-1 + S)^-1 = S^-1 (H + S^-1)^-1 H.
  [[nodiscard]] Mat6 share_believed(const Mat6& geometry) const;
  /// Between the prior and what scan and prior came to without that error: where they meet with it.
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
