#include "hm/pipeline/laser/laser_sweep.hpp"

#include <cmath>

namespace hm {
namespace {

/// Between two known poses of a sweep this many beams are interpolated: a millisecond or two.
constexpr std::size_t kBeamsPerKnot = 64;

/// A point through two poses, in between by `share`: to first order the pose in between.
Vec3 blend(const SE3& a, const SE3& b, double share, const Vec3& point) {
  return (1 - share) * (a * point) + share * (b * point);
}

}  // namespace

bool SweepPoints::prepare_knots(const LaserScan& scan, const SweepPose& T_odom_base) {
  knots_.clear();
  const std::size_t last = scan.size() - 1;
  const std::size_t step = scan.time_increment_s > 0 ? kBeamsPerKnot : std::max<std::size_t>(last, 1);
  for (std::size_t beam = 0; beam < last + step; beam += step) {
    const std::size_t at = std::min(beam, last);
    const auto pose = T_odom_base(scan.stamp_of(at));
    if (!pose) return false;
    knots_.push_back({at, *pose});
  }
  return true;
}

bool SweepPoints::compute(const LaserScan& scan, const LaserRig& rig, const SweepPose& T_odom_base) {
  returns_m_.clear();
  no_returns_m_.clear();
  if (scan.size() == 0 || !prepare_knots(scan, T_odom_base)) return false;
  add_all_beams(scan, rig);
  return true;
}

void SweepPoints::compute_again(const LaserScan& scan, const LaserRig& rig, std::span<const SweepKnot> knots,
                                const SE3& T_map_odom) {
  returns_m_.clear();
  no_returns_m_.clear();
  knots_.clear();
  for (const SweepKnot& knot : knots) knots_.push_back({knot.beam, T_map_odom * knot.T_odom_base});
  if (!knots_.empty()) add_all_beams(scan, rig);
}

void SweepPoints::add_all_beams(const LaserScan& scan, const LaserRig& rig) {
  origin_m_ = (knots_[knots_.size() / 2].T_odom_base * rig.T_base_laser).translation();
  add_beams(scan, rig.horizontal_beams(scan.size()), rig.T_base_laser, clear_without_return_m_);
  for (const auto& mirror : {rig.down, rig.up})
    if (mirror) add_beams(scan, mirror->beams, mirror->T_base_virtual_laser, 0);
}

void SweepPoints::add_beams(const LaserScan& scan, const BeamRange& beams, const SE3& T_base_laser,
                            double clear_without_return_m) {
  std::size_t knot = 0;
  for (std::size_t beam = beams.begin; beam < std::min(beams.end, scan.size()); ++beam) {
    const bool is_return = scan.is_return(beam);
    // A reading beyond the limit is no return either; one below it, or NaN, is nothing at all.
    if (!is_return && !(clear_without_return_m > 0 && scan.ranges_m[beam] >= scan.range_max_m)) continue;
    const double range_m = is_return ? static_cast<double>(scan.ranges_m[beam])
                                     : std::min(clear_without_return_m, scan.range_max_m);
    while (knot + 2 < knots_.size() && knots_[knot + 1].beam <= beam) ++knot;
    const SweepKnot& from = knots_[knot];
    const SweepKnot& to = knots_[std::min(knot + 1, knots_.size() - 1)];
    const double share =
        to.beam > from.beam ? static_cast<double>(beam - from.beam) / static_cast<double>(to.beam - from.beam)
                            : 0;
    const double angle = scan.angle_rad(beam);
    const Vec3 p_base = T_base_laser * Vec3(range_m * std::cos(angle), range_m * std::sin(angle), 0);
    const Vec3 p_odom = blend(from.T_odom_base, to.T_odom_base, share, p_base);
    (is_return ? returns_m_ : no_returns_m_).push_back(p_odom.cast<float>());
  }
}

}  // namespace hm
