#include "hm/evaluation/relation_error.hpp"

#include <cmath>

namespace hm {
namespace {

double standard_deviation(std::span<const double> values, double mean) {
  if (values.size() < 2) return 0;
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

}  // namespace

Result<RelationErrors> evaluate_relations(const Trajectory& estimate, std::span<const PoseRelation> relations,
                                          const RelationErrorParams& params) {
  RelationErrors result;
  std::vector<double> translations_m, rotations_rad;
  const Duration max_gap = Duration::from_seconds(params.max_gap_s);
  const Duration max_extrapolation = Duration::from_seconds(params.max_extrapolation_s);
  for (std::size_t i = 0; i < relations.size(); ++i) {
    const auto T_world_from = pose_at(estimate, relations[i].from, max_gap, max_extrapolation);
    const auto T_world_to = pose_at(estimate, relations[i].to, max_gap, max_extrapolation);
    if (!T_world_from || !T_world_to) continue;
    const SE3 error = relations[i].T_from_to.inverse() * (T_world_from->inverse() * *T_world_to);
    translations_m.push_back(error.translation().norm());
    rotations_rad.push_back(error.angle());
    result.errors.push_back({i, translations_m.back(), rotations_rad.back()});
  }
  result.unmatched = relations.size() - result.errors.size();
  if (result.errors.empty())
    return fail(ErrorCode::kInvalidValue, "relations",
                "none of {} relations lies within the trajectory of {} poses", relations.size(),
                estimate.size());
  result.translation_m = summarise(translations_m);
  result.rotation_rad = summarise(rotations_rad);
  result.translation_std_m = standard_deviation(translations_m, result.translation_m.mean);
  result.rotation_std_rad = standard_deviation(rotations_rad, result.rotation_rad.mean);
  return result;
}

}  // namespace hm
