#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/geometry/level/scene_up.hpp"
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {
namespace {

/// Refines the up direction towards the mean normal of the surfaces that roughly face it.
Vec3 refine_up(const std::vector<SurfacePatch>& facets, Vec3 up) {
  for (const double within_deg : {25.0, 12.0, 6.0}) {
    Vec3 sum = Vec3::Zero();
    for (const SurfacePatch& f : facets) {
      const double cosine = f.normal.dot(up);
      if (std::abs(cosine) > std::cos(within_deg * M_PI / 180))
        sum += f.area * (cosine < 0 ? -1 : 1) * f.normal;
    }
    if (sum.norm() > 0) up = sum.normalized();
  }
  return up;
}

/// Axes along most walls: the angle about up, modulo 90 degrees, from the area-weighted mean of four times
/// the angle of their normals.
Mat3 wall_axes(const std::vector<SurfacePatch>& facets, const Vec3& up) {
  const Vec3 helper = std::abs(up.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 east = (helper - helper.dot(up) * up).normalized(), north = up.cross(east);
  double cosine = 0, sine = 0;
  for (const SurfacePatch& f : facets) {
    if (std::abs(f.normal.dot(up)) > 0.3) continue;
    const double angle = 4 * std::atan2(f.normal.dot(north), f.normal.dot(east));
    cosine += f.area * std::cos(angle);
    sine += f.area * std::sin(angle);
  }
  const double angle = cosine == 0 && sine == 0 ? 0 : std::atan2(sine, cosine) / 4;
  Mat3 axes;
  axes.col(0) = std::cos(angle) * east + std::sin(angle) * north;
  axes.col(2) = up;
  axes.col(1) = up.cross(axes.col(0));
  return axes;
}

/// Area of the surfaces that face up (or down) in steps of height.
std::vector<double> level_areas(const std::vector<SurfacePatch>& facets, const Vec3& direction,
                                const Vec3& up, const std::pair<double, double>& heights) {
  constexpr double kStep = 0.05;
  std::vector<double> areas(
      static_cast<std::size_t>(std::clamp((heights.second - heights.first) / kStep, 0.0, 1e5)) + 2);
  for (const SurfacePatch& f : facets) {
    const double bin = (f.centre.dot(up) - heights.first) / kStep;
    if (f.normal.dot(direction) > 0.8 && bin >= 0 && bin < static_cast<double>(areas.size()))
      areas[static_cast<std::size_t>(bin)] += f.area;
  }
  std::vector<double> smooth(areas.size());  // a level may lie between two bins
  for (std::size_t i = 0; i < areas.size(); ++i)
    smooth[i] = areas[i] + (i > 0 ? areas[i - 1] : 0) + (i + 1 < areas.size() ? areas[i + 1] : 0);
  return smooth;
}

/// The mean height of the surfaces that face this way close to a level.
double refine_level(const std::vector<SurfacePatch>& facets, const Vec3& direction, const Vec3& up,
                    double level_m) {
  double sum = 0, area = 0;
  for (const SurfacePatch& f : facets) {
    const double height = f.centre.dot(up);
    if (f.normal.dot(direction) <= 0.8 || std::abs(height - level_m) > 0.12) continue;
    sum += f.area * height;
    area += f.area;
  }
  return area > 0 ? sum / area : level_m;
}

void find_floor_and_ceiling(const std::vector<SurfacePatch>& facets, SceneExtent& extent) {
  const double low = extent.box.min().z(), high = extent.box.max().z();
  extent.floor_m = low;
  const std::vector<double> up_areas = level_areas(facets, extent.up, extent.up, {low, high});
  const std::vector<double> down_areas = level_areas(facets, -extent.up, extent.up, {low, high});
  const auto height = [&](std::size_t bin) { return low + 0.05 * (static_cast<double>(bin) + 0.5); };
  // The floor is the lowest level that is not small beside the largest one.
  const double largest = *std::max_element(up_areas.begin(), up_areas.end());
  if (!(largest > 0)) return;
  std::size_t floor = 0;
  while (up_areas[floor] < 0.4 * largest) ++floor;
  while (floor + 1 < up_areas.size() && up_areas[floor + 1] > up_areas[floor]) ++floor;
  extent.floor_m = refine_level(facets, extent.up, extent.up, height(floor));
  const auto ceiling = std::max_element(down_areas.begin(), down_areas.end());
  const double ceiling_m = refine_level(facets, -extent.up, extent.up,
                                        height(static_cast<std::size_t>(ceiling - down_areas.begin())));
  if (ceiling_m > extent.floor_m + 1.8 && *ceiling > 0.25 * up_areas[floor]) extent.ceiling_m = ceiling_m;
}

Box3 percentile_box(const std::vector<Vec3>& points, const Mat3& axes) {
  Box3 box;
  std::array<std::vector<double>, 3> along;
  for (const Vec3& p : points)
    for (int k = 0; k < 3; ++k) along[static_cast<std::size_t>(k)].push_back(axes.col(k).dot(p));
  Vec3 low, high;
  for (int k = 0; k < 3; ++k) {
    low[k] = quantile(along[static_cast<std::size_t>(k)], 0.002);
    high[k] = quantile(along[static_cast<std::size_t>(k)], 0.998);
  }
  const Vec3 padding = Vec3::Constant(0.005 * (high - low).maxCoeff() + 1e-3);
  return {low - padding, high + padding};
}

/// A camera that looks along `forward`, upright.
Mat3 camera_axes(const Vec3& forward, const Vec3& up) {
  Mat3 axes;
  axes.col(2) = forward.normalized();
  axes.col(0) = forward.cross(up).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

/// Nearest camera position from which all points lie within the given slopes: the intersection of the two
/// bounding lines in each image direction.
Vec3 fit_camera(const std::vector<Vec3>& points, const Mat3& axes, const Vec2& slopes) {
  Vec3 place(0, 0, std::numeric_limits<double>::infinity());
  for (int k = 0; k < 2; ++k) {
    double low = -std::numeric_limits<double>::infinity(), high = low;
    for (const Vec3& p : points) {
      const double across = axes.col(k).dot(p), ahead = axes.col(2).dot(p);
      high = std::max(high, across - slopes[k] * ahead);
      low = std::max(low, -across - slopes[k] * ahead);
    }
    place[k] = 0.5 * (high - low);
    place.z() = std::min(place.z(), -(high + low) / (2 * slopes[k]));
  }
  return axes * place;
}

/// Pixels kept free at the sides of an image.
constexpr double kMarginRatio = 0.04;
/// Of the dollhouse view, from the scene's y axis.
constexpr double kAzimuth = 28 * M_PI / 180;

/// Area of walls that a look into the rooms from the side of the axes' -y shows from their front.
double walls_seen(const std::vector<SurfacePatch>& facets, const Mat3& axes) {
  const Vec3 forward = std::sin(kAzimuth) * axes.col(0) + std::cos(kAzimuth) * axes.col(1);
  double sum = 0;
  for (const SurfacePatch& f : facets)
    if (std::abs(f.normal.dot(axes.col(2))) < 0.3) sum += f.area * std::max(0.0, -f.normal.dot(forward));
  return sum;
}

SceneExtent extent_along(const TriangleMesh& mesh, const std::vector<SurfacePatch>& facets, const Vec3& up) {
  SceneExtent extent;
  extent.up = up;
  const std::vector<Vec3> samples = sample_surface(mesh, 20'000, 1);
  Mat3 axes = wall_axes(facets, extent.up);
  if (samples.empty()) {
    extent.T_world_scene = {axes, Vec3::Zero()};
    extent.box = {Vec3(-1, -1, -1), Vec3(1, 1, 1)};
    return extent;
  }
  extent.box = percentile_box(samples, axes);
  if (extent.box.sizes().y() > extent.box.sizes().x()) {  // x is to be the long side
    const Vec3 x = axes.col(0);
    axes.col(0) = axes.col(1);
    axes.col(1) = -x;
    extent.box = percentile_box(samples, axes);
  }
  // Of rooms that are closed, both sides show as much; of one side of a room, only one shows it from its
  // front.
  constexpr double kClearlyMore = 1.1;
  Mat3 turned = axes;  // by half a turn about up
  turned.leftCols<2>() *= -1;
  if (walls_seen(facets, turned) > kClearlyMore * walls_seen(facets, axes)) {
    axes = turned;
    extent.box = percentile_box(samples, axes);
  }
  extent.T_world_scene = {axes, Vec3::Zero()};
  for (const Vec3& p : samples)
    if (extent.box.contains(axes.transpose() * p)) extent.points.push_back(p);
  find_floor_and_ceiling(facets, extent);
  return extent;
}

}  // namespace

Vec3 up_of_cameras(const Trajectory& trajectory) {
  Vec3 sum = Vec3::Zero();
  for (const StampedPose& pose : trajectory) sum -= pose.T_world_base.rotation().col(1);
  return sum.norm() > 1e-3 * static_cast<double>(trajectory.size()) && sum.allFinite() && !trajectory.empty()
             ? Vec3(sum.normalized())
             : Vec3::UnitZ();
}

SceneExtent scene_extent(const TriangleMesh& mesh, const Vec3& up_hint) {
  const std::vector<SurfacePatch> facets = patches_of(mesh);
  const bool usable_hint = up_hint.allFinite() && up_hint.norm() > 1e-9;
  return extent_along(mesh, facets,
                      refine_up(facets, usable_hint ? Vec3(up_hint.normalized()) : Vec3::UnitZ()));
}

SceneExtent scene_extent_along(const TriangleMesh& mesh, const Vec3& up) {
  return extent_along(mesh, patches_of(mesh), up);
}

RenderView dollhouse_view(const SceneExtent& extent, const RenderOptions& options) {
  RenderView view;
  view.up = extent.up;
  if (extent.ceiling_m) view.cut_height_m = *extent.ceiling_m - 0.12;
  constexpr double kElevation = 52 * M_PI / 180, kFieldOfView = 32 * M_PI / 180;
  const Vec3 forward_scene(std::sin(kAzimuth) * std::cos(kElevation),
                           std::cos(kAzimuth) * std::cos(kElevation), -std::sin(kElevation));
  const Mat3 axes = camera_axes(extent.T_world_scene.rotation() * forward_scene, extent.up);
  view.focal_px = 0.5 * options.width / std::tan(0.5 * kFieldOfView);
  std::vector<Vec3> shown;
  for (const Vec3& p : extent.points)
    if (!view.cut_height_m || extent.up.dot(p) <= *view.cut_height_m) shown.push_back(p);
  if (shown.empty())
    shown = {extent.T_world_scene * extent.box.min(), extent.T_world_scene * extent.box.max()};
  const Vec2 slopes = (0.5 - kMarginRatio) * Vec2(options.width, options.height) / view.focal_px;
  view.T_world_camera = {axes, fit_camera(shown, axes, slopes)};
  return view;
}

RenderView plan_view(const SceneExtent& extent, const RenderOptions& options, double cut_above_floor_m) {
  RenderView view;
  view.projection = Projection::kOrthographic;
  view.up = extent.up;
  view.cut_height_m = extent.floor_m + cut_above_floor_m;
  Mat3 axes;  // x right, y down the page, looking down
  axes.col(0) = extent.T_world_scene.rotation().col(0);
  axes.col(1) = -extent.T_world_scene.rotation().col(1);
  axes.col(2) = -extent.up;
  const Vec3 size = extent.box.sizes();
  const double usable = 1 - 2.2 * kMarginRatio;
  view.pixels_per_m = usable * std::min(options.width / size.x(), options.height / size.y());
  Vec3 centre = extent.box.center();
  centre.z() = std::max(extent.box.max().z(), *view.cut_height_m) + 1;
  view.T_world_camera = {axes, extent.T_world_scene * centre};
  return view;
}

RenderView camera_view(const SE3& T_world_camera, const RenderOptions& options) {
  RenderView view;
  view.T_world_camera = T_world_camera;
  view.focal_px = 0.6 * options.width;
  view.faces = Faces::kBoth;
  return view;
}

}  // namespace hm
