#include "hm/report/render/mesh_renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/report/render/canvas.hpp"
#include "hm/report/render/color_map.hpp"
#include "hm/report/render/rasteriser.hpp"
#include "hm/report/render/stroke_font.hpp"

namespace hm {
namespace {

void add_quad(TriangleMesh& mesh, const Vec3& corner, const Vec3& u, const Vec3& v) {
  const auto k = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Vec3& p : {corner, Vec3(corner + u), Vec3(corner + u + v), Vec3(corner + v)})
    mesh.vertices.push_back(p.cast<float>());
  mesh.triangles.insert(mesh.triangles.end(), {{k, k + 1, k + 2}, {k, k + 2, k + 3}});
}

/// A box seen from inside (a scanned room) or from outside (a piece of furniture).
void add_box(TriangleMesh& mesh, const Vec3& low, const Vec3& high, bool inwards) {
  const Vec3 x(high.x() - low.x(), 0, 0), y(0, high.y() - low.y(), 0), z(0, 0, high.z() - low.z());
  const auto face = [&](const Vec3& o, const Vec3& u, const Vec3& v) {
    add_quad(mesh, o, inwards ? v : u, inwards ? u : v);
  };
  face(low, y, x);
  face(low + z, x, y);
  face(low, x, z);
  face(low + y, z, x);
  face(low, z, y);
  face(low + x, y, z);
}

/// Two rooms side by side with 15 cm of wall between them, and a table in the first.
TriangleMesh two_rooms() {
  TriangleMesh mesh;
  add_box(mesh, {0, 0, 0}, {4, 3, 2.5}, true);
  add_box(mesh, {4.15, 0, 0}, {8, 3, 2.5}, true);
  add_box(mesh, {1, 1, 0}, {2, 2, 0.8}, false);
  return mesh;
}

RenderOptions small(RenderStyle style = RenderStyle::kShaded) {
  RenderOptions options;
  options.width = 160;
  options.height = 100;
  options.style = style;
  return options;
}

bool same(const Image<Rgb8>& a, const Image<Rgb8>& b) {
  return a.width() == b.width() && a.height() == b.height() && std::ranges::equal(a.pixels(), b.pixels());
}

TEST(Rasteriser, MatchesRayCastingByBruteForce) {
  Rng rng(1);
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < 60; ++i) {
    for (int k = 0; k < 3; ++k)
      mesh.vertices.emplace_back(static_cast<float>(rng.uniform(-2, 2)),
                                 static_cast<float>(rng.uniform(-2, 2)),
                                 static_cast<float>(rng.uniform(-1, 4)));  // some behind the camera
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  for (const Projection kind : {Projection::kPerspective, Projection::kOrthographic})
    for (const Faces faces : {Faces::kFront, Faces::kBoth}) {
      RenderView view;
      view.T_world_camera = SE3(so3_exp(Vec3(0.1, -0.2, 0.3)), Vec3(0.1, 0.2, -0.5));
      view.projection = kind;
      view.focal_px = 40;
      view.pixels_per_m = 15;
      view.faces = faces;
      view.cut_height_m = 2.5;
      const ViewProjection projection(view, 60, 50, 1);
      RenderOptions size;
      size.width = 60;
      size.height = 50;
      const VisibilityBuffer buffer = rasterise(mesh, view, projection, size, ParallelLoop());
      int different = 0;
      for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 60; ++x) {
          const bool ortho = kind == Projection::kOrthographic;
          const Vec3 far = projection.unproject(x, y, ortho ? -9.0 : 1 / 9.0);
          const Vec3 near = projection.unproject(x, y, ortho ? -0.02 : 1 / 0.02);
          double best = 2;
          std::uint32_t hit = kNoTriangle;
          for (std::uint32_t i = 0; i < 60; ++i) {  // the segment near..far against every triangle
            const Vec3 a = mesh.vertices[3 * i].cast<double>(), b = mesh.vertices[3 * i + 1].cast<double>(),
                       c = mesh.vertices[3 * i + 2].cast<double>();
            Mat3 m;
            m << b - a, c - a, near - far;
            const Vec3 s = m.inverse() * (near - a);
            const bool inside = s.x() >= 0 && s.y() >= 0 && s.x() + s.y() <= 1 && s.z() >= 0 && s.z() <= 1;
            if (!inside || (near + s.z() * (far - near)).z() > 2.5 || s.z() >= best) continue;
            if (faces == Faces::kFront && (b - a).cross(c - a).dot(near - far) < 0) continue;
            best = s.z();
            hit = i;
          }
          different += hit != buffer.triangle(x, y) ? 1 : 0;
        }
      EXPECT_LE(different, 3);  // of 3000: samples on an edge
    }
}

TEST(SceneExtent, FindsFloorCeilingAndWallsInATurnedWorld) {
  TriangleMesh mesh = two_rooms();
  mesh.vertices.emplace_back(900.F, 900.F, 900.F);  // a stray vertex, and one that is broken
  mesh.vertices.emplace_back(std::nanf(""), 0.F, 0.F);
  const SE3 T_new_old(so3_exp(Vec3(1.2, 0.4, -0.7)), Vec3(3, 2, 1));
  for (auto& v : mesh.vertices) v = (T_new_old * Vec3(v.cast<double>())).cast<float>();
  const Vec3 true_up = T_new_old.rotation().col(2);
  const SceneExtent extent = scene_extent(mesh, so3_exp(Vec3(0.15, 0.1, 0)) * true_up);
  EXPECT_GT(extent.up.dot(true_up), 0.99999);
  const double origin = extent.up.dot(T_new_old.translation());
  EXPECT_NEAR(extent.floor_m - origin, 0, 0.06);
  ASSERT_TRUE(extent.ceiling_m.has_value());
  EXPECT_NEAR(*extent.ceiling_m - origin, 2.5, 0.06);
  EXPECT_NEAR(extent.box.sizes().x(), 8, 0.2);
  EXPECT_NEAR(extent.box.sizes().y(), 3, 0.2);
  EXPECT_GT(std::abs(extent.T_world_scene.rotation().col(0).dot(T_new_old.rotation().col(0))), 0.9999);
  EXPECT_GT(extent.points.size(), 15'000u);
}

TEST(SceneExtent, AKnownUpIsNotRefined) {
  const Vec3 up = so3_exp(Vec3(0.15, 0.1, 0)) * Vec3::UnitZ();
  EXPECT_EQ(scene_extent_along(two_rooms(), up).up, up);
  EXPECT_GT(scene_extent(two_rooms(), up).up.z(), 0.99999);
}

/// A floor with a wall along one of its long sides, which faces it.
TriangleMesh one_side_of_a_room(float side) {
  TriangleMesh mesh;
  const float y = 1.5F * side;
  mesh.vertices = {{-3, -1.5F, 0}, {3, -1.5F, 0}, {3, 1.5F, 0}, {-3, 1.5F, 0},
                   {-3, y, 0},     {3, y, 0},     {3, y, 2},    {-3, y, 2}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  if (side > 0)
    mesh.triangles.insert(mesh.triangles.end(), {{4, 5, 6}, {4, 6, 7}});
  else
    mesh.triangles.insert(mesh.triangles.end(), {{4, 6, 5}, {4, 7, 6}});
  return mesh;
}

TEST(SceneExtent, OneSideOfARoomIsSeenFromItsFront) {
  for (const float side : {-1.F, 1.F}) {
    const SceneExtent extent = scene_extent_along(one_side_of_a_room(side), Vec3::UnitZ());
    const Vec3 normal(0, -static_cast<double>(side), 0);
    EXPECT_LT(normal.dot(extent.T_world_scene.rotation().col(1)), -0.99) << side;
    EXPECT_LT(normal.dot(dollhouse_view(extent, small()).T_world_camera.rotation().col(2)), 0) << side;
    EXPECT_TRUE(extent.box.contains(extent.T_world_scene.inverse() * Vec3(2.9, side * 1.49, 0.5))) << side;
  }
}

TEST(SceneExtent, UpOfCameras) {
  Mat3 upright;
  upright << 1, 0, 0, 0, 0, 1, 0, -1, 0;  // z forward is y of the world, y down
  EXPECT_TRUE(up_of_cameras({{Time{}, SE3(upright, Vec3::Zero())}}).isApprox(Vec3::UnitZ()));
  EXPECT_TRUE(up_of_cameras({}).isApprox(Vec3::UnitZ()));
}

TEST(MeshRenderer, DollhouseFillsThePictureAndLooksInside) {
  const TriangleMesh mesh = two_rooms();
  const RenderOptions options = small();
  const RenderView view = dollhouse_view(scene_extent(mesh), options);
  const ViewProjection projection(view, options.width, options.height, 1);
  const VisibilityBuffer buffer = rasterise(mesh, view, projection, options, ParallelLoop());
  int left = 999, right = -1, top = 999, bottom = -1;
  bool floor_seen = false, ceiling_seen = false;
  for (int y = 0; y < options.height; ++y)
    for (int x = 0; x < options.width; ++x) {
      if (!buffer.hit(x, y)) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = std::max(bottom, y);
      const double z = projection.unproject(x, y, static_cast<double>(buffer.nearness(x, y))).z();
      floor_seen = floor_seen || z < 0.01;
      ceiling_seen = ceiling_seen || z > 2.45;
    }
  EXPECT_TRUE(floor_seen);
  EXPECT_FALSE(ceiling_seen);
  EXPECT_GE(left, 2);
  EXPECT_LE(right, options.width - 3);
  EXPECT_GE(top, 1);
  EXPECT_LE(bottom, options.height - 2);
  EXPECT_TRUE(right - left > 0.8 * options.width || bottom - top > 0.8 * options.height);
}

TEST(MeshRenderer, KnownColoursAtKnownPixels) {
  // A red wall on the left, a green one on the right, facing a camera 2 m away; sky above.
  TriangleMesh mesh;
  add_quad(mesh, {-2, 2, -2}, {2, 0, 0}, {0, 0, 2});
  add_quad(mesh, {0, 2, -2}, {2, 0, 0}, {0, 0, 2});
  mesh.colors.assign(8, {200, 0, 0});
  std::fill(mesh.colors.begin() + 4, mesh.colors.end(), Rgb8{0, 200, 0});
  Mat3 axes;
  axes << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  const RenderOptions options = small(RenderStyle::kColor);
  const Image<Rgb8> image =
      render_mesh(mesh, camera_view(SE3(axes, Vec3::Zero()), options), options, ParallelLoop());
  ASSERT_EQ(image.width(), 160);
  ASSERT_EQ(image.height(), 100);
  const Rgb8 red = image(40, 75), green = image(120, 75), sky = image(80, 10);
  EXPECT_GT(red.r, 130);
  EXPECT_EQ(red.g, 0);
  EXPECT_GT(green.g, 130);
  EXPECT_EQ(green.r, 0);
  EXPECT_GT(sky.b, 230);
  // At the border between them half of the samples are of each.
  EXPECT_EQ(image(79, 75).g, 0);
  EXPECT_EQ(image(80, 75).r, 0);
}

TEST(MeshRenderer, HeatMapColoursAndLegend) {
  TriangleMesh mesh;
  add_quad(mesh, {0, 0, 0}, {8, 0, 0}, {0, 5, 0});
  const std::vector<float> errors{-0.01F, 0.01F, 0.01F, -0.01F};
  RenderOptions options = small(RenderStyle::kScalar);
  options.vertex_values = errors;
  const RenderView view = plan_view(scene_extent(mesh), options);
  const Image<Rgb8> image = render_mesh(mesh, view, options, ParallelLoop());
  const Rgb8 low = image(15, 90), middle = image(80, 90), high = image(145, 90);
  EXPECT_GT(low.b, low.r + 80);
  EXPECT_GT(high.r, high.b + 80);
  EXPECT_LT(std::abs(middle.r - middle.b), 25);
  const std::vector<float> unknown(4, std::nanf(""));
  options.vertex_values = unknown;
  const Rgb8 grey = render_mesh(mesh, view, options, ParallelLoop())(80, 90);
  EXPECT_LT(std::abs(grey.r - grey.b), 3);
}

TEST(FloorPlan, WallsAreDarkRoomsAreLight) {
  const TriangleMesh mesh = two_rooms();
  RenderOptions options = small();
  options.width = 400;
  options.height = 200;
  const SceneExtent extent = scene_extent(mesh);
  const Image<Rgb8> plan = render_floor_plan(mesh, extent, options, ParallelLoop());
  const RenderView view = plan_view(extent, options);
  const ViewProjection projection(view, options.width, options.height, 1);
  const auto at = [&](double x, double y) {
    const Vec3 screen = projection.project(projection.to_camera(Vec3(x, y, 0)));
    return plan(static_cast<int>(std::lround(screen.x())), static_cast<int>(std::lround(screen.y())));
  };
  EXPECT_GT(at(3, 2.5).g, 180);    // floor of the first room
  EXPECT_GT(at(6, 1.5).g, 180);    // and of the second
  EXPECT_GT(at(1.5, 1.5).g, 180);  // the table is lower than the cut
  EXPECT_LT(at(4.07, 1.5).g, 80);  // inside of the wall between them
  EXPECT_LT(at(0, 1.2).g, 110);    // outer wall
}

TEST(MeshRenderer, SameBitsForAnyNumberOfThreadsAndRuns) {
  const TriangleMesh mesh = two_rooms();
  const RenderOptions options = small(RenderStyle::kHeight);
  const RenderView view = dollhouse_view(scene_extent(mesh), options);
  const Image<Rgb8> one = render_mesh(mesh, view, options, ParallelLoop(1));
  EXPECT_TRUE(same(one, render_mesh(mesh, view, options, ParallelLoop(2))));
  EXPECT_TRUE(same(one, render_mesh(mesh, view, options, ParallelLoop(1))));
}

TEST(MeshRenderer, NothingBrokenCanCrashIt) {
  TriangleMesh broken = two_rooms();
  const TriangleMesh whole = broken;
  const float inf = std::numeric_limits<float>::infinity();
  broken.vertices.insert(broken.vertices.end(), {{std::nanf(""), 0, 0}, {inf, 1, 1}, {1e30F, -1e30F, 1e30F}});
  const auto n = static_cast<std::uint32_t>(whole.vertices.size());
  for (const auto& t : {std::array<std::uint32_t, 3>{0, 1, n},
                        {n + 1, 1, 2},
                        {0, n + 2, 2},
                        {0, 0, 0},
                        {0, 1, 1},
                        {0, 1, 99'999}})
    broken.triangles.push_back(t);
  Trajectory path{{Time{0}, SE3()},
                  {Time{1}, SE3(Mat3::Identity(), Vec3(inf, 0, 0))},
                  {Time{2}, SE3(Mat3::Identity(), Vec3(1, 1, 1))}};
  for (RenderStyle style : {RenderStyle::kShaded, RenderStyle::kColor, RenderStyle::kHeight}) {
    RenderOptions options = small(style);
    options.trajectory = &path;
    const SceneExtent extent = scene_extent(whole);
    // Broken triangles change nothing.
    EXPECT_TRUE(same(render_mesh(broken, dollhouse_view(extent, options), options, ParallelLoop()),
                     render_mesh(whole, dollhouse_view(extent, options), options, ParallelLoop())));
    for (const TriangleMesh& mesh : {broken, TriangleMesh{}}) {
      const SceneExtent own = scene_extent(mesh, Vec3(std::nan(""), 0, 0));
      EXPECT_EQ(render_mesh(mesh, dollhouse_view(own, options), options, ParallelLoop()).width(), 160);
      EXPECT_EQ(render_floor_plan(mesh, own, options, ParallelLoop()).height(), 100);
      EXPECT_EQ(render_mesh(mesh, camera_view(SE3(), options), options, ParallelLoop()).width(), 160);
    }
  }
  RenderOptions tiny = small();
  tiny.width = tiny.height = 1;
  EXPECT_EQ(render_mesh(whole, dollhouse_view(scene_extent(whole), tiny), tiny, ParallelLoop()).size(), 1u);
}

TEST(ColorMap, EvenAndMonotonic) {
  double last = -1;
  for (int i = 0; i <= 100; ++i) {
    const Vec3 c = sequential_color(i / 100.0);
    const double luminance = c.dot(Vec3(0.2126, 0.7152, 0.0722));
    EXPECT_GT(luminance, last - 1e-9);
    last = luminance;
    EXPECT_LT((sequential_color((i + 1) / 100.0) - c).norm(), 0.05);
  }
  EXPECT_TRUE(oklab_to_srgb(Vec3(1, 0, 0)).isApprox(Vec3::Ones(), 1e-3));
  EXPECT_TRUE(sequential_color(std::nan("")).allFinite());
  EXPECT_TRUE(diverging_color(-5).isApprox(diverging_color(-1)));
}

TEST(Canvas, LinesRectanglesAndTextStayInside) {
  Image<Rgb8> image(40, 30, {255, 255, 255});
  fill_rectangle(image, {Vec2(9.5, 9.5), Vec2(19.5, 14.5)}, {{0, 0, 0}, 1});
  EXPECT_EQ(image(10, 10), (Rgb8{0, 0, 0}));
  EXPECT_EQ(image(19, 14), (Rgb8{0, 0, 0}));
  EXPECT_EQ(image(20, 14), (Rgb8{255, 255, 255}));
  EXPECT_EQ(image(10, 9), (Rgb8{255, 255, 255}));
  draw_line(image, {-500, 20}, {500, 20}, 1, {{255, 0, 0}, 1});
  for (int x = 0; x < 40; ++x) EXPECT_EQ(image(x, 20), (Rgb8{255, 0, 0})) << x;
  draw_line(image, {std::nan(""), 0}, {1, 1}, 1, {{0, 0, 0}, 1});
  draw_text(image, {-20, 3}, "far outside \x80\n", {12, {{0, 0, 0}, 1}, TextAlign::kRight});
  for (int c = 33; c < 127; ++c) EXPECT_FALSE(stroke_glyph(static_cast<char>(c)).strokes.empty()) << c;
  EXPECT_GT(text_width_px("wide", 12), text_width_px("wi", 12));
}

}  // namespace
}  // namespace hm
