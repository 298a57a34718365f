#include "hm/sim/sensor/visibility.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "hm/core/rng.hpp"
#include "hm/sim/sensor/renderer.hpp"

namespace hm {
namespace {

constexpr double kCell_m = 0.1;
constexpr std::size_t kCamerasPerCell = 16;
constexpr std::size_t kSamplesPerChunk = 16384;
constexpr double kMargin_m = 0.002;  ///< smaller than the gap between any surfaces

/// Key of a point's 10 cm cell, 21 bits per coordinate. The grid is shifted, since floors and walls tend to
/// lie at round coordinates, i.e. on cell borders.
std::uint64_t cell_of(const Vec3& p_world) {
  const Vec3 p = p_world + Vec3(0.0371, 0.0293, 0.0417);
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis)
    key = (key << 21u) | (static_cast<std::uint64_t>(std::floor(p[axis] / kCell_m) + (1 << 20)) & 0x1fffffu);
  return key;
}

/// Some of the cameras that observe each cell.
class CellCameras {
 public:
  CellCameras(const Renderer& renderer, std::span<const SE3> poses, const VisibilityParams& params,
              const ParallelLoop& loop) {
    std::vector<std::vector<std::uint64_t>> seen(poses.size());
    const PinholeCamera coarse = params.camera.scaled(std::min(1.0, 80.0 / params.camera.width));
    loop.for_ranges(poses.size(), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) seen[i] = cells_seen(renderer, coarse, poses[i], params);
    });
    std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> all;
    for (std::size_t i = 0; i < seen.size(); ++i)
      for (const std::uint64_t cell : seen[i]) all[cell].push_back(static_cast<std::uint32_t>(i));
    cameras_ = std::move(all);
    for (auto& [cell, cameras] : cameras_) thin(cameras);
  }

  [[nodiscard]] std::span<const std::uint32_t> at(const Vec3& p) const {
    const auto found = cameras_.find(cell_of(p));
    return found == cameras_.end() ? std::span<const std::uint32_t>() : found->second;
  }

 private:
  static std::vector<std::uint64_t> cells_seen(const Renderer& renderer, const PinholeCamera& camera,
                                               const SE3& pose, const VisibilityParams& params) {
    std::vector<std::uint64_t> cells;
    const RenderedView view = renderer.render(camera, pose, ParallelLoop());
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double z = static_cast<double>(view.depth_m(x, y));
        if (z < params.min_depth_m || z > params.max_depth_m) continue;
        cells.push_back(cell_of(pose * camera.unproject({x, y}, z)));
      }
    }
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    return cells;
  }
  /// Thins the cameras evenly over the walk.
  static void thin(std::vector<std::uint32_t>& cameras) {
    const std::size_t count = cameras.size();
    if (count <= kCamerasPerCell) return;
    for (std::size_t i = 0; i < kCamerasPerCell; ++i)
      cameras[i] = cameras[(2 * i + 1) * count / (2 * kCamerasPerCell)];
    cameras.resize(kCamerasPerCell);
  }
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cameras_;
};

/// Cumulative areas of the reflecting triangles.
struct AreaLine {
  TriangleMesh mesh;
  std::vector<double> end_m2;  ///< where each triangle ends

  explicit AreaLine(const World& world) {
    World returning;
    for (const WorldPart& part : world.parts)
      if (part.material.reflectance == Reflectance::kNormal) returning.parts.push_back(part);
    mesh = merged_mesh(returning);
    double at = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      at += 0.5 * cross(i).norm();
      end_m2.push_back(at);
    }
  }
  [[nodiscard]] Vec3 corner(std::size_t triangle, std::size_t k) const {
    return mesh.vertices[mesh.triangles[triangle][k]].cast<double>();
  }
  [[nodiscard]] Vec3 cross(std::size_t t) const {
    return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
  }
  [[nodiscard]] double area_m2() const { return end_m2.empty() ? 0 : end_m2.back(); }
  /// Samples a point of a triangle, uniform by area.
  [[nodiscard]] Vec3 sample(std::size_t t, Rng& rng) const {
    const double root = std::sqrt(rng.uniform()), v = rng.uniform();
    return (1 - root) * corner(t, 0) + root * (1 - v) * corner(t, 1) + root * v * corner(t, 2);
  }
};

bool camera_sees(const Renderer& renderer, const VisibilityParams& params, const SE3& pose, const Vec3& p,
                 const Vec3& normal) {
  const Vec3 to_camera = pose.translation() - p;
  if (normal.dot(to_camera) < std::cos(params.grazing_limit_rad) * to_camera.norm()) return false;
  const Vec3 p_camera = pose.rotation().transpose() * -to_camera;
  if (p_camera.z() < params.min_depth_m || p_camera.z() > params.max_depth_m) return false;
  if (!params.camera.contains(params.camera.project(p_camera))) return false;
  return renderer.is_free(pose.translation(), p, kMargin_m);
}

}  // namespace

SurfacePoints visible_surface_points(const World& world, std::span<const SE3> T_world_cameras,
                                     const VisibilityParams& params, const ParallelLoop& loop) {
  HM_CHECK(params.spacing_m > 0, "spacing_m = {}", params.spacing_m);
  const Renderer renderer(world);
  const CellCameras cells(renderer, T_world_cameras, params, loop);
  const AreaLine line(world);
  const double step_m2 = params.spacing_m * params.spacing_m;
  const auto count = static_cast<std::size_t>(line.area_m2() / step_m2);
  std::vector<SurfacePoints> chunks((count + kSamplesPerChunk - 1) / kSamplesPerChunk);
  loop.for_ranges(count, kSamplesPerChunk, [&](std::size_t begin, std::size_t end) {
    Rng rng(params.seed, begin / kSamplesPerChunk);
    SurfacePoints& chunk = chunks[begin / kSamplesPerChunk];
    for (std::size_t i = begin; i < end; ++i) {
      const double at = (static_cast<double>(i) + rng.uniform()) * step_m2;
      const auto found = std::upper_bound(line.end_m2.begin(), line.end_m2.end(), at);
      if (found == line.end_m2.end()) continue;
      const auto triangle = static_cast<std::size_t>(found - line.end_m2.begin());
      const Vec3 p = line.sample(triangle, rng), normal = line.cross(triangle).normalized();
      const std::span<const std::uint32_t> cameras = cells.at(p);
      const bool seen = std::any_of(cameras.begin(), cameras.end(), [&](std::uint32_t camera) {
        return camera_sees(renderer, params, T_world_cameras[camera], p, normal);
      });
      if (!seen) continue;
      chunk.positions.push_back(p.cast<float>());
      chunk.normals.push_back(normal.cast<float>());
    }
  });
  SurfacePoints all;
  for (const SurfacePoints& chunk : chunks) {
    all.positions.insert(all.positions.end(), chunk.positions.begin(), chunk.positions.end());
    all.normals.insert(all.normals.end(), chunk.normals.begin(), chunk.normals.end());
  }
  return all;
}

}  // namespace hm
