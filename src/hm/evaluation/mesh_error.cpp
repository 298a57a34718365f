#include "hm/evaluation/mesh_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

/// Twice the area of a triangle; 0 for an invalid one.
double doubled_area(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  if (std::max({t[0], t[1], t[2]}) >= mesh.vertices.size()) return 0;
  float largest = 0;
  for (const std::uint32_t index : t) largest = std::max(largest, mesh.vertices[index].cwiseAbs().maxCoeff());
  if (!(largest < 1e9F)) return 0;  // as EmbreeMesh
  const Vec3 a = mesh.vertices[t[0]].cast<double>();
  const double area =
      (mesh.vertices[t[1]].cast<double>() - a).cross(mesh.vertices[t[2]].cast<double>() - a).norm();
  return std::isfinite(area) ? area : 0;
}

Vec3 random_point(const TriangleMesh& mesh, std::size_t triangle, Rng& rng) {
  double u = rng.uniform(), v = rng.uniform();
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  const auto& t = mesh.triangles[triangle];
  const Vec3 a = mesh.vertices[t[0]].cast<double>();
  return a + u * (mesh.vertices[t[1]].cast<double>() - a) + v * (mesh.vertices[t[2]].cast<double>() - a);
}

template <class Vector>
Summary summarise_distances(const Vector& distances) {
  std::vector<double> values;
  values.reserve(distances.size());
  for (const float d : distances) values.push_back(std::abs(static_cast<double>(d)));
  return summarise(values);
}

MeshAccuracy accuracy_of(std::vector<float> signed_distances, double threshold_m) {
  MeshAccuracy accuracy;
  std::size_t within = 0;
  double sum = 0;
  for (const float d : signed_distances) {
    sum += static_cast<double>(d);
    within += std::abs(static_cast<double>(d)) <= threshold_m ? 1 : 0;
  }
  const auto count = static_cast<double>(signed_distances.size());
  accuracy.bias_m = sum / count;
  accuracy.within_ratio = static_cast<double>(within) / count;
  accuracy.distance_m = summarise_distances(signed_distances);
  accuracy.signed_distances_m = std::move(signed_distances);
  return accuracy;
}

std::vector<float> evaluate_function(const SignedDistanceFunction& truth, std::span<const Vec3> points,
                                     const ParallelLoop& loop) {
  std::vector<float> distances(points.size());
  loop.for_ranges(points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) distances[i] = static_cast<float>(truth(points[i]));
  });
  return distances;
}

Error no_surface(const TriangleMesh& mesh, std::string where) {
  return {ErrorCode::kInvalidValue,
          fmt::format("the mesh has no surface to measure ({} vertices, {} triangles)", mesh.vertices.size(),
                      mesh.triangles.size()),
          std::move(where)};
}

Result<std::vector<Vec3>> samples_of(const TriangleMesh& mesh, const MeshErrorParams& params) {
  std::vector<Vec3> samples =
      sample_surface(mesh, static_cast<std::size_t>(params.samples), static_cast<std::uint64_t>(params.seed));
  if (samples.empty()) return tl::make_unexpected(no_surface(mesh, {}));
  return samples;
}

/// Applies `errors_of` to all vertices in batches; NaN where it returns infinity.
template <class ErrorsOf>
std::vector<float> for_vertices(const TriangleMesh& mesh, ErrorsOf&& errors_of) {
  constexpr std::size_t kAtOnce = 1u << 18u;
  std::vector<float> all;
  all.reserve(mesh.vertices.size());
  std::vector<Vec3> points;
  for (std::size_t begin = 0; begin < mesh.vertices.size(); begin += kAtOnce) {
    points.clear();
    for (std::size_t i = begin; i < std::min(begin + kAtOnce, mesh.vertices.size()); ++i)
      points.push_back(mesh.vertices[i].cast<double>());
    for (const float e : errors_of(std::span<const Vec3>(points)))
      all.push_back(std::isfinite(e) ? e : std::numeric_limits<float>::quiet_NaN());
  }
  return all;
}

}  // namespace

std::vector<Vec3> sample_surface(const TriangleMesh& mesh, std::size_t count, std::uint64_t seed) {
  // Areas are computed twice rather than kept: there are millions.
  const std::size_t triangles = mesh.triangles.size();
  const auto area_of = [&](std::size_t i) { return doubled_area(mesh, mesh.triangles[i]); };
  double total = 0;
  for (std::size_t i = 0; i < triangles; ++i) total += area_of(i);
  std::vector<Vec3> samples;
  if (!(total > 0)) return samples;
  samples.reserve(count);
  Rng rng(seed);
  double area_before = 0, area = area_of(0);
  std::size_t triangle = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double at = total * (static_cast<double>(i) + rng.uniform()) / static_cast<double>(count);
    while (triangle + 1 < triangles && at >= area_before + area) {
      area_before += area;
      area = area_of(++triangle);
    }
    while (triangle > 0 && area <= 0) area = area_of(--triangle);  // rounding at the very end
    samples.push_back(random_point(mesh, triangle, rng));
  }
  return samples;
}

Result<MeshAccuracy> mesh_accuracy(const TriangleMesh& reconstruction, const SurfaceDistance& truth,
                                   const MeshErrorParams& params, const ParallelLoop& loop) {
  const auto samples = samples_of(reconstruction, params);
  if (!samples) return forward_error(samples);
  return accuracy_of(truth.signed_distances_m(*samples, loop), params.threshold_m);
}

Result<MeshAccuracy> mesh_accuracy(const TriangleMesh& reconstruction, const SignedDistanceFunction& truth,
                                   const MeshErrorParams& params, const ParallelLoop& loop) {
  const auto samples = samples_of(reconstruction, params);
  if (!samples) return forward_error(samples);
  return accuracy_of(evaluate_function(truth, *samples, loop), params.threshold_m);
}

Result<MeshCompleteness> mesh_completeness(const TriangleMesh& reconstruction,
                                           std::span<const Vec3> truth_points, const MeshErrorParams& params,
                                           const ParallelLoop& loop) {
  if (truth_points.empty()) return fail(ErrorCode::kInvalidValue, {}, "there is no true point to look for");
  const auto found = distances_to_mesh_m(reconstruction, truth_points, loop);
  if (!found) return forward_error(found);
  const std::vector<float>& distances = *found;
  MeshCompleteness completeness;
  completeness.reached.reserve(distances.size());
  std::size_t reached = 0;
  for (const float d : distances) {
    completeness.reached.push_back(static_cast<double>(d) <= params.threshold_m);
    reached += completeness.reached.back() ? 1 : 0;
  }
  completeness.ratio = static_cast<double>(reached) / static_cast<double>(distances.size());
  completeness.distance_m = summarise_distances(distances);
  return completeness;
}

Result<MeshError> evaluate_mesh(const TriangleMesh& reconstruction, const TriangleMesh& truth,
                                const MeshErrorParams& params, const ParallelLoop& loop,
                                std::span<const Vec3> visible_points) {
  const auto surface = SurfaceDistance::build(truth);
  if (!surface) return fail(surface.error().code, kTrueMesh, "{}", surface.error().message);
  std::vector<Vec3> sampled;
  if (visible_points.empty()) {
    sampled = sample_surface(truth, static_cast<std::size_t>(params.samples),
                             static_cast<std::uint64_t>(params.seed) + 1);
    if (sampled.empty()) return tl::make_unexpected(no_surface(truth, kTrueMesh));
    visible_points = sampled;
  }
  auto accuracy = mesh_accuracy(reconstruction, *surface, params, loop);
  if (!accuracy) return fail(accuracy.error().code, kEvaluatedMesh, "{}", accuracy.error().message);
  auto completeness = mesh_completeness(reconstruction, visible_points, params, loop);
  if (!completeness)
    return fail(completeness.error().code, kEvaluatedMesh, "{}", completeness.error().message);
  MeshError error{std::move(*accuracy), std::move(*completeness)};
  const double precision = error.accuracy.within_ratio, recall = error.completeness.ratio;
  error.f_score = precision + recall > 0 ? 2 * precision * recall / (precision + recall) : 0;
  return error;
}

std::vector<float> vertex_errors_m(const TriangleMesh& reconstruction, const SurfaceDistance& truth,
                                   const ParallelLoop& loop) {
  return for_vertices(reconstruction,
                      [&](std::span<const Vec3> points) { return truth.signed_distances_m(points, loop); });
}

std::vector<float> vertex_errors_m(const TriangleMesh& reconstruction, const SignedDistanceFunction& truth,
                                   const ParallelLoop& loop) {
  return for_vertices(reconstruction,
                      [&](std::span<const Vec3> points) { return evaluate_function(truth, points, loop); });
}

}  // namespace hm
