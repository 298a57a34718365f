#include "hm/evaluation/mesh_error.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

using Eigen::Vector3f;

/// A square of `side` metres at height z with its normal up, cut into cells.
TriangleMesh plane(float side, float z, int cells) {
  TriangleMesh mesh;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x)
      mesh.vertices.emplace_back(side * static_cast<float>(x) / static_cast<float>(cells),
                                 side * static_cast<float>(y) / static_cast<float>(cells), z);
  const auto row = static_cast<std::uint32_t>(cells + 1);
  for (std::uint32_t y = 0; y + 1 < row; ++y)
    for (std::uint32_t x = 0; x + 1 < row; ++x) {
      const std::uint32_t i = y * row + x;
      mesh.triangles.push_back({i, i + 1, i + row});
      mesh.triangles.push_back({i + 1, i + row + 1, i + row});
    }
  return mesh;
}

TriangleMesh sphere(float radius, int rings) {
  TriangleMesh mesh;
  const int columns = 2 * rings;
  for (int r = 0; r <= rings; ++r)
    for (int c = 0; c < columns; ++c) {
      const double theta = M_PI * r / rings, phi = 2 * M_PI * c / columns;
      mesh.vertices.push_back(
          (radius * Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)))
              .cast<float>());
    }
  const auto index = [columns](int r, int c) {
    return static_cast<std::uint32_t>(r * columns + c % columns);
  };
  for (int r = 0; r < rings; ++r)
    for (int c = 0; c < columns; ++c) {
      mesh.triangles.push_back({index(r, c), index(r + 1, c), index(r + 1, c + 1)});
      mesh.triangles.push_back({index(r, c), index(r + 1, c + 1), index(r, c + 1)});
    }
  return mesh;
}

TriangleMesh random_triangles(Rng& rng, int count) {
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::uint32_t>(mesh.vertices.size());
    const Vector3f at(static_cast<float>(rng.uniform(-2, 2)), static_cast<float>(rng.uniform(-2, 2)),
                      static_cast<float>(rng.uniform(-2, 2)));
    for (int j = 0; j < 3; ++j)
      mesh.vertices.emplace_back(at + Vector3f(static_cast<float>(rng.normal(0, 0.3)),
                                               static_cast<float>(rng.normal(0, 0.3)),
                                               static_cast<float>(rng.normal(0, 0.3))));
    mesh.triangles.push_back({k, k + 1, k + 2});
  }
  return mesh;
}

/// Distance to a triangle by another route: the plane's foot when inside, else the nearest of the edges.
double reference_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto to_segment = [&](const Vec3& s, const Vec3& e) {
    const double t = std::clamp((p - s).dot(e - s) / (e - s).squaredNorm(), 0.0, 1.0);
    return (p - s - t * (e - s)).norm();
  };
  const Vec3 n = (b - a).cross(c - a).normalized();
  const Vec3 foot = p - n.dot(p - a) * n;
  const bool inside = n.dot((b - a).cross(foot - a)) >= 0 && n.dot((c - b).cross(foot - b)) >= 0 &&
                      n.dot((a - c).cross(foot - c)) >= 0;
  return inside ? std::abs(n.dot(p - a)) : std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
}

TEST(SurfaceDistance, MatchesBruteForceOnRandomTriangles) {
  Rng rng(1);
  const TriangleMesh mesh = random_triangles(rng, 300);
  const auto surface = SurfaceDistance::build(mesh);
  ASSERT_TRUE(surface.has_value());
  std::vector<Vec3> points;
  for (int i = 0; i < 3000; ++i)
    points.emplace_back(rng.uniform(-4, 4), rng.uniform(-4, 4), rng.uniform(-4, 4));
  const std::vector<float> all = surface->distances_m(points, ParallelLoop(2));
  for (std::size_t i = 0; i < points.size(); ++i) {
    double best = std::numeric_limits<double>::infinity();
    for (const auto& t : mesh.triangles)
      best = std::min(
          best, reference_distance(points[i], mesh.vertices[t[0]].cast<double>(),
                                   mesh.vertices[t[1]].cast<double>(), mesh.vertices[t[2]].cast<double>()));
    const SurfaceDistance::Closest closest = surface->closest(points[i]);
    ASSERT_NEAR(closest.distance_m, best, 1e-9);
    EXPECT_NEAR((closest.point - points[i]).norm(), best, 1e-9);
    EXPECT_EQ(std::abs(closest.signed_distance_m), closest.distance_m);
    EXPECT_EQ(static_cast<float>(surface->distance_m(points[i])), all[i]);
    const auto& t = mesh.triangles[closest.triangle];
    EXPECT_NEAR(reference_distance(points[i], mesh.vertices[t[0]].cast<double>(),
                                   mesh.vertices[t[1]].cast<double>(), mesh.vertices[t[2]].cast<double>()),
                best, 1e-9);
  }
}

TEST(SurfaceDistance, SearchingInPiecesFindsTheSameDistances) {
  Rng rng(44);
  TriangleMesh mesh = random_triangles(rng, 211);
  mesh.triangles[40] = {0, 1, 99999};  // broken
  std::vector<Vec3> points;
  for (int i = 0; i < 500; ++i)
    points.emplace_back(rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-3, 3));
  const ParallelLoop loop(2);
  const std::vector<float> whole = SurfaceDistance::build(mesh)->distances_m(points, loop);
  for (const std::size_t piece : {1u, 17u, 210u, 100000u}) {
    const auto found = distances_to_mesh_m(mesh, points, loop, piece);
    ASSERT_TRUE(found);
    EXPECT_EQ(*found, whole) << piece;
  }
  EXPECT_FALSE(distances_to_mesh_m(TriangleMesh{}, points, loop));
}

TEST(SurfaceDistance, SignsOfACubeIncludingEdgesAndCorners) {
  TriangleMesh cube;
  for (int i = 0; i < 8; ++i)
    cube.vertices.emplace_back(static_cast<float>(i & 1), static_cast<float>((i >> 1) & 1),
                               static_cast<float>((i >> 2) & 1));
  cube.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  ASSERT_NEAR(enclosed_volume(cube), 1, 1e-9);
  const auto surface = SurfaceDistance::build(cube);
  ASSERT_TRUE(surface.has_value());
  Rng rng(2);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p(rng.uniform(-1, 2), rng.uniform(-1, 2), rng.uniform(-1, 2));
    const Vec3 q = (p - Vec3::Constant(0.5)).cwiseAbs() - Vec3::Constant(0.5);
    const double exact = q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);  // signed distance of a box
    ASSERT_NEAR(surface->closest(p).signed_distance_m, exact, 1e-9) << p.transpose();
  }
}

TEST(SurfaceDistance, DegenerateTrianglesAndBadVertices) {
  const double nan = std::nan("");
  EXPECT_FALSE(SurfaceDistance::build({}).has_value());
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {std::nanf(""), 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 9}};
  EXPECT_FALSE(SurfaceDistance::build(mesh).has_value());
  mesh.triangles.push_back({0, 1, 1});  // a line
  const auto line = SurfaceDistance::build(mesh);
  ASSERT_TRUE(line.has_value());
  EXPECT_NEAR(line->distance_m(Vec3(0.5, 2, 0)), 2, 1e-12);
  EXPECT_NEAR(line->distance_m(Vec3(2, 0, 0)), 1, 1e-12);
  EXPECT_EQ(line->closest(Vec3(0.5, 2, 0)).triangle, 2u);
  EXPECT_TRUE(std::isinf(line->distance_m(Vec3(nan, 0, 0))));
}

TEST(SurfaceDistance, AnyDegenerateTriangleGivesItsNearestPoint) {
  const std::array<Vec3, 3> point{Vec3(1, 2, 3), Vec3(1, 2, 3), Vec3(1, 2, 3)};
  EXPECT_TRUE(closest_point_on_triangle(Vec3(4, 4, 4), point).isApprox(Vec3(1, 2, 3)));
  Rng rng(9);
  for (int i = 0; i < 500; ++i) {  // two points on a line in any order
    const Vec3 a(rng.normal(), rng.normal(), rng.normal()), d(rng.normal(), rng.normal(), rng.normal());
    const std::array<double, 3> at{rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)};
    const Vec3 p(rng.normal(), rng.normal(), rng.normal());
    const double low = *std::min_element(at.begin(), at.end()),
                 high = *std::max_element(at.begin(), at.end());
    const double t = std::clamp((p - a).dot(d) / d.squaredNorm(), low, high);
    const Vec3 closest = closest_point_on_triangle(p, {a + at[0] * d, a + at[1] * d, a + at[2] * d});
    EXPECT_NEAR((closest - p).norm(), (a + t * d - p).norm(), 1e-6);
  }
}

TEST(SampleSurface, EvenByArea) {
  TriangleMesh mesh = plane(1, 0, 3);
  const TriangleMesh large = plane(2, 1, 1);  // four times the area in a ninth of the triangles
  for (auto t : large.triangles) {
    for (auto& i : t) i += static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.triangles.push_back(t);
  }
  mesh.vertices.insert(mesh.vertices.end(), large.vertices.begin(), large.vertices.end());
  mesh.triangles.push_back({0, 0, 1});
  const std::vector<Vec3> points = sample_surface(mesh, 50'000, 7);
  ASSERT_EQ(points.size(), 50'000u);
  double high = 0;
  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : points) {
    high += p.z() > 0.5 ? 1 : 0;
    centre += p / 50'000.0;
  }
  EXPECT_NEAR(high / 50'000, 0.8, 1e-4);
  EXPECT_NEAR(centre.x(), 0.8 * 1 + 0.2 * 0.5, 0.01);
  EXPECT_NEAR(centre.y(), 0.9, 0.01);
  EXPECT_EQ(sample_surface(mesh, 100, 7), sample_surface(mesh, 100, 7));
  EXPECT_NE(sample_surface(mesh, 100, 7), sample_surface(mesh, 100, 8));
  EXPECT_TRUE(sample_surface({}, 100, 7).empty());
}

TEST(MeshError, PlaneInFrontAndBehind) {
  MeshErrorParams params;
  params.samples = 20'000;
  for (const float offset : {0.005F, -0.012F}) {
    TriangleMesh moved = plane(1, offset, 13);
    const auto error = evaluate_mesh(moved, plane(1, 0, 7), params, ParallelLoop());
    ASSERT_TRUE(error.has_value());
    const double distance = std::abs(static_cast<double>(offset));
    EXPECT_NEAR(error->accuracy.distance_m.mean, distance, 1e-7);
    EXPECT_NEAR(error->accuracy.distance_m.p95, distance, 1e-7);
    EXPECT_NEAR(error->accuracy.bias_m, static_cast<double>(offset), 1e-7);
    EXPECT_EQ(error->accuracy.within_ratio, 1);
    EXPECT_EQ(error->completeness.ratio, 1);
    EXPECT_EQ(error->f_score, 1);
  }
}

TEST(MeshError, ConcentricSpheresInClosedForm) {
  const TriangleMesh truth = sphere(1, 120), reconstruction = sphere(1.01F, 120);
  ASSERT_GT(enclosed_volume(truth), 4);
  MeshErrorParams params;
  params.samples = 50'000;
  const auto by_mesh = evaluate_mesh(reconstruction, truth, params, ParallelLoop());
  ASSERT_TRUE(by_mesh.has_value());
  EXPECT_NEAR(by_mesh->accuracy.distance_m.mean, 0.01, 1e-4);
  EXPECT_NEAR(by_mesh->accuracy.bias_m, 0.01, 1e-4);
  const SignedDistanceFunction ball = [](const Vec3& p) { return p.norm() - 1; };
  const auto by_function = mesh_accuracy(reconstruction, ball, params, ParallelLoop());
  ASSERT_TRUE(by_function.has_value());
  EXPECT_NEAR(by_function->bias_m, 0.01, 3e-4);  // facets lie inside of their sphere
  EXPECT_LT(by_function->bias_m, 0.01);
  const auto inwards = mesh_accuracy(sphere(0.98F, 120), ball, params, ParallelLoop());
  EXPECT_NEAR(inwards->bias_m, -0.02, 3e-4);
}

TEST(MeshError, CompletenessOfHalfAPlane) {
  MeshErrorParams params;
  params.samples = 40'000;
  params.threshold_m = 0.01;
  TriangleMesh half = plane(1, 0, 10);
  for (auto& v : half.vertices) v.x() *= 0.5F;
  const auto error = evaluate_mesh(half, plane(1, 0, 4), params, ParallelLoop());
  ASSERT_TRUE(error.has_value());
  EXPECT_NEAR(error->completeness.ratio, 0.51, 0.003);  // half, and the strip within the threshold
  EXPECT_NEAR(error->f_score, 2 * 0.51 / 1.51, 0.003);
  EXPECT_NEAR(error->completeness.distance_m.max, 0.5, 1e-3);
  const std::vector<Vec3> seen{{0.1, 0.5, 0}, {0.9, 0.5, 0}, {0.2, 0.2, 0.005}, {0.505, 0.5, 0}};
  const auto visible = mesh_completeness(half, seen, params, ParallelLoop());
  ASSERT_TRUE(visible.has_value());
  EXPECT_EQ(visible->ratio, 0.75);
  EXPECT_EQ(visible->reached, (std::vector<bool>{true, false, true, true}));
}

TEST(MeshError, SameBitsForAnyNumberOfThreads) {
  Rng rng(4);
  const TriangleMesh truth = random_triangles(rng, 500), reconstruction = random_triangles(rng, 500);
  MeshErrorParams params;
  params.samples = 30'000;
  const auto one = evaluate_mesh(reconstruction, truth, params, ParallelLoop(1));
  const auto two = evaluate_mesh(reconstruction, truth, params, ParallelLoop(2));
  ASSERT_TRUE(one && two);
  EXPECT_EQ(one->accuracy.signed_distances_m, two->accuracy.signed_distances_m);
  EXPECT_EQ(one->accuracy.bias_m, two->accuracy.bias_m);
  EXPECT_EQ(one->completeness.reached, two->completeness.reached);
  EXPECT_EQ(one->completeness.distance_m.mean, two->completeness.distance_m.mean);
}

TEST(MeshError, VertexErrorsAndNothingToMeasure) {
  TriangleMesh mesh = plane(1, 0.003F, 2);
  mesh.vertices.emplace_back(std::nanf(""), 0.F, 0.F);
  const auto truth = SurfaceDistance::build(plane(1, 0, 1));
  ASSERT_TRUE(truth.has_value());
  const std::vector<float> errors = vertex_errors_m(mesh, *truth, ParallelLoop());
  ASSERT_EQ(errors.size(), mesh.vertices.size());
  for (std::size_t i = 0; i + 1 < errors.size(); ++i) EXPECT_NEAR(errors[i], 0.003F, 1e-7F);
  EXPECT_TRUE(std::isnan(errors.back()));
  EXPECT_FALSE(mesh_accuracy({}, *truth, {}, ParallelLoop()).has_value());
  EXPECT_FALSE(mesh_completeness(mesh, {}, {}, ParallelLoop()).has_value());
  EXPECT_FALSE(evaluate_mesh(mesh, {}, {}, ParallelLoop()).has_value());
}

TEST(MeshError, SaysWhichOfTheTwoMeshesCannotBeMeasured) {
  const TriangleMesh mesh = plane(1, 0, 1);
  TriangleMesh points = mesh;
  points.triangles.clear();
  TriangleMesh flat = mesh;  // every triangle without an area
  for (auto& vertex : flat.vertices) vertex.setZero();
  const auto error_of = [](const TriangleMesh& estimate, const TriangleMesh& truth) {
    const auto error = evaluate_mesh(estimate, truth, {}, ParallelLoop());
    return error ? Error{} : error.error();
  };
  EXPECT_EQ(error_of(mesh, points).where, "the true mesh");
  EXPECT_EQ(error_of(mesh, flat).where, "the true mesh");
  EXPECT_EQ(error_of(points, mesh).where, "the evaluated mesh");
  EXPECT_EQ(error_of(flat, mesh).where, "the evaluated mesh");
  for (const Error& error : {error_of(mesh, points), error_of(points, mesh)}) {
    EXPECT_EQ(error.code, ErrorCode::kInvalidValue);
    EXPECT_NE(error.message.find(fmt::format("{} vertices, 0 triangles", mesh.vertices.size())),
              std::string::npos)
        << error.message;
  }
}

}  // namespace
}  // namespace hm
