#include "hm/report/map_figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_set>

#include "hm/core/statistics.hpp"
#include "hm/geometry/level/up_direction.hpp"
#include "hm/report/render/canvas.hpp"
#include "hm/report/render/color_map.hpp"

namespace hm {
namespace {

constexpr Rgb8 kPaper{250, 250, 248}, kFreeColor{250, 250, 248}, kUnknownColor{205, 207, 210},
    kOccupiedColor{30, 34, 44}, kInk{45, 50, 60};
constexpr int kLongestSide_px = 1400, kMargin_px = 12;
constexpr double kTextSize_px = 15;

using Cell = std::array<std::int32_t, 3>;
struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (const std::int32_t part : cell)
      hash = (hash ^ static_cast<std::uint32_t>(part)) * 0x9E3779B97F4A7C15ull, hash ^= hash >> 29;
    return static_cast<std::size_t>(hash);
  }
};

Cell cell_of(const OccupancyVoxel& voxel, double size_m) {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis)
    cell[static_cast<std::size_t>(axis)] =
        static_cast<std::int32_t>(std::floor(static_cast<double>(voxel.p_world_centre[axis]) / size_m));
  return cell;
}

/// Maps heights to colours, robust against outlier voxels.
struct HeightColors {
  double low = 0, high = 1;
  explicit HeightColors(std::span<const OccupancyVoxel> voxels) {
    std::vector<double> heights;
    for (const OccupancyVoxel& voxel : voxels)
      if (voxel.state == Occupancy::kOccupied)
        heights.push_back(static_cast<double>(voxel.p_world_centre.z()));
    low = quantile(heights, 0.02);
    high = std::max(quantile(std::move(heights), 0.98), low + 1e-3);
  }
  [[nodiscard]] Rgb8 at(double height) const {
    return to_rgb8(sequential_color(0.08 + 0.84 * std::clamp((height - low) / (high - low), 0.0, 1.0)));
  }
};

/// Corners of a cube's face towards +axis or -axis, counter-clockwise from outside.
std::array<Eigen::Vector3f, 4> face_corners(const Eigen::Vector3f& centre, int axis, float sign, float half) {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero(), u = normal, v = normal;
  normal[axis] = sign, u[(axis + 1) % 3] = 1, v[(axis + 2) % 3] = sign;
  const Eigen::Vector3f middle = centre + half * normal;
  return {middle - half * u - half * v, middle + half * u - half * v, middle + half * u + half * v,
          middle - half * u + half * v};
}

struct PlanFrame {
  double scale = 1;  // pixels per cell
  int columns = 0, rows = 0;
  [[nodiscard]] int width() const { return static_cast<int>(std::lround(columns * scale)); }
  [[nodiscard]] int height() const { return static_cast<int>(std::lround(rows * scale)); }
};

PlanFrame plan_frame(int columns, int rows) {
  const double scale = static_cast<double>(kLongestSide_px) / std::max(columns, rows);
  return {std::min(scale >= 1 ? std::floor(scale) : scale, 12.0), columns, rows};
}

/// Draws a scale bar of a round length in the lower left corner.
void draw_plan_scale_bar(Image<Rgb8>& image, double pixels_per_m) {
  double length_m = 1;
  for (const double next : {2.0, 5.0, 10.0, 20.0, 50.0, 100.0})
    if (next * pixels_per_m < 0.3 * image.width()) length_m = next;
  const double y = image.height() - kMargin_px - 6.0, right = kMargin_px + length_m * pixels_per_m;
  const Ink ink{kInk, 1};
  fill_rectangle(image, {Vec2(kMargin_px - 6, y - 26), Vec2(right + 6, y + 8)}, {kPaper, 0.8});
  draw_line(image, {kMargin_px, y}, {right, y}, 3, ink);
  draw_text(image, {kMargin_px, y - 8}, fmt::format("{:g} m", length_m),
            {kTextSize_px, ink, TextAlign::kLeft});
}

void draw_path(Image<Rgb8>& image, const MapOverlay& overlay, const OccupancyGrid2D& grid, double scale) {
  std::optional<Vec2> last;
  for (const StampedPose& pose : *overlay.path) {
    const Vec2 cell = (pose.T_world_base.translation().head<2>() - grid.origin_m) / grid.resolution_m;
    const Vec2 at(cell.x() * scale, image.height() - 1 - cell.y() * scale);
    if (last && (at - *last).norm() < 1.5) continue;
    if (last) draw_line(image, *last, at, 2, {overlay.color, 0.9});
    if (!last) fill_circle(image, at, 6, {overlay.color, 1});
    last = at;
  }
}

void draw_height_legend(Image<Rgb8>& image, const HeightColors& colors) {
  constexpr int kSteps = 120;
  const double left = kMargin_px, top = kMargin_px + 24.0;
  fill_rectangle(image, {Vec2(left - 6, 4), Vec2(left + 96, top + kSteps + 14)}, {kPaper, 0.85});
  draw_text(image, {left, top - 10}, "height (m)", {kTextSize_px, {kInk, 1}, TextAlign::kLeft});
  for (int i = 0; i < kSteps; ++i) {
    const double height = colors.high - (colors.high - colors.low) * i / (kSteps - 1);
    fill_rectangle(image, {Vec2(left, top + i), Vec2(left + 18, top + i + 1)}, {colors.at(height), 1});
  }
  for (const auto& [value, y] : {std::pair(colors.high, top + 12), std::pair(colors.low, top + kSteps)})
    draw_text(image, {left + 26, y}, fmt::format("{:.1f}", value),
              {kTextSize_px, {kInk, 1}, TextAlign::kLeft});
}

/// The occupied voxels in a frame with z up, each as its eight eighths, so that no column stays empty.
std::vector<OccupancyVoxel> levelled(std::span<const OccupancyVoxel> voxels, double size_m, const Vec3& up) {
  const Eigen::Matrix3f R_level_map = rotation_to_z_up(up).cast<float>();
  const auto quarter = static_cast<float>(0.25 * size_m);
  std::vector<OccupancyVoxel> out;
  for (const OccupancyVoxel& voxel : voxels)
    for (int part = 0; part < 8 && voxel.state == Occupancy::kOccupied; ++part) {
      const Eigen::Vector3f offset((part & 1) != 0 ? quarter : -quarter, (part & 2) != 0 ? quarter : -quarter,
                                   (part & 4) != 0 ? quarter : -quarter);
      out.push_back(voxel);
      out.back().p_world_centre = R_level_map * (voxel.p_world_centre + offset);
    }
  return out;
}

}  // namespace

std::vector<HtmlReport::Swatch> legend_of(std::span<const MapOverlay> paths) {
  std::vector<HtmlReport::Swatch> legend;
  for (const MapOverlay& path : paths)
    legend.push_back(
        {fmt::format("#{:02x}{:02x}{:02x}", path.color.r, path.color.g, path.color.b), path.name});
  return legend;
}

void set_scale(Figure& figure, double metres) {
  if (!(metres > 0)) return;
  double length_m = 0.01;
  for (const double next : {0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0})
    if (next <= 0.33 * metres) length_m = next;
  figure.scale_m = length_m, figure.scale_ratio = length_m / metres;
}

TriangleMesh occupied_faces(std::span<const OccupancyVoxel> voxels, double size_m) {
  std::unordered_set<Cell, CellHash> occupied;
  for (const OccupancyVoxel& voxel : voxels)
    if (voxel.state == Occupancy::kOccupied) occupied.insert(cell_of(voxel, size_m));
  const HeightColors colors(voxels);
  TriangleMesh mesh;
  const auto half = static_cast<float>(size_m / 2);
  for (const OccupancyVoxel& voxel : voxels) {
    if (voxel.state != Occupancy::kOccupied) continue;
    for (std::size_t face = 0; face < 6; ++face) {
      const std::size_t axis = face / 2;
      const bool positive = face % 2 == 0;
      Cell beside = cell_of(voxel, size_m);
      beside[axis] += positive ? 1 : -1;
      if (occupied.contains(beside)) continue;
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const auto& corner :
           face_corners(voxel.p_world_centre, static_cast<int>(axis), positive ? 1.0F : -1.0F, half)) {
        mesh.vertices.push_back(corner);
        mesh.colors.push_back(colors.at(static_cast<double>(voxel.p_world_centre.z())));
      }
      mesh.triangles.push_back({first, first + 1, first + 2});
      mesh.triangles.push_back({first, first + 2, first + 3});
    }
  }
  return mesh;
}

std::optional<Image<Rgb8>> draw_occupancy_grid(const OccupancyGrid2D& grid,
                                               std::span<const MapOverlay> paths) {
  if (grid.cells.empty()) return std::nullopt;
  const PlanFrame frame = plan_frame(grid.cells.width(), grid.cells.height());
  Image<Rgb8> image(std::max(frame.width(), 1), std::max(frame.height(), 1), kUnknownColor);
  std::vector<Occupancy> shown(image.size(), Occupancy::kUnknown);
  for (int y = 0; y < grid.cells.height(); ++y)
    for (int x = 0; x < grid.cells.width(); ++x) {
      const Occupancy state = grid.state(x, y, 33);
      const int left = static_cast<int>(x * frame.scale), right = static_cast<int>((x + 1) * frame.scale);
      const int low = static_cast<int>(y * frame.scale), high = static_cast<int>((y + 1) * frame.scale);
      // A figure smaller than the grid shows the strongest of the cells that share a pixel.
      for (int v = low; v < std::max(high, low + 1); ++v)
        for (int u = left; u < std::max(right, left + 1); ++u) {
          const int row = image.height() - 1 - v;
          if (!image.contains(u, row)) continue;
          auto& known = shown[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width()) +
                              static_cast<std::size_t>(u)];
          if (state <= known) continue;
          known = state;
          image(u, row) = state == Occupancy::kOccupied ? kOccupiedColor : kFreeColor;
        }
    }
  for (const MapOverlay& overlay : paths) draw_path(image, overlay, grid, frame.scale);
  return image;
}

std::optional<Image<Rgb8>> draw_heights(std::span<const OccupancyVoxel> voxels, double size_m,
                                        const Vec3& up) {
  if (up != Vec3::UnitZ()) return draw_heights(levelled(voxels, size_m, up), size_m);
  std::map<std::pair<int, int>, float> highest;
  for (const OccupancyVoxel& voxel : voxels) {
    if (voxel.state != Occupancy::kOccupied) continue;
    const Cell cell = cell_of(voxel, size_m);
    const auto [place, fresh] = highest.try_emplace({cell[0], cell[1]}, voxel.p_world_centre.z());
    if (!fresh) place->second = std::max(place->second, voxel.p_world_centre.z());
  }
  if (highest.empty()) return std::nullopt;
  int min_y = highest.begin()->first.second, max_y = min_y;
  for (const auto& [cell, height] : highest)
    min_y = std::min(min_y, cell.second), max_y = std::max(max_y, cell.second);
  const int min_x = highest.begin()->first.first, max_x = highest.rbegin()->first.first;
  const HeightColors colors(voxels);
  const PlanFrame frame = plan_frame(max_x - min_x + 1, max_y - min_y + 1);
  Image<Rgb8> image(std::max(frame.width(), 1), std::max(frame.height(), 1), kPaper);
  for (const auto& [cell, height] : highest) {
    const double x = (cell.first - min_x) * frame.scale,
                 y = image.height() - (cell.second - min_y) * frame.scale;
    fill_rectangle(image, {Vec2(x - 0.5, y - frame.scale - 0.5), Vec2(x + frame.scale - 0.5, y - 0.5)},
                   {colors.at(static_cast<double>(height)), 1});
  }
  draw_height_legend(image, colors);
  draw_plan_scale_bar(image, frame.scale / size_m);
  return image;
}

}  // namespace hm
