#include "hm/evaluation/surface_distance.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>

#include "hm/evaluation/embree_mesh.hpp"

namespace hm {
namespace {

constexpr std::size_t kGrain = 4096;  // points a range

Vec3 closest_point_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double squared_length = (b - a).squaredNorm();
  if (!(squared_length > 0)) return a;
  return a + std::clamp((p - a).dot(b - a) / squared_length, 0.0, 1.0) * (b - a);
}

/// Closest point for degenerate triangles.
Vec3 closest_point_on_edges(const Vec3& p, const std::array<Vec3, 3>& triangle) {
  Vec3 best = triangle[0];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 candidate = closest_point_on_segment(p, triangle[i], triangle[(i + 1) % 3]);
    if ((candidate - p).squaredNorm() < (best - p).squaredNorm()) best = candidate;
  }
  return best;
}

/// Search radius for Embree's float boxes around a float copy of p, conservative for distance_m.
float safe_radius(const Vec3& p, double distance_m) {
  return static_cast<float>(distance_m * (1 + 1e-5) + 1e-6 * (1 + p.cwiseAbs().maxCoeff()));
}

struct NearestSearch {
  const EmbreeMesh& mesh;
  const Vec3& p;
  double best_squared = std::numeric_limits<double>::infinity();
  std::uint32_t best = 0;

  bool visit(std::uint32_t index) {
    const double squared = (closest_point_on_triangle(p, mesh.corners(index)) - p).squaredNorm();
    if (squared >= best_squared) return false;
    best_squared = squared;
    best = index;
    return true;
  }
};

bool visit_nearest(RTCPointQueryFunctionArguments* arguments) {
  auto& search = *static_cast<NearestSearch*>(arguments->userPtr);
  if (!search.visit(arguments->primID)) return false;
  arguments->query->radius = safe_radius(search.p, std::sqrt(search.best_squared));
  return true;
}

/// Search among the equally close triangles for the one whose normal points most directly towards (or away
/// from) p; ties go to the lowest index.
struct FacingSearch {
  const EmbreeMesh& mesh;
  const Vec3& p;
  double limit_m;
  double best_facing = -1;
  double sign = 1;
  Vec3 point = Vec3::Zero();
  std::uint32_t best = 0;

  void visit(std::uint32_t index) {
    const std::array<Vec3, 3> corners = mesh.corners(index);
    const Vec3 closest = closest_point_on_triangle(p, corners);
    const Vec3 offset = p - closest;
    if (offset.norm() > limit_m) return;
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    const double cosine = normal.dot(offset.normalized());
    const double facing = std::abs(cosine);
    if (facing < best_facing || (facing == best_facing && index > best)) return;
    best_facing = facing;
    sign = cosine < 0 ? -1 : 1;
    point = closest;
    best = index;
  }
};

bool visit_facing(RTCPointQueryFunctionArguments* arguments) {
  static_cast<FacingSearch*>(arguments->userPtr)->visit(arguments->primID);
  return false;
}

template <class Search>
void query(const EmbreeMesh& mesh, Search& search, double radius_m, RTCPointQueryFunction visit) {
  RTCPointQuery point_query{};
  point_query.x = static_cast<float>(search.p.x());
  point_query.y = static_cast<float>(search.p.y());
  point_query.z = static_cast<float>(search.p.z());
  point_query.time = 0;
  point_query.radius =
      std::isinf(radius_m) ? std::numeric_limits<float>::infinity() : safe_radius(search.p, radius_m);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(mesh.scene(), &point_query, &context, visit, &search);
}

/// Nearest triangle within the limit; the initial guess only speeds up the search.
NearestSearch nearest(const EmbreeMesh& mesh, const Vec3& p, std::uint32_t guess,
                      double limit_squared = std::numeric_limits<double>::infinity()) {
  NearestSearch search{mesh, p, limit_squared};
  if (!p.allFinite()) return search;
  search.visit(guess);
  query(mesh, search, std::sqrt(search.best_squared), visit_nearest);
  return search;
}

SurfaceDistance::Closest signed_closest(const EmbreeMesh& mesh, const Vec3& p, const NearestSearch& found) {
  SurfaceDistance::Closest closest;
  closest.distance_m = std::sqrt(found.best_squared);
  if (std::isinf(closest.distance_m)) return closest;
  FacingSearch facing{mesh, p, closest.distance_m * (1 + 1e-9) + 1e-12};
  query(mesh, facing, facing.limit_m, visit_facing);
  if (facing.best_facing < 0) facing.visit(found.best);
  closest.signed_distance_m = facing.sign * closest.distance_m;
  closest.point = facing.point;
  closest.triangle = mesh.original_index(facing.best);
  return closest;
}

}  // namespace

Vec3 closest_point_on_triangle(const Vec3& p, const std::array<Vec3, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  // The regions below are distinguished by areas, which are unreliable for collinear corners.
  const double longest_squared = std::max(ab.squaredNorm(), ac.squaredNorm());
  if (ab.cross(ac).squaredNorm() <= 1e-14 * longest_squared * longest_squared)
    return closest_point_on_edges(p, triangle);
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return d1 - d3 > 0 ? Vec3(a + d1 / (d1 - d3) * ab) : a;
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return d2 - d6 > 0 ? Vec3(a + d2 / (d2 - d6) * ac) : a;
  const double va = d3 * d6 - d5 * d4;
  const double along_bc = d4 - d3, back_bc = d5 - d6;
  if (va <= 0 && along_bc >= 0 && back_bc >= 0) {
    const double length = along_bc + back_bc;
    return length > 0 ? Vec3(b + along_bc / length * (c - b)) : b;
  }
  const double total = va + vb + vc;
  return a + vb / total * ab + vc / total * ac;
}

struct SurfaceDistance::Impl {
  explicit Impl(std::unique_ptr<EmbreeMesh> built) : mesh(std::move(built)) {
    for (std::uint32_t i = 0; i < mesh->size(); ++i)
      for (const Vec3& corner : mesh->corners(i)) box.extend(corner);
  }
  std::unique_ptr<EmbreeMesh> mesh;
  Box3 box;
};

SurfaceDistance::SurfaceDistance(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SurfaceDistance::~SurfaceDistance() = default;
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;

Result<SurfaceDistance> SurfaceDistance::build(const TriangleMesh& mesh) {
  auto built = EmbreeMesh::build(mesh);
  if (!built) return forward_error(built);
  return SurfaceDistance(std::make_unique<Impl>(std::move(*built)));
}

SurfaceDistance::Closest SurfaceDistance::closest(const Vec3& p) const {
  return signed_closest(*impl_->mesh, p, nearest(*impl_->mesh, p, 0));
}

double SurfaceDistance::distance_m(const Vec3& p) const {
  return std::sqrt(nearest(*impl_->mesh, p, 0).best_squared);
}

std::vector<float> SurfaceDistance::distances_m(std::span<const Vec3> points,
                                                const ParallelLoop& loop) const {
  std::vector<float> distances(points.size(), std::numeric_limits<float>::infinity());
  lower_distances_m(points, distances, loop);
  return distances;
}

void SurfaceDistance::lower_distances_m(std::span<const Vec3> points, std::span<float> distances_m,
                                        const ParallelLoop& loop) const {
  loop.for_ranges(points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t guess = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const double limit = static_cast<double>(distances_m[i]);
      if (impl_->box.squaredExteriorDistance(points[i]) > limit * limit * (1 + 1e-9)) continue;
      const NearestSearch found = nearest(*impl_->mesh, points[i], guess, limit * limit);
      guess = found.best;
      distances_m[i] = std::min(distances_m[i], static_cast<float>(std::sqrt(found.best_squared)));
    }
  });
}

std::vector<float> SurfaceDistance::signed_distances_m(std::span<const Vec3> points,
                                                       const ParallelLoop& loop) const {
  std::vector<float> distances(points.size());
  loop.for_ranges(points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t guess = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const NearestSearch found = nearest(*impl_->mesh, points[i], guess);
      guess = found.best;
      distances[i] = static_cast<float>(signed_closest(*impl_->mesh, points[i], found).signed_distance_m);
    }
  });
  return distances;
}

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Triangles [begin, end) with the vertices that they use.
TriangleMesh piece_of(const TriangleMesh& mesh, std::size_t begin, std::size_t end) {
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  const auto is_sound = [&](const std::array<std::uint32_t, 3>& t) {
    return std::max({t[0], t[1], t[2]}) < mesh.vertices.size();
  };
  std::uint32_t low = kNone, high = 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (!is_sound(mesh.triangles[i])) continue;
    for (const std::uint32_t vertex : mesh.triangles[i])
      low = std::min(low, vertex), high = std::max(high, vertex);
  }
  TriangleMesh piece;
  if (low == kNone) return piece;
  std::vector<std::uint32_t> place(high - low + std::size_t{1}, kNone);
  for (std::size_t i = begin; i < end; ++i) {
    std::array<std::uint32_t, 3> triangle = mesh.triangles[i];
    if (!is_sound(triangle)) continue;
    for (std::uint32_t& vertex : triangle) {
      std::uint32_t& at = place[vertex - low];
      if (at == kNone) {
        at = static_cast<std::uint32_t>(piece.vertices.size());
        piece.vertices.push_back(mesh.vertices[vertex]);
      }
      vertex = at;
    }
    piece.triangles.push_back(triangle);
  }
  return piece;
}

/// Lowers the distances piece by piece. Error when no triangle is valid.
Result<void> lower_by_pieces(const TriangleMesh& mesh, std::span<const Vec3> points,
                             std::span<float> distances, const ParallelLoop& loop,
                             std::size_t triangles_per_piece) {
  bool any = false;
  Error error{ErrorCode::kInvalidValue, "the mesh has no triangle", {}};
  for (std::size_t begin = 0; begin < mesh.triangles.size(); begin += triangles_per_piece) {
    const auto piece = SurfaceDistance::build(
        piece_of(mesh, begin, std::min(begin + triangles_per_piece, mesh.triangles.size())));
    if (!piece) {  // no usable triangle here, perhaps in another piece
      error = piece.error();
      continue;
    }
    any = true;
    piece->lower_distances_m(points, distances, loop);
  }
  if (!any) return tl::make_unexpected(error);
  return {};
}

}  // namespace

Result<std::vector<float>> distances_to_mesh_m(const TriangleMesh& mesh, std::span<const Vec3> points,
                                               const ParallelLoop& loop, std::size_t triangles_per_piece) {
  // Most points are near; the limit avoids searching distant pieces.
  constexpr float kNear_m = 0.1F;
  std::vector<float> distances(points.size(), kNear_m);
  const auto near = lower_by_pieces(mesh, points, distances, loop, triangles_per_piece);
  if (!near) return forward_error(near);
  std::vector<Vec3> far_points;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (distances[i] >= kNear_m) far_points.push_back(points[i]);
  if (far_points.empty()) return distances;
  std::vector<float> far_distances(far_points.size(), kInfinity);
  const auto far = lower_by_pieces(mesh, far_points, far_distances, loop, triangles_per_piece);
  if (!far) return forward_error(far);
  auto next = far_distances.begin();
  for (float& distance : distances)
    if (distance >= kNear_m) distance = *next++;
  return distances;
}

}  // namespace hm
