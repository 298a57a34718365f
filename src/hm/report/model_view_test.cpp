#include "hm/report/model_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hm/report/floor_plan_svg.hpp"
#include "hm/report/page_resources.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/trajectory_plots.hpp"

namespace hm {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// The inside of a box with its corner at the origin, in squares of `step` metres, without a lid.
TriangleMesh open_box(const Vec3& size, double step) {
  TriangleMesh mesh;
  const auto add_side = [&](const Vec3& corner, const Vec3& u, const Vec3& v) {
    const int columns = static_cast<int>(std::lround(u.norm() / step)),
              rows = static_cast<int>(std::lround(v.norm() / step));
    for (int i = 0; i < columns; ++i)
      for (int j = 0; j < rows; ++j) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const auto& [a, b] : {std::pair{0, 0}, std::pair{1, 0}, std::pair{1, 1}, std::pair{0, 1}})
          mesh.vertices.push_back((corner + (i + a) * u / columns + (j + b) * v / rows).cast<float>());
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.triangles.push_back({first, first + 2, first + 3});
      }
  };
  const Vec3 x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
  add_side(Vec3::Zero(), x, y);  // the floor faces up, walls inwards
  add_side(Vec3::Zero(), z, x);
  add_side(y, x, z);
  add_side(Vec3::Zero(), y, z);
  add_side(x, z, y);
  return mesh;
}

/// What stands between two marks.
std::string between(const std::string& text, const std::string& from, const std::string& to) {
  const std::size_t begin = text.find(from) + from.size();
  return text.substr(begin, text.find(to, begin) - begin);
}

TEST(ModelView, HoldsEveryTriangleAndLeavesOutWhatIsNotFinite) {
  ModelView view;
  view.mesh = open_box(Vec3(4, 3, 2.5), 0.5);
  const std::size_t whole = view.mesh.triangles.size();
  view.extent = scene_extent(view.mesh);
  EXPECT_EQ(between(model_view_html(view), "\"index_count\":", ","), std::to_string(3 * whole));
  view.mesh.vertices[0].x() = std::numeric_limits<float>::quiet_NaN();  // of the two triangles of a square
  view.mesh.triangles.push_back({1, 2, 4'000'000});
  const std::string html = model_view_html(view);
  EXPECT_EQ(between(html, "\"index_count\":", ","), std::to_string(3 * (whole - 2)));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
  EXPECT_EQ(between(html, "\"colors\":\"", "\""), "");
  view.errors_m.assign(view.mesh.vertices.size(), 0.001F);
  EXPECT_NE(between(model_view_html(view), "\"errors\":\"", "\""), "");
  view.mesh.triangles.clear();
  EXPECT_EQ(model_view_html(view), "");
}

TEST(ModelView, PathIsThinned) {
  Trajectory path;
  for (int i = 0; i < 10'001; ++i)
    path.push_back({Time::from_seconds(i), SE3(Mat3::Identity(), Vec3(i, 0, 0))});
  path[5].T_world_base = SE3(Mat3::Identity(), Vec3(std::nan(""), 0, 0));
  const auto points = path_points(path, 100);
  EXPECT_LE(points.size(), 100u);
  EXPECT_GT(points.size(), 90u);
  EXPECT_EQ(points.front(), Vec3(0, 0, 0));
}

TEST(ModelView, ScriptAndStyleStayWithinTheirElements) {
  EXPECT_THAT(std::string(model_view_js()), HasSubstr("showModel"));
  EXPECT_THAT(std::string(model_view_js()), Not(HasSubstr("</script")));
  EXPECT_THAT(std::string(model_view_js()), Not(HasSubstr("http")));
  EXPECT_THAT(std::string(report_css()), Not(HasSubstr("</style")));
  EXPECT_THAT(std::string(report_css()), Not(HasSubstr("url(")));
}

TEST(SceneSize, OfAnOpenBox) {
  const TriangleMesh mesh = open_box(Vec3(4, 3, 2.5), 0.05);
  const SceneSize size = scene_size(mesh, scene_extent(mesh));
  EXPECT_NEAR(size.length_m, 4, 0.1);
  EXPECT_NEAR(size.width_m, 3, 0.1);
  EXPECT_NEAR(size.height_m, 2.5, 0.1);
  EXPECT_NEAR(size.area_m2, 12, 0.5);
  EXPECT_FALSE(size.ceiling_m);
  EXPECT_EQ(scene_size({}, {}).area_m2, 0);
}

TEST(FloorPlan, WallsAreChainedAndTheScenesSizeIsWritten) {
  const TriangleMesh mesh = open_box(Vec3(4, 3, 2.5), 0.1);
  const SceneExtent extent = scene_extent(mesh);
  const std::string svg = floor_plan_svg(mesh, extent, scene_size(mesh, extent), nullptr);
  // Four walls of squares that share no vertices: a piece a triangle would be 280 pieces.
  const std::string walls = between(svg, "<path d=\"", "\"");
  EXPECT_LT(std::count(walls.begin(), walls.end(), 'M'), 200);
  EXPECT_GE(std::count(walls.begin(), walls.end(), 'M'), 4);
  EXPECT_THAT(svg, HasSubstr(" m\u00b2"));
  EXPECT_NEAR(std::stod(between(svg, "text-anchor=\"middle\">", " m")), 4.0, 0.1);
  EXPECT_EQ(floor_plan_svg({}, extent, {}, nullptr), "");
}

TEST(FloorPlan, AVehicleFliesOverIt) {
  const TriangleMesh mesh = open_box(Vec3(4, 3, 2.5), 0.1);
  const SceneExtent extent = scene_extent(mesh);
  Trajectory path;
  for (int i = 0; i <= 10; ++i)
    path.push_back(
        {Time{std::int64_t{1'000'000'000} * i}, SE3(Mat3::Identity(), Vec3(0.2 * i, 0, 1 + 0.01 * i))});
  PlanFlight flight{&path, 5, {Vec3(1, 0, 1)}};
  const std::string svg = flight_plan_svg(mesh, extent, flight);
  EXPECT_NE(svg.find("dur=\"5.0s\" repeatCount=\"indefinite\""), std::string::npos);
  std::size_t moving = 0;
  for (std::size_t at = svg.find("<animateTransform"); at != std::string::npos;
       at = svg.find("<animateTransform", at + 1))
    ++moving;
  EXPECT_EQ(moving, 3U) << "place, heading, point of the height";
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(flight_plan_svg({}, extent, flight), "");
  path.resize(1);
  EXPECT_EQ(flight_plan_svg(mesh, extent, flight), "");
}

TEST(FloorPlan, FrameHoldsThePathButNotOneThatWentAstray) {
  const TriangleMesh mesh = open_box(Vec3(4, 3, 2.5), 0.1);
  const SceneExtent extent = scene_extent(mesh);
  Trajectory path{{Time::from_seconds(0), SE3(Mat3::Identity(), Vec3(-1, 1, 1))}};
  const Box3 near = framed(extent, &path).box;
  EXPECT_NEAR(near.sizes().head<2>().maxCoeff(), 5.0, 0.1);
  path.push_back({Time::from_seconds(1), SE3(Mat3::Identity(), Vec3(-5000, 1, 1))});
  EXPECT_LT(framed(extent, &path).box.sizes().head<2>().maxCoeff(), 9);
}

TEST(UnphysicalValues, AreTakenOutAndMarked) {
  std::vector<PlotSeries> series{{"yaw rate", {0, 1, 2, 3}, {0.1, 52, -0.2, 0.1}}};
  const std::string said = set_aside_unphysical(series, kMaxTurnRate_rad_s, "rad/s");
  EXPECT_THAT(said, HasSubstr("1 value lies beyond 20 rad/s, up to 52"));
  ASSERT_EQ(series.size(), 2u);
  EXPECT_TRUE(std::isnan(series[0].y[1]));
  EXPECT_EQ(series[1].y, std::vector<double>{20});
  EXPECT_THAT(plot_svg(series, {}), HasSubstr("1 not physical"));
  std::vector<PlotSeries> calm{{"yaw rate", {0, 1}, {0.1, -19.9}}};
  EXPECT_EQ(set_aside_unphysical(calm, kMaxTurnRate_rad_s, "rad/s"), "");
  EXPECT_EQ(calm.size(), 1u);
}

TEST(TrajectoryPlots, ErrorsBeforeTheAlignmentAreThoseOfTheFilesGiven) {
  Trajectory truth, estimate;
  for (int i = 0; i < 50; ++i) {
    const Vec3 p(std::cos(0.1 * i), std::sin(0.1 * i), 0.01 * i);
    truth.push_back({Time::from_seconds(0.1 * i), SE3(Mat3::Identity(), p)});
    estimate.push_back({Time::from_seconds(0.1 * i), SE3(Mat3::Identity(), p + Vec3(0.3, 0, 0.4))});
  }
  const auto error = evaluate_trajectory(truth, estimate);
  ASSERT_TRUE(error) << to_string(error.error());
  EXPECT_LT(error->position_m.rmse, 1e-6);
  EXPECT_NEAR(error->position_given_m.min, 0.5, 1e-6);
  EXPECT_NEAR(error->position_given_m.max, 0.5, 1e-6);
  HtmlReport report("path");
  add_error_path(report, *error);
  add_error_statistics(report, *error);
  add_pose_components(report, *error);
  add_position_histogram(report, *error);
  const std::string html = report.html();
  for (const char* part : {"as given", "0.5000", "roll (deg)", "coloured by its position error"})
    EXPECT_THAT(html, HasSubstr(part));
}

TEST(TrajectoryPlots, MotionThatIsNotPhysicalIsMarkedAlsoAmongManyPoses) {
  Trajectory path;  // more poses than are drawn, at 0.1 m/s and 0.2 rad/s
  for (int i = 0; i < 10'000; ++i)
    path.push_back(
        {Time::from_seconds(0.01 * i), SE3(so3_exp(Vec3(0, 0, 0.002 * i)), Vec3(0.001 * i, 0, 0))});
  const auto page = [&path] {
    HtmlReport report("path");
    const NamedTrajectory named{"estimate", &path};
    add_motion_plots(report, {&named, 1});
    return report.html();
  };
  EXPECT_THAT(page(), Not(HasSubstr("not physical")));
  path[5001].stamp = path[5000].stamp + Duration{20'000};  // 2 mrad and 1 mm in 20 us
  const std::string marked = page();
  EXPECT_THAT(marked, HasSubstr("1 value lies beyond 30 m/s, up to 50"));
  EXPECT_THAT(marked, HasSubstr("1 value lies beyond 20 rad/s, up to 100"));
  EXPECT_THAT(marked, HasSubstr("1 not physical"));
}

}  // namespace
}  // namespace hm
