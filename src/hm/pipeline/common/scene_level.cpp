#include "hm/pipeline/common/scene_level.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/estimation/path_gravity.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr int kWindow_px = 24, kStep_px = 2;
constexpr double kMaxDepth_m = 6;

/// The hint of cameras whose y axis points up is that of cameras turned over.
std::vector<Mat3> held_rotations(const Trajectory& T_world_camera, const PinholeCamera& camera) {
  std::vector<Mat3> rotations = rotations_of(T_world_camera);
  if (camera.fy < 0)
    for (Mat3& R : rotations) R = (R * Vec3(-1, -1, 1).asDiagonal()).eval();
  return rotations;
}

/// Points of a window; empty where many are missing or it reaches over an edge.
std::vector<Vec3> window_points(const DepthImage& depth, const PinholeCamera& camera, int left, int top) {
  constexpr std::size_t kLeast = 100;  // of 144
  constexpr double kMostRelief_ratio = 0.25;
  std::vector<Vec3> points;
  double nearest = kMaxDepth_m, farthest = 0;
  for (int y = top; y < top + kWindow_px; y += kStep_px)
    for (int x = left; x < left + kWindow_px; x += kStep_px) {
      const double depth_m = depth.depth_m(x, y);
      if (depth_m <= 0 || depth_m > kMaxDepth_m) continue;
      nearest = std::min(nearest, depth_m), farthest = std::max(farthest, depth_m);
      points.push_back(camera.unproject(Vec2(x, y), depth_m));
    }
  if (points.size() < kLeast || farthest - nearest > kMostRelief_ratio * nearest) points.clear();
  return points;
}

std::optional<SurfacePatch> fitted_plane(const std::vector<Vec3>& points, const PinholeCamera& camera) {
  if (points.empty()) return std::nullopt;
  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : points) centre += p / static_cast<double>(points.size());
  Mat3 scatter = Mat3::Zero();
  for (const Vec3& p : points)
    scatter += (p - centre) * (p - centre).transpose() / static_cast<double>(points.size());
  const Eigen3 axes = symmetric_eigen(scatter);
  // Noise of structured light grows with the square of the depth; what deviates more is not flat.
  const double noise_m = 0.002 + 0.002 * centre.z() * centre.z();
  if (axes.values[0] > 4 * noise_m * noise_m || axes.values[0] > 0.05 * axes.values[1]) return std::nullopt;
  Vec3 normal = axes.vectors.col(0);
  if (normal.dot(centre) > 0) normal = -normal;
  const double slant = -normal.dot(centre.normalized());
  if (slant < 0.15) return std::nullopt;
  const double side_m = kWindow_px * centre.z() / std::abs(camera.fx);
  return SurfacePatch{centre, normal, side_m * side_m / slant};
}

}  // namespace

UpDirection find_up(std::span<const SurfacePatch> patches, const Trajectory& T_world_camera,
                    const UpClues& clues) {
  if (clues.imu)
    if (const auto gravity = up_along_path(clues.imu->samples, T_world_camera))
      return refine_gravity(*gravity, patches);
  return find_scene_up(patches, held_rotations(T_world_camera, clues.camera));
}

UpDirection up_of_frame(const TriangleMesh& mesh, const Trajectory& T_world_camera, const UpClues& clues) {
  UpDirection up = find_up(patches_of(mesh), T_world_camera, clues);
  if (up.known()) up.up = snapped_to_axis(up.up);
  return up;
}

std::vector<SurfacePatch> patches_of(const PosedFrame& posed, const PinholeCamera& camera) {
  std::vector<SurfacePatch> patches;
  const DepthImage& depth = posed.frame.depth;
  for (int top = 0; top + kWindow_px <= depth.height(); top += kWindow_px)
    for (int left = 0; left + kWindow_px <= depth.width(); left += kWindow_px)
      if (auto patch = fitted_plane(window_points(depth, camera, left, top), camera)) {
        patch->centre = posed.T_world_camera * patch->centre;
        patch->normal = posed.T_world_camera.rotation() * patch->normal;
        patches.push_back(*patch);
      }
  return patches;
}

SE3 level_start(const RgbdFrame& first, const UpClues& clues) {
  const Vec3 held = clues.camera.fy < 0 ? Vec3(Vec3::UnitY()) : Vec3(-Vec3::UnitY());
  const auto patches = patches_of({first, SE3()}, clues.camera);
  if (clues.imu)
    if (const auto gravity = up_about(clues.imu->samples, first.stamp))
      return level_pose(refine_gravity(*gravity, patches).up);
  const UpDirection up = find_scene_up(patches, held_rotations({{first.stamp, SE3()}}, clues.camera));
  return level_pose(up.known() ? up.up : held);
}

void visit(const UpDirection& up, SummaryTree& v) {
  v({"known"}, up.known());
  v({"axis", "up in the map's frame"}, up.known() ? axis_text(up.up) : std::string("unknown"));
  JsonValue direction;
  if (up.known()) direction = JsonValue::Array{up.up.x(), up.up.y(), up.up.z()};
  v.json("direction", std::move(direction));
  if (const std::string_view source = to_string(up.source); !source.empty())
    v({"source", "found from"}, source);
  if (up.known()) v({"sigma_deg", "deviation", "{:.1f} deg"}, up.sigma_rad * kDegreesPerRadian);
}

}  // namespace hm
