#include "hm/odometry/geometry_tracking/surface_reference.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "hm/odometry/registration/pose_equations.hpp"

namespace hm {
namespace {

constexpr int kSampledCells = 8;                               // every n-th in both directions
constexpr double kSameDepth_m = 0.05, kSameDepthRatio = 0.05;  // of readings of one surface
constexpr double kLeastShare = 0.3;
constexpr double kCloseShare = 0.75, kCloseAngle_rad = 0.2, kCloseRatio = 0.1;  // of the depth: its distance
constexpr double kHalf_m = 0.01;  // a reference as uncertain as this counts half
constexpr std::size_t kByShare = 2, kByCertainty = 4;

double certainty(const SurfaceReference& reference) {
  const Mat6 covariance = covariance_by_adjoint(reference.covariance, reference.T_odom_depth.inverse());
  return 1 / (1 + covariance.topLeftCorner<3, 3>().trace() / (kHalf_m * kHalf_m));
}

void add_best(std::vector<std::size_t>& chosen, const std::vector<double>& scores, std::size_t count) {
  std::vector<std::size_t> order(scores.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return scores[a] > scores[b]; });
  for (const std::size_t index : order) {
    if (count == 0 || !(scores[index] > 0)) return;
    if (std::find(chosen.begin(), chosen.end(), index) != chosen.end()) continue;
    chosen.push_back(index);
    --count;
  }
}

}  // namespace

std::optional<Eigen::Vector2i> nearest_pixel(const PinholeCamera& camera, const Vec3& p) {
  if (!(p.z() > 0.05)) return std::nullopt;
  return Eigen::Vector2i(static_cast<int>(std::lround(camera.fx * p.x() / p.z() + camera.cx)),
                         static_cast<int>(std::lround(camera.fy * p.y() / p.z() + camera.cy)));
}

double mean_depth_m(const DepthGrid& grid) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y < grid.depth_m.height(); y += kSampledCells)
    for (int x = 0; x < grid.depth_m.width(); x += kSampledCells)
      if (const float z = grid.depth_m(x, y); z > 0) sum += static_cast<double>(z), ++count;
  return count > 0 ? sum / count : 1;
}

double shared_view(const DepthGrid& reference, const DepthGrid& current, const SE3& T_ref_cur) {
  int readings = 0, shared = 0;
  for (int y = kSampledCells / 2; y < current.depth_m.height(); y += kSampledCells)
    for (int x = kSampledCells / 2; x < current.depth_m.width(); x += kSampledCells) {
      const double z = static_cast<double>(current.depth_m(x, y));
      if (!(z > 0)) continue;
      ++readings;
      const Vec3 p = T_ref_cur * current.camera.unproject(Vec2(x, y), z);
      const auto pixel = nearest_pixel(reference.camera, p);
      if (!pixel || !reference.depth_m.contains(pixel->x(), pixel->y())) continue;
      const float seen_m = reference.depth_m(pixel->x(), pixel->y());
      if (!(seen_m > 0)) continue;
      const double difference = std::abs(static_cast<double>(seen_m) - p.z());
      shared += difference < kSameDepth_m + kSameDepthRatio * p.z() ? 1 : 0;
    }
  return readings > 0 ? static_cast<double>(shared) / readings : 0;
}

ChosenReferences choose_references(std::span<const SurfaceReference> references, const DepthGrid& current,
                                   const SE3& T_odom_depth) {
  ChosenReferences chosen;
  const double depth_m = mean_depth_m(current);
  std::vector<double> by_share, by_certainty;
  for (const SurfaceReference& reference : references) {
    const SE3 T_ref_cur = reference.T_odom_depth.inverse() * T_odom_depth;
    const double share = shared_view(*reference.grid, current, T_ref_cur);
    chosen.has_close |= share > kCloseShare && T_ref_cur.angle() < kCloseAngle_rad &&
                        T_ref_cur.translation().norm() < kCloseRatio * depth_m;
    by_share.push_back(share > kLeastShare ? share : 0);
    by_certainty.push_back(by_share.back() * certainty(reference));
  }
  add_best(chosen.indices, by_share, kByShare);
  add_best(chosen.indices, by_certainty, kByCertainty);
  return chosen;
}

}  // namespace hm
