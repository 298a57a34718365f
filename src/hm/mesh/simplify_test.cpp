#include "hm/mesh/simplify.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "hm/mesh/mesh_test_support.hpp"
#include "hm/mesh/whole_mesh.hpp"

namespace hm {
namespace {

/// A coloured sphere of 20 cm (at the origin) meshed at 1 cm, and two specks of 2.5 cm.
TriangleMesh sphere_and_specks() {
  VolumeGrid grid(0.01, 1e-5);
  testing::fill(grid, -30, 30, [](const Vec3& p) {
    double distance = p.norm() - 0.2;
    for (const Vec3& speck : {Vec3(0.26, 0.26, 0.26), Vec3(-0.255, 0.26, -0.25)})
      distance = std::min(distance, (p - speck).norm() - 0.025);
    return distance;
  });
  testing::for_each_voxel(-30, 30, [&](testing::Lattice at) {
    testing::set_color(grid, at, ColorVoxel::make(static_cast<std::uint8_t>(100 + at[0]), 50, 60, 1));
  });
  return extract_mesh(grid, MeshParams{}, ParallelLoop(1));
}

std::size_t count_vertices_near(const TriangleMesh& mesh, const Eigen::Vector3f& p, float radius) {
  return static_cast<std::size_t>(std::count_if(mesh.vertices.begin(), mesh.vertices.end(),
                                                [&](const auto& v) { return (v - p).norm() < radius; }));
}

void expect_valid(const TriangleMesh& mesh) {
  ASSERT_TRUE(mesh.has_normals());
  ASSERT_TRUE(mesh.has_colors());
  std::vector<bool> used(mesh.vertices.size());
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t index : t) {
      ASSERT_LT(index, mesh.vertices.size());
      used[index] = true;
    }
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
}

TEST(RemoveSmallPieces, BySizeAndAttributesFollow) {
  const TriangleMesh all = sphere_and_specks();
  EXPECT_GT(count_vertices_near(all, {0.26F, 0.26F, 0.26F}, 0.04F), 20U);
  const TriangleMesh kept = remove_small_pieces(all, 0.1);  // a speck's box has a diagonal of 0.087 m
  expect_valid(kept);
  EXPECT_EQ(count_vertices_near(kept, {0.26F, 0.26F, 0.26F}, 0.04F), 0U);
  EXPECT_EQ(kept.vertices.size(), count_vertices_near(all, {0, 0, 0}, 0.21F));
  EXPECT_TRUE(open_edges(kept).empty());
  EXPECT_NEAR(enclosed_volume(kept), 4.0 / 3 * M_PI * 0.008, 2e-4);
  for (std::size_t i = 0; i < kept.vertices.size(); ++i) {
    ASSERT_GT(kept.normals[i].dot(kept.vertices[i].normalized()), 0.99F);
    ASSERT_NEAR(kept.colors[i].r, 99.5 + kept.vertices[i].x() * 100.0, 1.01);
  }
}

TEST(RemoveSmallPieces, WhatIsLargerAndTheLargestStay) {
  const TriangleMesh all = sphere_and_specks();
  EXPECT_EQ(remove_small_pieces(all, 0.08).triangles, all.triangles);
  TriangleMesh with_crumb = all;
  const auto first = static_cast<std::uint32_t>(all.vertices.size());
  for (const Eigen::Vector3f& corner : {Eigen::Vector3f(0.5F, 0, 0), {0.5F, 0.04F, 0}, {0.5F, 0, 0.02F}}) {
    with_crumb.vertices.push_back(corner);
    with_crumb.normals.emplace_back(1.F, 0.F, 0.F);
    with_crumb.colors.push_back({});
  }
  with_crumb.triangles.push_back({first, first + 1, first + 2});
  EXPECT_EQ(clean_mesh(with_crumb, MeshParams{}).triangles, all.triangles);  // 5 cm by default
  const TriangleMesh largest = remove_small_pieces(all, 100);                // everything is smaller
  EXPECT_EQ(largest.vertices.size(), count_vertices_near(all, {0, 0, 0}, 0.21F));
  EXPECT_TRUE(remove_small_pieces({}, 1).triangles.empty());
}

TEST(Simplify, ReachesTheRatioAndStaysClosed) {
  const TriangleMesh fine = remove_small_pieces(sphere_and_specks(), 0.1);
  const TriangleMesh coarse = simplify(fine, {0.25, 0});
  expect_valid(coarse);
  EXPECT_NEAR(static_cast<double>(coarse.triangles.size()), 0.25 * static_cast<double>(fine.triangles.size()),
              0.01 * static_cast<double>(fine.triangles.size()));
  EXPECT_TRUE(open_edges(coarse).empty());
  EXPECT_NEAR(surface_area(coarse) / surface_area(fine), 1.0, 0.01);
  EXPECT_NEAR(enclosed_volume(coarse) / enclosed_volume(fine), 1.0, 0.01);
  for (std::size_t i = 0; i < coarse.vertices.size(); ++i) {
    ASSERT_NEAR(coarse.vertices[i].norm(), 0.2F, 2e-4F);  // vertices that stay do not move
    ASSERT_GT(coarse.normals[i].dot(coarse.vertices[i].normalized()), 0.99F);
    ASSERT_NEAR(coarse.colors[i].r, 99.5 + coarse.vertices[i].x() * 100.0, 1.01);
  }
}

TEST(Simplify, ByErrorKeepsTheSurfaceWithinIt) {
  const TriangleMesh fine = remove_small_pieces(sphere_and_specks(), 0.1);
  std::size_t previous = fine.triangles.size();
  for (const double error_m : {0.0005, 0.002, 0.008}) {
    const TriangleMesh coarse = simplify(fine, {1.0, error_m});
    EXPECT_LT(coarse.triangles.size(), previous);
    previous = coarse.triangles.size();
    for (const auto& t : coarse.triangles) {
      const Eigen::Vector3f center =
          (coarse.vertices[t[0]] + coarse.vertices[t[1]] + coarse.vertices[t[2]]) / 3;
      ASSERT_NEAR(center.norm(), 0.2, 2 * error_m + 2e-4);
    }
  }
}

TEST(Simplify, OpenBordersStay) {
  VolumeGrid grid(0.02, 1e-5);
  testing::fill(grid, -10, 10, [](const Vec3& p) { return p.z() - 0.003 + 0.2 * p.x(); });
  const TriangleMesh fine = extract_mesh(grid, MeshParams{}, ParallelLoop(1));
  const TriangleMesh coarse = simplify(fine, {0.1, 0});
  EXPECT_LT(coarse.triangles.size(), fine.triangles.size() / 2);
  const auto border = [](const TriangleMesh& mesh) {
    std::set<std::array<float, 6>> edges;
    for (const auto& [i, k] : open_edges(mesh)) {
      const Eigen::Vector3f &a = mesh.vertices[i], &b = mesh.vertices[k];
      edges.insert({a.x(), a.y(), a.z(), b.x(), b.y(), b.z()});
    }
    return edges;
  };
  EXPECT_EQ(border(coarse), border(fine));
  EXPECT_NEAR(surface_area(coarse) / surface_area(fine), 1.0, 0.01);
}

TEST(CleanMesh, DefaultsChangeNothing) {
  const TriangleMesh all = sphere_and_specks();
  const TriangleMesh same = clean_mesh(all, MeshParams{});
  EXPECT_EQ(same.triangles, all.triangles);
  EXPECT_EQ(same.vertices, all.vertices);
}

/// Squares of 1 cm that share no vertices: all borders are open.
TriangleMesh loose_squares(int side) {
  TriangleMesh mesh;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y) {
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const auto& [u, v] : {std::pair{0, 0}, std::pair{1, 0}, std::pair{1, 1}, std::pair{0, 1}}) {
        mesh.vertices.emplace_back(0.01F * static_cast<float>(x + u), 0.01F * static_cast<float>(y + v), 0.F);
        mesh.colors.push_back({static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 7});
      }
      mesh.triangles.push_back({first, first + 1, first + 2});
      mesh.triangles.push_back({first, first + 2, first + 3});
    }
  return mesh;
}

TEST(SimplifyTo, ReachesTheNumberThoughBordersAreOpen) {
  const TriangleMesh all = loose_squares(100);
  EXPECT_EQ(simplify(all, {0.1, 0}).triangles.size(), all.triangles.size()) << "edges alone do not get there";
  const TriangleMesh small = simplify_to(all, 2000);
  EXPECT_LE(small.triangles.size(), 2000U);
  EXPECT_GT(small.triangles.size(), 500U);
  ASSERT_TRUE(small.has_colors());
  EXPECT_NEAR(surface_area(small), 1.0, 0.1);
  for (std::size_t i = 0; i < small.vertices.size(); ++i) {
    EXPECT_EQ(small.colors[i].b, 7);
    EXPECT_NEAR(small.colors[i].r, 100 * small.vertices[i].x(), 8);  // the colour of the place
  }
}

TEST(SimplifyTo, KeepsTheShapeOfASphere) {
  const TriangleMesh all = sphere_and_specks(), small = simplify_to(all, all.triangles.size() / 4);
  EXPECT_LE(small.triangles.size(), all.triangles.size() / 4);
  EXPECT_GT(small.triangles.size(), all.triangles.size() / 5);
  EXPECT_NEAR(enclosed_volume(small), enclosed_volume(all), 2e-4);
  EXPECT_EQ(simplify_to(all, all.triangles.size()).triangles, all.triangles);
}

TEST(SimplifyTo, LargeMeshesInPiecesKeepTheirSurface) {
  // A wavy sheet of 440,000 triangles on shared vertices, coloured by place.
  constexpr std::uint32_t kSide = 470;
  TriangleMesh sheet;
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const float u = 0.01F * static_cast<float>(x), v = 0.01F * static_cast<float>(y);
      sheet.vertices.emplace_back(u, v, 0.1F * std::sin(3 * u));
      sheet.colors.push_back({static_cast<std::uint8_t>(x / 2), static_cast<std::uint8_t>(y / 2), 0});
      if (x == 0 || y == 0) continue;
      const std::uint32_t at = y * kSide + x;
      sheet.triangles.push_back({at - kSide - 1, at - kSide, at});
      sheet.triangles.push_back({at - kSide - 1, at, at - 1});
    }
  const TriangleMesh small = simplify_to(sheet, 20'000);
  EXPECT_LE(small.triangles.size(), 20'000U);
  EXPECT_GT(small.triangles.size(), 15'000U);
  // At least as accurate as simplification in one piece, which folds a few of the long triangles.
  const TriangleMesh at_once = simplify(sheet, {20'000.0 / static_cast<double>(sheet.triangles.size()), 0});
  EXPECT_LT(surface_area(small), 1.002 * surface_area(at_once));
  EXPECT_GT(surface_area(small), 0.998 * surface_area(sheet));
  // Pieces have been joined: only the rim of the sheet is open.
  for (const auto& [a, b] : open_edges(small))
    for (const std::uint32_t vertex : {a, b}) {
      const auto& p = small.vertices[vertex];
      const float rim = std::min(std::min(p.x(), 4.69F - p.x()), std::min(p.y(), 4.69F - p.y()));
      EXPECT_LT(rim, 1e-4F);
    }
  for (std::size_t i = 0; i < small.vertices.size(); ++i)
    EXPECT_NEAR(small.colors[i].r, small.vertices[i].x() * 100 / 2, 1);
}

TEST(ClusterVertices, LeavesOutWhatIsNotFinite) {
  TriangleMesh mesh = loose_squares(2);
  mesh.vertices[0].x() = std::nanf("");
  const TriangleMesh joined = cluster_vertices(mesh, 0.001);  // no two corners of a square in a cell
  EXPECT_EQ(joined.triangles.size(), mesh.triangles.size() - 2);
  EXPECT_EQ(joined.vertices.size(), 8U);
  EXPECT_TRUE(cluster_vertices(mesh, 1).triangles.empty());
}

TEST(CleanMesh, DoesBoth) {
  MeshParams params;
  params.min_piece_size_m = 0.1;
  params.simplify_keep_ratio = 0.5;
  const TriangleMesh all = sphere_and_specks(), cleaned = clean_mesh(all, params);
  EXPECT_LT(cleaned.triangles.size(), all.triangles.size() * 51 / 100);
  EXPECT_EQ(count_vertices_near(cleaned, {0.26F, 0.26F, 0.26F}, 0.04F), 0U);
}

TEST(MeshParams, ReadsBackItsOwnToml) {
  MeshParams params, read;
  params.min_piece_size_m = 0.07;
  params.simplify_error_m = 0.01;
  ParamList list, other;
  list.add("mesh", params);
  other.add("mesh", read);
  ASSERT_TRUE(other.read_toml(list.to_toml(), "test").has_value());
  EXPECT_EQ(read.min_piece_size_m, 0.07);
  EXPECT_EQ(read.simplify_error_m, 0.01);
  EXPECT_FALSE(other.set("mesh.simplify_keep_ratio=2").has_value());
}

}  // namespace
}  // namespace hm
