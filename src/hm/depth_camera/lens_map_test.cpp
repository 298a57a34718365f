#include "hm/depth_camera/lens_map.hpp"

#include <cmath>

#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

const PinholeCamera kFr1{
    320, 240, 258.65, 258.23, 159.3, 127.6, {0.262383, -0.953104, -0.005358, 0.002628, 1.163314}};

/// Smooth values over the rays of a camera.
double value_at(const Vec3& ray) {
  return 100 + 60 * std::sin(4 * ray.x()) * std::cos(3 * ray.y()) + 50 * ray.x();
}

TEST(LensMap, UndoesTheDistortionOfAPicture) {
  // The distorted image is rendered by inverting the lens (iteration); LensMap uses the opposite direction
  // (formula).
  Image<std::uint16_t> depth(kFr1.width, kFr1.height);
  Image<Rgb8> color(kFr1.width, kFr1.height);
  for (int y = 0; y < kFr1.height; ++y)
    for (int x = 0; x < kFr1.width; ++x) {
      const double value = value_at(kFr1.unproject(Vec2(x, y), 1.0));
      depth(x, y) = static_cast<std::uint16_t>(std::lround(100 * value));
      color(x, y).g = static_cast<std::uint8_t>(std::lround(value));
    }
  const LensMap lens(kFr1);
  const auto flat_depth = lens.undistort(depth);
  const auto flat_color = lens.undistort(color);
  const PinholeCamera ideal = kFr1.without_distortion();
  int seen = 0;
  for (int y = 0; y < kFr1.height; ++y)
    for (int x = 0; x < kFr1.width; ++x) {
      const Vec3 ray = ideal.unproject(Vec2(x, y), 1.0);
      // Everything well inside the distorted image must be present, everything outside must not.
      const Vec2 place = kFr1.project(ray);
      const bool inside =
          place.x() > 1 && place.y() > 1 && place.x() < kFr1.width - 2 && place.y() < kFr1.height - 2;
      if (!kFr1.contains(place)) {
        ASSERT_EQ(flat_depth(x, y), 0);
      }
      if (!inside) continue;
      ++seen;
      ASSERT_NEAR(flat_depth(x, y) / 100.0, value_at(ray), 1.2) << x << " " << y;  // half a pixel of slope
      ASSERT_NEAR(flat_color(x, y).g, value_at(ray), 1.1) << x << " " << y;
    }
  EXPECT_GT(seen, 60000);
}

TEST(LensMap, WithoutDistortionNothingChanges) {
  PinholeCamera camera = testing_recordings::kSmallCamera;
  const LensMap lens(camera);
  const auto depth = testing_recordings::random_depth(24, 16, 1).units;
  const auto color = testing_recordings::random_color(24, 16, 2);
  EXPECT_TRUE(testing_recordings::same_pixels(lens.undistort(depth), depth));
  EXPECT_TRUE(testing_recordings::same_pixels(lens.undistort(color), color));
}

TEST(LensMap, DepthIsNeverMixed) {
  Rng rng(3);
  Image<std::uint16_t> depth(kFr1.width, kFr1.height);
  for (auto& d : depth.pixels()) d = rng.below(2) == 0 ? std::uint16_t{0} : std::uint16_t{5000};
  const auto flat = LensMap(kFr1).undistort(depth);
  for (const std::uint16_t d : flat.pixels()) ASSERT_TRUE(d == 0 || d == 5000);
}

TEST(LensMap, EveryPixelOfDepthIsTheNearest) {
  PinholeCamera weak = kFr1;
  weak.distortion = {-0.02542, 0.000217, -0.000929, 0.000197, 0};
  for (const PinholeCamera& camera : {kFr1, weak}) {
    const auto depth = testing_recordings::random_depth(camera.width, camera.height, 5).units;
    const auto flat = LensMap(camera).undistort(depth);
    const PinholeCamera ideal = camera.without_distortion();
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const Vec2 place = camera.project(ideal.unproject(Vec2(x, y), 1.0));
        const bool inside = place.allFinite() && camera.contains(place);
        const auto nearest = [](double value, int size) {
          return std::min(static_cast<int>(std::floor(value + 0.5)), size - 1);
        };
        ASSERT_EQ(flat(x, y),
                  inside ? depth(nearest(place.x(), camera.width), nearest(place.y(), camera.height)) : 0)
            << x << " " << y;
      }
  }
}

TEST(LensMap, PicturesOfOnePixel) {
  PinholeCamera tiny{1, 1, 1, 1, 0, 0, {0.1, 0, 0, 0, 0}};
  EXPECT_EQ(LensMap(tiny).undistort(Image<Rgb8>(1, 1, {1, 2, 3}))(0, 0), (Rgb8{1, 2, 3}));
}

TEST(LensMap, IsAppliedByRecordings) {
  const TemporaryFolder folder;
  PinholeCamera camera = testing_recordings::kSmallCamera;
  camera.distortion = {-0.2, 0.05, 0.001, -0.002, 0};
  auto writer = TumWriter::create(folder.path() / "r", camera);
  const RgbdFrame frame = testing_recordings::small_frame(0);
  ASSERT_TRUE(writer->add(frame));
  ASSERT_TRUE(writer->finish());
  const auto read = (*open_recording(folder.path() / "r"))->read(0);
  ASSERT_TRUE(read);
  EXPECT_TRUE(
      testing_recordings::same_pixels(read->depth.units, LensMap(camera).undistort(frame.depth.units)));
  EXPECT_TRUE(testing_recordings::same_pixels(read->color, LensMap(camera).undistort(frame.color)));
  EXPECT_FALSE(testing_recordings::same_pixels(read->depth.units, frame.depth.units));
}

}  // namespace
}  // namespace hm
