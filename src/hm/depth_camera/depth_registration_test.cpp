#include "hm/depth_camera/depth_registration.hpp"

#include <gmock/gmock.h>

#include <hwy/targets.h>
#include <array>
#include <cmath>
#include <limits>

#include "hm/depth_camera/registration_kernels.hpp"
#include "hm/depth_camera/registration_test_support.hpp"
#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

using namespace testing_recordings;
using namespace registration_test;

/// Depth of a plane n . p = d, seen by a camera.
double plane_depth(const PinholeCamera& camera, const Vec2& pixel, const Vec3& n, double d) {
  return d / n.dot(camera.unproject(pixel, 1.0));
}

TEST(DepthRegistration, APlaneStaysThePlane) {
  const Vec3 n_depth = Vec3(0.2, -0.1, 1).normalized();
  const double d_depth = 2.0;
  Image<std::uint16_t> depth(160, 120);
  const double unit = 1e-4;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      depth(x, y) = static_cast<std::uint16_t>(
          std::lround(plane_depth(kDepthCamera, Vec2(x, y), n_depth, d_depth) / unit));
  const auto registered = DepthRegistration(kDepthCamera, kColorCamera, kMotion).apply(depth, unit);
  const Vec3 n_color = kMotion.rotation() * n_depth;
  const double d_color = d_depth + n_color.dot(kMotion.translation());
  int inside = 0, holes = 0;
  double sum = 0, worst = 0;
  for (int y = 8; y < 112; ++y)
    for (int x = 8; x < 152; ++x) {
      ++inside;
      if (registered(x, y) == 0) {
        ++holes;
        continue;
      }
      const double error = registered(x, y) * unit - plane_depth(kColorCamera, Vec2(x, y), n_color, d_color);
      sum += error;
      worst = std::max(worst, std::abs(error));
    }
  EXPECT_EQ(holes, 0) << "of " << inside;
  // A reading moves by up to half a pixel: up to 1.7 mm here. Cutting instead of rounding would shift the
  // mean.
  EXPECT_LT(worst, 0.0035);
  EXPECT_LT(std::abs(sum / inside), 2e-4);
}

/// Rows for one step, of random numbers; of readings that follow each other or do not.
struct StepRows {
  static constexpr int kWidth = 2 * detail::kRowBlock_px, kMargin = detail::kBlock_px, kCells = 70000;
  StepRows(Rng& rng, bool is_smooth) : closest(kCells) {
    for (int x = 0; x < kWidth; ++x)
      for (int axis = 0; axis < 3; ++axis)
        columns[static_cast<std::size_t>(detail::column_at(x, axis))] =
            static_cast<float>(is_smooth ? (axis == 0   ? 0.93 * x
                                            : axis == 1 ? 0.003 * x
                                                        : 1e-4 * x)
                                         : rng.uniform(-90, 90));
    for (auto& units : depth)
      units = static_cast<std::uint16_t>(rng.below(9) == 0 ? rng.below(2) * rng.below(65536)
                                         : is_smooth       ? 2000 + rng.below(9)
                                                           : rng.below(65536));
    for (auto& units : closest) units = static_cast<std::uint16_t>(rng.below(65536));
    step.projection.width = kWidth, step.projection.stride = 83;
    step.projection.first_row = static_cast<float>(rng.below(7));
    for (std::size_t i = 0; i < 3; ++i) {
      step.projection.row[i] =
          static_cast<float>(is_smooth ? 9 - 4.0 * static_cast<double>(i) : rng.uniform(-1, 1));
      step.projection.origin[i] = static_cast<float>(is_smooth ? 60 : rng.uniform(-9000, 9000));
    }
    step.projection.lowest = static_cast<std::uint16_t>(1 + rng.below(500));
    step.projection.highest = static_cast<std::uint16_t>(40000 + rng.below(20000));
  }
  /// With the addresses of this object.
  detail::RegistrationStep& at_home() {
    step.projection.columns = columns.data();
    step.depth = depth.data();
    step.placed = {cells.data() + kMargin, closeness.data() + kMargin};
    step.splatted = {before_cells.data() + kMargin, before_closeness.data() + kMargin};
    step.closest = closest.data();
    return step;
  }
  /// What was placed is what the next step puts into cells.
  void go_on() {
    before_cells.swap(cells);
    before_closeness.swap(closeness);
  }
  using Numbers = AlignedVector<std::uint16_t>;
  detail::RegistrationStep step;
  AlignedVector<float> columns = AlignedVector<float>(3 * kWidth);
  Numbers closest;
  Numbers depth = Numbers(kWidth + detail::kBlock_px);
  Numbers cells = Numbers(kWidth + 2 * kMargin), before_cells = cells;
  Numbers closeness = cells, before_closeness = cells;
};

TEST(DepthRegistration, VectorsOfEveryKindGiveThePlainBits) {
  constexpr int kWidth = 77, kStride = 83;
  Rng rng(8);
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    RecordProperty(hwy::TargetName(left & -left), "compared");
    for (int round = 0; round < 100; ++round) {
      StepRows plain(rng, round % 2 == 0), fast = plain;
      for (int step = 0; step < 2; ++step) {
        ASSERT_EQ(detail::register_step_plain(plain.at_home()), detail::register_step_simd(fast.at_home()));
        ASSERT_EQ(plain.cells, fast.cells) << hwy::TargetName(left & -left);
        ASSERT_EQ(plain.closeness, fast.closeness) << hwy::TargetName(left & -left);
        ASSERT_EQ(plain.closest, fast.closest) << hwy::TargetName(left & -left);
        plain.go_on(), fast.go_on();
      }
      std::vector<std::uint16_t> cells(3 * kStride + DepthRegistration::kRowSlack_px), fill_plain(kWidth),
          fill_fast(kWidth);
      for (auto& cell : cells)
        cell = static_cast<std::uint16_t>(rng.below(3) == 0 ? 0 : rng.below(60) + 900 * (round % 70));
      const detail::FilledRow row{cells.data() + 1, cells.data() + kStride + 1,
                                  cells.data() + 2 * kStride + 1, kWidth};
      detail::fill_row_plain(row, fill_plain.data());
      detail::fill_row_simd(row, fill_fast.data());
      ASSERT_EQ(fill_plain, fill_fast) << hwy::TargetName(left & -left);
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

/// Widths that are no whole vectors, and a colour camera with fewer cells than the depth camera has columns.
TEST(DepthRegistration, CamerasOfAnySize) {
  for (const auto& [width, height, color_width, color_height] :
       {std::array{157, 119, 160, 120}, {33, 5, 97, 70}, {160, 7, 3, 2}, {1, 1, 40, 30}}) {
    const int cx = width / 2, cy = height / 2, color_cx = color_width / 2, color_cy = color_height / 2;
    const PinholeCamera from{width, height, 145, 144, double(cx), double(cy), {}};
    const PinholeCamera to{color_width, color_height, 145, 144, double(color_cx), double(color_cy), {}};
    const Image<std::uint16_t> depth(width, height, 2000);
    const auto registered = DepthRegistration(from, to, SE3()).apply(depth, 1e-3);
    for (int y = 0; y < color_height; ++y)
      for (int x = 0; x < color_width; ++x)
        ASSERT_EQ(registered(x, y), depth.contains(x - color_cx + cx, y - color_cy + cy) ? 2000 : 0)
            << x << ", " << y << ": " << width << " to " << color_width;
  }
}

/// Single precision rounds them to either row, and both are within reach.
TEST(DepthRegistration, ReadingsBetweenTwoRowsGoToOneOfThem) {
  PinholeCamera lower = kDepthCamera;
  lower.cy += 0.5;
  const DepthRegistration registration(kDepthCamera, lower, SE3());
  for (int y = 0; y < 119; ++y) {
    Image<std::uint16_t> depth(160, 120);
    std::ranges::fill(depth.row(y), std::uint16_t{2000});
    const auto registered = registration.apply(depth, 1e-3);
    for (int x = 0; x < 160; ++x)
      ASSERT_EQ(std::max(registered(x, y), registered(x, y + 1)), 2000) << x << ", " << y;
  }
}

TEST(DepthRegistration, NearestReadingWins) {
  Image<std::uint16_t> depth(160, 120);
  // Two readings on one ray of the colour camera.
  const Vec3 ray = kColorCamera.unproject(Vec2(70, 50), 1.0);
  const auto place = [&](double z) { return kDepthCamera.project(kMotion.inverse() * Vec3(z * ray)); };
  for (const double z : {1.0, 3.0}) {
    const Vec2 at = place(z);
    depth(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))) =
        static_cast<std::uint16_t>(z * 1000);
  }
  const auto registered = DepthRegistration(kDepthCamera, kColorCamera, kMotion).apply(depth, 1e-3);
  EXPECT_NEAR(registered(70, 50), 1000, 5);
}

TEST(DepthRegistrationDeathTest, RowsComeInOrderAndAllOfThem) {
  const DepthRegistration registration(kDepthCamera, kColorCamera, kMotion);
  const std::vector<std::uint16_t> row(160 + DepthRegistration::kRowSlack_px);
  DepthRegistration::Canvas canvas(registration);
  Image<std::uint16_t> registered;
  EXPECT_DEATH(canvas.add_row(0, row.data()), "row 0");
  canvas.begin(1e-3);
  EXPECT_DEATH(canvas.add_row(1, row.data()), "row 1 after 0 rows");
  canvas.add_row(0, row.data());
  EXPECT_DEATH(canvas.finish(registered), "1 rows of 120");
}

TEST(DepthRegistration, FillsOnlyHolesOfOnePixelOnOneSurface) {
  PinholeCamera camera = kDepthCamera;
  Image<std::uint16_t> depth(160, 120, 2000);
  depth(20, 20) = 0;                  // one pixel: filled
  depth(40, 40) = depth(41, 40) = 0;  // two wide, one high: filled from above and below
  for (int y = 59; y < 62; ++y)
    for (int x = 59; x < 62; ++x) depth(x, y) = 0;  // three by three: stays
  for (int y = 80; y < 90; ++y) {                   // a gap between two depths: stays
    for (int x = 81; x < 90; ++x) depth(x, y) = 3000;
    depth(80, y) = 0;
  }
  const auto same = DepthRegistration(camera, camera, SE3()).apply(depth, 1e-3);
  EXPECT_EQ(same(20, 20), 2000);
  EXPECT_EQ(same(40, 40), 2000);
  EXPECT_EQ(same(60, 60), 0);
  EXPECT_EQ(same(59, 59), 0);
  EXPECT_EQ(same(80, 85), 0);
}

}  // namespace
}  // namespace hm
