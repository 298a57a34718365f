#include "hm/report/model_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "hm/core/statistics.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/render/color_map.hpp"

namespace hm {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint32_t kUnseen = std::numeric_limits<std::uint32_t>::max();

/// The triangles as the view reads them: vertices numbered in the order of their first use.
struct PackedTriangles {
  Bytes bytes;
  std::vector<std::uint32_t> order;  ///< packed vertex -> vertex of the mesh
  std::size_t index_count = 0;
};

void append_varint(Bytes& bytes, std::uint32_t value) {
  for (; value > 127; value >>= 7U) bytes.push_back(static_cast<std::uint8_t>(128U | (value & 127U)));
  bytes.push_back(static_cast<std::uint8_t>(value));
}

PackedTriangles pack_triangles(const TriangleMesh& mesh) {
  PackedTriangles packed;
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnseen);
  const auto is_drawable = [&](std::uint32_t v) { return v < number.size() && mesh.vertices[v].allFinite(); };
  for (const auto& triangle : mesh.triangles) {
    if (!std::all_of(triangle.begin(), triangle.end(), is_drawable)) continue;
    for (const std::uint32_t vertex : triangle) {
      const auto next = static_cast<std::uint32_t>(packed.order.size());
      const bool first = number[vertex] == kUnseen;
      if (first) number[vertex] = next, packed.order.push_back(vertex);
      append_varint(packed.bytes, next - number[vertex]);
      ++packed.index_count;
    }
  }
  return packed;
}

void append_point(Bytes& bytes, const Vec3& point, const Box3& box) {
  for (int axis = 0; axis < 3; ++axis) {
    const double share = (point[axis] - box.min()[axis]) / std::max(box.sizes()[axis], 1e-9);
    const auto step = static_cast<unsigned>(std::lround(65535 * std::clamp(share, 0.0, 1.0)));
    bytes.push_back(static_cast<std::uint8_t>(step & 255U));
    bytes.push_back(static_cast<std::uint8_t>(step >> 8U));
  }
}

std::uint8_t error_byte(float error_m, double limit_m) {
  if (!std::isfinite(error_m)) return 255;
  return static_cast<std::uint8_t>(
      std::lround(127 + 127 * std::clamp(static_cast<double>(error_m) / limit_m, -1.0, 1.0)));
}

/// 95 % of the errors are smaller.
double error_limit_m(const std::vector<float>& errors_m) {
  std::vector<double> sizes;
  for (const float error : errors_m)
    if (std::isfinite(error)) sizes.push_back(std::abs(static_cast<double>(error)));
  return sizes.empty() ? 1e-3 : std::max(quantile(std::move(sizes), 0.95), 1e-4);
}

/// 32 colours as "rrggbb" in a row.
template <class ColorMap>
std::string color_row(ColorMap&& color_of) {
  std::string row;
  for (int i = 0; i < 32; ++i) {
    const Rgb8 color = to_rgb8(color_of(i / 31.0));
    row += fmt::format("{:02x}{:02x}{:02x}", color.r, color.g, color.b);
  }
  return row;
}

std::string json_of(const Vec3& v) { return fmt::format("[{:.4f},{:.4f},{:.4f}]", v.x(), v.y(), v.z()); }

/// Heights at the ends of the colours: the scene below the ceiling.
std::array<double, 2> height_range(const SceneExtent& extent) {
  const double low = extent.box.min().z(), high = extent.box.max().z();
  return {low, std::max(extent.ceiling_m ? std::min(*extent.ceiling_m, high) : high, low + 1e-3)};
}

}  // namespace

std::vector<Vec3> path_points(const Trajectory& trajectory, std::size_t most) {
  std::vector<Vec3> points;
  const std::size_t step =
      std::max<std::size_t>(1, (trajectory.size() + most - 1) / std::max<std::size_t>(most, 1));
  for (std::size_t i = 0; i < trajectory.size(); i += step) {
    const Vec3& point = trajectory[i].T_world_base.translation();
    if (point.allFinite()) points.push_back(point);
  }
  return points;
}

std::string model_view_html(const ModelView& view) {
  const PackedTriangles packed = pack_triangles(view.mesh);
  if (packed.index_count == 0) return {};
  const Mat3 to_scene = view.extent.T_world_scene.rotation().transpose();
  Box3 box;
  for (const std::uint32_t vertex : packed.order)
    box.extend(to_scene * view.mesh.vertices[vertex].cast<double>());
  for (const Vec3& point : view.path) box.extend(to_scene * point);
  Bytes points, colors, errors, path;
  const bool has_errors = view.errors_m.size() == view.mesh.vertices.size();
  const double limit_m = has_errors ? error_limit_m(view.errors_m) : 0;
  for (const std::uint32_t vertex : packed.order) {
    append_point(points, to_scene * view.mesh.vertices[vertex].cast<double>(), box);
    if (view.mesh.has_colors()) {
      const Rgb8 color = view.mesh.colors[vertex];
      colors.insert(colors.end(), {color.r, color.g, color.b});
    }
    if (has_errors) errors.push_back(error_byte(view.errors_m[vertex], limit_m));
  }
  for (const Vec3& point : view.path) append_point(path, to_scene * point, box);
  const auto [bottom, top] = height_range(view.extent);
  const double cut = view.extent.ceiling_m ? *view.extent.ceiling_m - 0.12 : 1e9;
  std::string json = fmt::format(
      R"({{"low":{},"high":{},"box":[{},{}],"floor":{:.4f},"cut":{:.4f},"heights":[{:.4f},{:.4f}],)"
      R"("error_limit_m":{:.6f},"index_count":{},"maps":{{"height":"{}","error":"{}"}},)",
      json_of(box.min()), json_of(box.max()), json_of(view.extent.box.min()), json_of(view.extent.box.max()),
      view.extent.floor_m, cut, bottom, top, limit_m, packed.index_count,
      color_row([](double t) { return sequential_color(0.08 + 0.84 * t); }),
      color_row([](double t) { return diverging_color(2 * t - 1); }));
  for (const auto& [key, bytes] : {std::pair{"points", &points}, std::pair{"colors", &colors},
                                   std::pair{"errors", &errors}, std::pair{"path", &path}})
    json += fmt::format(R"("{}":"{}",)", key, base64(*bytes));
  json += fmt::format(R"("indices":"{}"}})", base64(packed.bytes));
  return fmt::format(
      "<div class=\"model\" hidden=\"\"><canvas tabindex=\"0\" role=\"img\" aria-label=\"The model; arrow "
      "keys turn "
      "it\"></canvas><script type=\"application/json\">{}</script></div>\n",
      json);
}

}  // namespace hm
