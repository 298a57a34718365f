#include "hm/report/render/rasteriser.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr int kBandRows = 32;  // samples
/// Number of triangles that are projected and sorted into bands at a time.
constexpr std::size_t kTrianglesAtOnce = 125'000;

/// Position of a projected vertex relative to the clipping planes; kInside: not clipped.
enum class VertexSide : std::uint8_t { kInside, kBehindNear, kAboveCut, kBroken };
struct ScreenVertex {
  float x = 0, y = 0, nearness = 0;
  VertexSide side = VertexSide::kBroken;
};

/// Some of a mesh's vertices on the screen.
struct ScreenVertices {
  std::size_t first = 0;
  std::vector<ScreenVertex> values;
  [[nodiscard]] bool contains(std::uint32_t index) const { return index - first < values.size(); }
  [[nodiscard]] const ScreenVertex& operator[](std::uint32_t index) const { return values[index - first]; }
};

/// Triangles [begin, end) of a mesh.
struct TriangleRange {
  std::size_t begin = 0, end = 0;
};

/// Projects the range of vertices used by these triangles. (A reconstructed mesh is spatially ordered, so
/// that the range contains few unused ones.)
ScreenVertices project_vertices(const TriangleMesh& mesh, const TriangleRange& range, const RenderView& view,
                                const ViewProjection& projection, const ParallelLoop& loop) {
  std::size_t low = mesh.vertices.size(), high = 0;
  for (std::size_t i = range.begin; i < range.end; ++i)
    for (const std::uint32_t index : mesh.triangles[i]) {
      if (index >= mesh.vertices.size()) continue;
      low = std::min<std::size_t>(low, index);
      high = std::max<std::size_t>(high, index + std::size_t{1});
    }
  ScreenVertices screen{low, std::vector<ScreenVertex>(low < high ? high - low : 0)};
  std::vector<ScreenVertex>& out = screen.values;
  loop.for_ranges(out.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = mesh.vertices[low + i].cast<double>();
      if (!(p.cwiseAbs().maxCoeff() < 1e9)) continue;  // not finite, or implausible
      const Vec3 p_camera = projection.to_camera(p);
      if (view.cut_height_m && view.up.dot(p) > *view.cut_height_m) {
        out[i].side = VertexSide::kAboveCut;
      } else if (p_camera.z() < projection.near_m()) {
        out[i].side = VertexSide::kBehindNear;
      } else {
        const Vec3 at = projection.project(p_camera);
        out[i] = {static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z()),
                  VertexSide::kInside};
      }
    }
  });
  return screen;
}

/// Clips a convex polygon to distance(p) >= 0.
template <class Distance>
std::vector<Vec3> clip(const std::vector<Vec3>& polygon, Distance&& distance) {
  std::vector<Vec3> out;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = distance(a), db = distance(b);
    if (da >= 0) out.push_back(a);
    if ((da >= 0) != (db >= 0)) out.push_back(a + da / (da - db) * (b - a));
  }
  return out;
}

/// Rows [begin, end) of the buffers, written by one thread.
class Band {
 public:
  Band(VisibilityBuffer& buffer, Faces faces, int begin_row, int end_row)
      : buffer_(buffer), faces_(faces), begin_row_(begin_row), end_row_(end_row) {}

  void draw(std::uint32_t index, ScreenVertex a, ScreenVertex b, ScreenVertex c) {
    double area = edge(a, b, c.x, c.y);
    if (area == 0 || !std::isfinite(area)) return;
    // Counter-clockwise seen from outside is clockwise on a screen with y down: a negative area here.
    if (area > 0 && faces_ == Faces::kFront) return;
    if (area < 0) {
      std::swap(b, c);
      area = -area;
    }
    const int y0 = std::max(begin_row_, ceil_to(std::min({a.y, b.y, c.y}), end_row_));
    const int y1 = std::min(end_row_ - 1, floor_to(std::max({a.y, b.y, c.y}), end_row_));
    const int x0 = std::max(0, ceil_to(std::min({a.x, b.x, c.x}), buffer_.nearness.width()));
    const int x1 =
        std::min(buffer_.nearness.width() - 1, floor_to(std::max({a.x, b.x, c.x}), buffer_.nearness.width()));
    const double inverse_area = 1 / area;
    for (int y = y0; y <= y1; ++y) {
      float* nearness_row = buffer_.nearness.row(y).data();
      std::uint32_t* triangle_row = buffer_.triangle.row(y).data();
      for (int x = x0; x <= x1; ++x) {
        const double wa = edge(b, c, x, y), wb = edge(c, a, x, y), wc = edge(a, b, x, y);
        if (wa < 0 || wb < 0 || wc < 0) continue;
        const auto nearness =
            static_cast<float>((wa * static_cast<double>(a.nearness) + wb * static_cast<double>(b.nearness) +
                                wc * static_cast<double>(c.nearness)) *
                               inverse_area);
        if (!(nearness > nearness_row[x])) continue;
        nearness_row[x] = nearness;
        triangle_row[x] = index;
      }
    }
  }

 private:
  static double edge(const ScreenVertex& p, const ScreenVertex& q, double x, double y) {
    const auto px = static_cast<double>(p.x), py = static_cast<double>(p.y);
    return (static_cast<double>(q.x) - px) * (y - py) - (static_cast<double>(q.y) - py) * (x - px);
  }
  static int ceil_to(float v, int limit) {
    return static_cast<int>(std::ceil(std::clamp(v, -1.F, static_cast<float>(limit) + 1)));
  }
  static int floor_to(float v, int limit) {
    return static_cast<int>(std::floor(std::clamp(v, -1.F, static_cast<float>(limit) + 1)));
  }

  VisibilityBuffer& buffer_;
  Faces faces_;
  int begin_row_, end_row_;
};

enum class Fate : std::uint8_t { kDropped, kWhole, kClipped };

/// Data shared by all bands of an image.
struct Scene {
  const TriangleMesh& mesh;
  const RenderView& view;
  const ViewProjection& projection;
  TriangleRange range;
  ScreenVertices vertices;

  [[nodiscard]] Fate fate(const std::array<std::uint32_t, 3>& t) const {
    if (!vertices.contains(t[0]) || !vertices.contains(t[1]) || !vertices.contains(t[2]))
      return Fate::kDropped;
    const VertexSide a = vertices[t[0]].side, b = vertices[t[1]].side, c = vertices[t[2]].side;
    if (a == VertexSide::kBroken || b == VertexSide::kBroken || c == VertexSide::kBroken)
      return Fate::kDropped;
    if (a == b && b == c) return a == VertexSide::kInside ? Fate::kWhole : Fate::kDropped;
    return Fate::kClipped;
  }

  void draw_clipped(Band& band, std::uint32_t index) const {
    std::vector<Vec3> polygon;
    for (const std::uint32_t i : mesh.triangles[index]) polygon.push_back(mesh.vertices[i].cast<double>());
    if (view.cut_height_m)
      polygon = clip(polygon, [&](const Vec3& p) { return *view.cut_height_m - view.up.dot(p); });
    for (Vec3& p : polygon) p = projection.to_camera(p);
    polygon = clip(polygon, [&](const Vec3& p) { return p.z() - projection.near_m(); });
    std::vector<ScreenVertex> screen;
    for (const Vec3& p : polygon) {
      const Vec3 s = projection.project(p);
      screen.push_back({static_cast<float>(s.x()), static_cast<float>(s.y()), static_cast<float>(s.z()),
                        VertexSide::kInside});
    }
    for (std::size_t i = 2; i < screen.size(); ++i) band.draw(index, screen[0], screen[i - 1], screen[i]);
  }
};

/// Lists for each band the triangles that may touch it, in order.
std::vector<std::vector<std::uint32_t>> sort_into_bands(const Scene& scene, int rows) {
  const int bands = (rows + kBandRows - 1) / kBandRows;
  std::vector<std::vector<std::uint32_t>> out(static_cast<std::size_t>(bands));
  for (std::size_t i = scene.range.begin; i < scene.range.end; ++i) {
    const auto& t = scene.mesh.triangles[i];
    const Fate fate = scene.fate(t);
    if (fate == Fate::kDropped) continue;
    int first = 0, last = bands - 1;
    if (fate == Fate::kWhole) {
      const float ya = scene.vertices[t[0]].y, yb = scene.vertices[t[1]].y, yc = scene.vertices[t[2]].y;
      const auto limit = static_cast<float>(rows + kBandRows);
      const float low = std::ceil(std::clamp(std::min({ya, yb, yc}), -1.F, limit));
      const float high = std::floor(std::clamp(std::max({ya, yb, yc}), -1.F, limit));
      if (high < low || high < 0) continue;
      first = std::max(0, static_cast<int>(low)) / kBandRows;
      last = std::min(bands - 1, static_cast<int>(high) / kBandRows);
    }
    for (int band = first; band <= last; ++band)
      out[static_cast<std::size_t>(band)].push_back(static_cast<std::uint32_t>(i));
  }
  return out;
}

void draw(const Scene& scene, VisibilityBuffer& buffer, const ParallelLoop& loop) {
  const int rows = buffer.nearness.height();
  const auto bands = sort_into_bands(scene, rows);
  loop.for_ranges(bands.size(), 1, [&](std::size_t begin, std::size_t) {
    const int first_row = static_cast<int>(begin) * kBandRows;
    Band band(buffer, scene.view.faces, first_row, std::min(rows, first_row + kBandRows));
    for (const std::uint32_t index : bands[begin]) {
      const auto& t = scene.mesh.triangles[index];
      if (scene.fate(t) == Fate::kWhole)
        band.draw(index, scene.vertices[t[0]], scene.vertices[t[1]], scene.vertices[t[2]]);
      else
        scene.draw_clipped(band, index);
    }
  });
}

}  // namespace

ViewProjection::ViewProjection(const RenderView& view, int width, int height, int samples_per_px)
    : T_world_camera_(view.T_world_camera),
      T_camera_world_(view.T_world_camera.inverse()),
      orthographic_(view.projection == Projection::kOrthographic),
      scale_((orthographic_ ? view.pixels_per_m : view.focal_px) * samples_per_px),
      centre_(0.5 * width * samples_per_px - 0.5, 0.5 * height * samples_per_px - 0.5) {}

Vec3 ViewProjection::unproject(double x, double y, double nearness) const {
  const double z = orthographic_ ? -nearness : 1 / nearness;
  const double across = orthographic_ ? 1 / scale_ : z / scale_;
  return T_world_camera_ * Vec3((x - centre_.x()) * across, (y - centre_.y()) * across, z);
}

Vec3 ViewProjection::towards_viewer(const Vec3& p_world) const {
  if (orthographic_) return -T_world_camera_.rotation().col(2);
  return (T_world_camera_.translation() - p_world).normalized();
}

VisibilityBuffer rasterise(const TriangleMesh& mesh, const RenderView& view, const ViewProjection& projection,
                           const RenderOptions& size_in_samples, const ParallelLoop& loop) {
  const int columns = size_in_samples.width, rows = size_in_samples.height;
  VisibilityBuffer buffer{Image<float>(columns, rows, std::numeric_limits<float>::lowest()),
                          Image<std::uint32_t>(columns, rows, kNoTriangle)};
  for (std::size_t begin = 0; begin < mesh.triangles.size(); begin += kTrianglesAtOnce) {
    const TriangleRange range{begin, std::min(begin + kTrianglesAtOnce, mesh.triangles.size())};
    const Scene scene{mesh, view, projection, range, project_vertices(mesh, range, view, projection, loop)};
    draw(scene, buffer, loop);
  }
  return buffer;
}

Vec3 barycentric(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double bb = ab.dot(ab), bc = ab.dot(ac), cc = ac.dot(ac), pb = ap.dot(ab), pc = ap.dot(ac);
  const double determinant = bb * cc - bc * bc;
  if (!(determinant > 0)) return Vec3::Constant(1.0 / 3);
  Vec3 weights;
  weights.y() = (cc * pb - bc * pc) / determinant;
  weights.z() = (bb * pc - bc * pb) / determinant;
  weights.x() = 1 - weights.y() - weights.z();
  weights = weights.cwiseMax(0.0).cwiseMin(1.0);
  return weights / weights.sum();
}

}  // namespace hm
