#include "hm/odometry/registration/patch_alignment.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/odometry/feature/feature_detection.hpp"
#include "hm/odometry/registration/photometric_alignment.hpp"
#include "hm/odometry/testing/textured_room.hpp"

namespace hm {
namespace {

struct View {
  RgbdFrame frame;
  ImagePyramid pyramid;
  DepthGrid grid;
};

View view_at(const SE3& T, double gray_sigma = 0, std::uint64_t seed = 1, double brightness = 1) {
  Rng rng(seed);
  TexturedRoom room;
  room.brightness = brightness;
  View view{render_room(room, room_camera(), T, {}, {false, gray_sigma, {}}, &rng), {}, {}};
  view.pyramid = ImagePyramid(to_gray(view.frame.color), 4);
  view.grid = make_depth_grid(view.frame.depth, room_camera(), {}, 10);
  return view;
}

TEST(ImagePyramid, LevelsAreMeansAndPixelsKeepTheirPlace) {
  Image<std::uint8_t> image(8, 4);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 8; ++x) image(x, y) = static_cast<std::uint8_t>(10 * x + y);
  const ImagePyramid pyramid(image, 3);
  EXPECT_EQ(pyramid.level(1).width(), 4);
  EXPECT_EQ(pyramid.level(2).height(), 1);
  EXPECT_EQ(pyramid.level(1)(1, 0), 26);  // mean of 20 30 21 31, rounded
  EXPECT_EQ(pixel_in_level(Vec2(0.5, 2.5), 1), Vec2(0, 1));
  EXPECT_EQ(pixel_from_level(pixel_in_level(Vec2(17.25, 3), 2), 2), Vec2(17.25, 3));
}

TEST(PatchAlignment, FindsPatchesToATenthOfAPixel) {
  const SE3 T_a(so3_exp(Vec3(0.1, 0.3, 0)), Vec3(0.1, 0, 0));
  const SE3 T_b = T_a * SE3(so3_exp(Vec3(0.01, -0.02, 0.12)), Vec3(0.08, -0.04, 0.12));
  const View a = view_at(T_a), b = view_at(T_b, 2.0, 7, 0.8);  // noisy, and darker
  const SurfaceGrid surface = make_surface_grid(a.grid, {});
  int found = 0, tried = 0;
  double squares = 0, normalised = 0, promised = 0;
  for (int y = 40; y < 200; y += 16)
    for (int x = 40; x < 280; x += 16) {
      const SurfaceElement& element = surface.elements(x / 4, y / 4);
      if (element.sigma_m == 0) continue;
      const Vec3 p_a = room_camera().unproject(Vec2(x, y), a.frame.depth.depth_m(x, y));
      const SE3 T_ab = T_a.inverse() * T_b;
      const Vec3 p_b = T_ab.inverse() * p_a;
      const Vec2 truth = room_camera().project(p_b);
      const auto warp =
          plane_warp(room_camera(), T_ab, p_b, T_ab.rotation().transpose() * element.normal.cast<double>());
      if (!warp || !room_camera().contains(truth)) continue;
      ++tried;
      const auto match = align_patch({&a.pyramid, Vec2(x, y), *warp}, b.pyramid, truth + Vec2(3, -2.5), {});
      if (!match) continue;
      ++found;
      const Vec2 error = match->pixel - truth;
      squares += error.squaredNorm();
      normalised += error.dot(match->information * error);
      promised += match->information.inverse().trace();
    }
  ASSERT_GT(tried, 80);
  EXPECT_GT(found, 0.7 * tried);
  EXPECT_LT(std::sqrt(squares / found), 0.1);
  EXPECT_LT(normalised / found, 2);  // 2 for exact information; it must not be overconfident
  EXPECT_LT(std::sqrt(promised / found), 0.3);
}

TEST(PatchAlignment, TheWarpIsTheNumericDerivative) {
  const SE3 T_ref_cur(so3_exp(Vec3(0.1, -0.2, 0.3)), Vec3(0.2, 0.1, -0.1));
  const Vec3 p_cur(0.3, -0.2, 1.8), normal = Vec3(0.3, 0.2, -0.9).normalized();
  const PinholeCamera camera{640, 480, 481.2, -480, 319.5, 239.5, {}};
  const auto warp = plane_warp(camera, T_ref_cur, p_cur, normal);
  ASSERT_TRUE(warp);
  const auto seen_in_ref = [&](const Vec2& pixel) {
    const Vec3 ray = camera.unproject(pixel, 1);
    return camera.project(T_ref_cur * (ray * (normal.dot(p_cur) / normal.dot(ray))));
  };
  const Vec2 pixel = camera.project(p_cur);
  for (int axis = 0; axis < 2; ++axis) {
    const Vec2 h = 1e-4 * Vec2::Unit(axis);
    EXPECT_LT(((seen_in_ref(pixel + h) - seen_in_ref(pixel - h)) / 2e-4 - warp->col(axis)).norm(), 1e-5);
  }
  EXPECT_FALSE(plane_warp(camera, T_ref_cur, p_cur, Vec3(1.8, 0, -0.3).normalized()));  // seen from the side
}

TEST(PatchAlignment, RefusesWhatIsNotThere) {
  const View a = view_at({}), other = view_at(SE3(so3_exp(Vec3(0, 2.5, 0)), Vec3::Zero()));
  const PatchSource source{&a.pyramid, Vec2(160, 120), Mat2::Identity()};
  EXPECT_TRUE(align_patch(source, a.pyramid, Vec2(161, 119), {}));
  EXPECT_FALSE(align_patch(source, other.pyramid, Vec2(160, 120), {}));
  EXPECT_FALSE(align_patch(source, a.pyramid, Vec2(2, 120), {}));
  EXPECT_FALSE(align_patch(source, a.pyramid, Vec2(-1e6, 1e9), {}));
  EXPECT_FALSE(align_patch({&a.pyramid, Vec2(1, 1), Mat2::Identity()}, a.pyramid, Vec2(160, 120), {}));
  const ImagePyramid blank(Image<std::uint8_t>(320, 240, 90), 4);
  EXPECT_FALSE(align_patch({&blank, Vec2(160, 120), Mat2::Identity()}, blank, Vec2(160, 120), {}));
}

TEST(PhotometricAlignment, FindsMotionsOfManyPixels) {
  const View a = view_at({});
  const PhotometricReference reference(a.pyramid, a.grid, room_camera(), 2000);
  for (const Vec3& turn : {Vec3(0, 0.035, 0), Vec3(-0.02, 0, 0.05), Vec3(0.02, -0.03, 0)}) {
    const SE3 truth(so3_exp(turn), Vec3(0.03, -0.02, 0.05));
    const View b = view_at(truth, 2.0, 3);
    const PhotometricResult result = align_photometrically(reference, b.pyramid, {SE3{}});
    EXPECT_LT((result.T_ref_cur.inverse() * truth).angle(), 0.006);
    EXPECT_LT((result.T_ref_cur.inverse() * truth).translation().norm(), 0.02);
    EXPECT_GT(result.overlap_ratio, 0.5);
  }
}

TEST(PhotometricAlignment, BeginsWithTheBestGuessAndKeepsItWhereNothingIsSeen) {
  const SE3 far(so3_exp(Vec3(0, 0.7, 0)), Vec3(0.1, 0, 0));
  const View a = view_at({}), b = view_at(far);
  const PhotometricReference reference(a.pyramid, a.grid, room_camera(), 2000);
  const SE3 near = far * SE3(so3_exp(Vec3(0.03, 0.03, 0)), Vec3(0.02, 0, 0));
  const PhotometricResult result = align_photometrically(reference, b.pyramid, {SE3{}, near});
  EXPECT_LT((result.T_ref_cur.inverse() * far).angle(), 0.01);
  const View dark = view_at({}, 0, 1, 0);
  const PhotometricReference nothing(dark.pyramid, dark.grid, room_camera(), 2000);
  EXPECT_EQ(align_photometrically(nothing, b.pyramid, {near}).T_ref_cur.matrix(), near.matrix());
}

}  // namespace
}  // namespace hm
