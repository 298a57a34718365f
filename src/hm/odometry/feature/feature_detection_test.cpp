#include "hm/odometry/feature/feature_detection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

const PinholeCamera kCamera{640, 480, 525, 525, 319.5, 239.5, {}};

/// Brightness of a square of 12 pixels, random but the same in every image; repeats after 128 squares.
double square_brightness(double x, double y) {
  static const std::vector<double> kTable = [] {
    Rng rng(3);
    std::vector<double> table(128 * 128);
    for (double& value : table) value = rng.uniform(30, 220);
    return table;
  }();
  const int column = static_cast<int>(std::floor(x / 12)) & 127;
  const int row = static_cast<int>(std::floor(y / 12)) & 127;
  return kTable[static_cast<std::size_t>(row * 128 + column)];
}

/// Random squares turned about the image's middle, four samples a pixel.
Image<std::uint8_t> textured(int width, int height, double turn_rad = 0) {
  Image<std::uint8_t> gray(width, height);
  const Vec2 middle(width / 2.0, height / 2.0);
  const Eigen::Rotation2Dd back(-turn_rad);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      double sum = 0;
      for (int sample = 0; sample < 4; ++sample) {
        const Vec2 at(u + 0.5 * (sample % 2) - 0.25, v + 0.5 * (sample / 2) - 0.25);
        const Vec2 turned = back * (at - middle);
        sum += square_brightness(turned.x(), turned.y());
      }
      gray(u, v) = static_cast<std::uint8_t>(sum / 4);
    }
  }
  return gray;
}

DepthImage constant_depth(int width, int height, std::uint16_t unit) {
  DepthImage depth;
  depth.units = Image<std::uint16_t>(width, height, unit);
  return depth;
}

FeatureSet detect(const Image<std::uint8_t>& gray, const DepthImage& depth,
                  const FeatureParams& params = {}) {
  return FeatureDetector(params, kCamera, {}).detect(gray, depth);
}

bool same(const FeatureSet& a, const FeatureSet& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Feature& f, const Feature& g) {
    return f.pixel == g.pixel && f.response == g.response && f.angle_rad == g.angle_rad &&
           f.octave == g.octave && f.descriptor == g.descriptor && f.has_depth == g.has_depth &&
           f.p_camera == g.p_camera && f.covariance == g.covariance;
  });
}

TEST(ToGray, WeightsAreThoseOfTheStandard) {
  Image<Rgb8> color(4, 1);
  color(0, 0) = {255, 255, 255};
  color(1, 0) = {255, 0, 0};
  color(2, 0) = {0, 255, 0};
  color(3, 0) = {0, 0, 255};
  const Image<std::uint8_t> gray = to_gray(color);
  EXPECT_EQ(gray(0, 0), 255);
  EXPECT_EQ(gray(1, 0), 76);
  EXPECT_EQ(gray(2, 0), 150);
  EXPECT_EQ(gray(3, 0), 29);
}

TEST(Sharpness, BlurAndDarknessLowerIt) {
  const Image<std::uint8_t> sharp = textured(320, 240);
  Image<std::uint8_t> blurred(320, 240), dark(320, 240);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      int sum = 0;
      for (int d = -40; d <= 40; ++d) {
        sum += sharp(std::clamp(x + d / 9, 0, 319), std::clamp(y + d % 9, 0, 239));
      }
      blurred(x, y) = static_cast<std::uint8_t>(sum / 81);
      dark(x, y) = static_cast<std::uint8_t>(sharp(x, y) / 16);
    }
  }
  EXPECT_GT(sharpness(sharp), 3 * sharpness(blurred));
  EXPECT_GT(sharpness(sharp), 30 * sharpness(dark));
  EXPECT_EQ(sharpness(Image<std::uint8_t>(64, 64, 90)), 0);
  EXPECT_EQ(sharpness(Image<std::uint8_t>()), 0);
  EXPECT_EQ(sharpness(Image<std::uint8_t>(2, 2, 9)), 0);
}

TEST(DepthCoverage, IsTheShareOfReadings) {
  DepthImage depth = constant_depth(64, 48, 1000);
  EXPECT_DOUBLE_EQ(depth_coverage(depth), 1);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 16; ++x) depth.units(x, y) = 0;
  }
  EXPECT_DOUBLE_EQ(depth_coverage(depth), 0.75);
  EXPECT_EQ(depth_coverage({}), 0);
}

TEST(FeatureDetector, CoversATexturedImage) {
  const FeatureSet features = detect(textured(640, 480), constant_depth(640, 480, 1500));
  ASSERT_GT(features.size(), 400U);
  ASSERT_LE(features.size(), 500U);
  std::vector<int> in_block(16, 0);
  for (const Feature& f : features) {
    EXPECT_TRUE(f.has_depth);
    ++in_block[static_cast<std::size_t>(f.pixel.x() / 160) + 4 * static_cast<std::size_t>(f.pixel.y() / 120)];
  }
  EXPECT_GT(*std::min_element(in_block.begin(), in_block.end()), 15);
}

TEST(FeatureDetector, CornersKeepTheirDistance) {
  FeatureParams params;
  params.min_distance_px = 12;
  params.subpixel = false;
  const FeatureSet features = detect(textured(640, 480), {}, params);
  ASSERT_GT(features.size(), 100U);
  for (std::size_t i = 0; i < features.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Vec2 apart = (features[i].pixel - features[j].pixel).cwiseAbs();
      ASSERT_GE(apart.maxCoeff(), 12)
          << features[i].pixel.transpose() << " " << features[j].pixel.transpose();
    }
  }
}

TEST(FeatureDetector, FindsACornerToAFifthOfAPixel) {
  // A bright quadrant whose edges lie at x0, y0: the corner is where the areas of pixels are cut.
  for (const Vec2& corner : {Vec2(100.0, 90.0), Vec2(100.3, 90.25), Vec2(99.6, 90.45)}) {
    Image<std::uint8_t> gray(200, 160);
    for (int y = 0; y < 160; ++y) {
      for (int x = 0; x < 200; ++x) {
        const double covered_x = std::clamp(x + 0.5 - corner.x(), 0.0, 1.0);
        const double covered_y = std::clamp(y + 0.5 - corner.y(), 0.0, 1.0);
        gray(x, y) = static_cast<std::uint8_t>(std::lround(40 + 160 * covered_x * covered_y));
      }
    }
    const FeatureSet features = detect(gray, {});
    ASSERT_EQ(features.size(), 1U);
    EXPECT_LT((features[0].pixel - corner).norm(), 0.2) << features[0].pixel.transpose();
  }
}

TEST(FeatureDetector, DescriptorsFollowATurnedImage) {
  FeatureParams params;
  params.max_features = 1500;
  const double turn = 0.5;
  const FeatureSet a = detect(textured(640, 480), {}, params);
  const FeatureSet b = detect(textured(640, 480, turn), {}, params);
  int right = 0, near = 0, turned = 0;
  for (const Feature& f : a) {
    const Vec2 from_middle = f.pixel - Vec2(320, 240);
    const Vec2 expected = Vec2(320, 240) + Eigen::Rotation2Dd(turn) * from_middle;
    const auto closest = std::min_element(b.begin(), b.end(), [&](const Feature& g, const Feature& h) {
      return (g.pixel - expected).norm() < (h.pixel - expected).norm();
    });
    if ((closest->pixel - expected).norm() > 1.0) continue;
    ++near;
    right += hamming_distance(f.descriptor, closest->descriptor) < 50 ? 1 : 0;
    const double angle = closest->angle_rad - f.angle_rad - turn;
    turned += std::abs(std::remainder(angle, 2 * std::numbers::pi)) < 0.2 ? 1 : 0;
  }
  EXPECT_GT(near, 60);
  EXPECT_GT(right, near * 8 / 10);
  EXPECT_GT(turned, near * 9 / 10);
}

TEST(FeatureDetector, SameInputSameBitsWhateverCameBefore) {
  const Image<std::uint8_t> gray = textured(640, 480);
  const DepthImage depth = constant_depth(640, 480, 2000);
  for (const auto kind : {CornerDetector::kGrid, CornerDetector::kShiTomasi}) {
    FeatureParams params;
    params.detector = kind;
    params.levels = 3;
    FeatureDetector detector(params, kCamera, {});
    const FeatureSet first = detector.detect(gray, depth);
    (void)detector.detect(textured(320, 240, 1), {});
    EXPECT_TRUE(same(first, detector.detect(gray, depth)));
    EXPECT_TRUE(same(first, detect(gray, depth, params)));
    EXPECT_GT(first.size(), 200U);
  }
}

TEST(FeatureDetector, BlankDarkAndTinyImagesHaveNone) {
  for (const auto kind : {CornerDetector::kGrid, CornerDetector::kShiTomasi}) {
    FeatureParams params;
    params.detector = kind;
    const DepthImage depth = constant_depth(640, 480, 2000);
    EXPECT_TRUE(detect(Image<std::uint8_t>(640, 480, 0), depth, params).empty());
    EXPECT_TRUE(detect(Image<std::uint8_t>(640, 480, 200), depth, params).empty());
    EXPECT_TRUE(detect(textured(40, 40), constant_depth(40, 40, 2000), params).empty());
    EXPECT_TRUE(detect({}, {}, params).empty());
  }
}

/// Slanted stripes, blurred over two pixels, under noise: what is found on their edges fits anywhere along
/// them.
TEST(FeatureDetector, StripesUnderNoiseHaveHardlyAny) {
  Rng rng(4);
  Image<std::uint8_t> stripes(640, 480);
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      const double across =
          std::remainder(u + 0.1 * v, 200.0) / 2;  // edges every 100 px, where it is 0 or +-50
      const double edge = std::abs(across) < 25 ? across : std::copysign(50, across) - across;
      stripes(u, v) = static_cast<std::uint8_t>(std::lround(115 + 35 * std::tanh(edge) + rng.normal(0, 2)));
    }
  EXPECT_LT(detect(stripes, constant_depth(640, 480, 2000)).size(), 15U);
  Image<std::uint8_t> noisy = textured(640, 480);
  for (std::uint8_t& value : noisy.pixels())
    value = static_cast<std::uint8_t>(std::clamp(std::lround(value + rng.normal(0, 2)), 0L, 255L));
  EXPECT_GT(detect(noisy, constant_depth(640, 480, 2000)).size(), 450U);
}

/// Brightness between the corners of squares of 24 pixels, under noise of eight grey levels.
Image<std::uint8_t> smooth_under_noise(double contrast) {
  constexpr double kSquare_px = 24, kNoise = 8;
  Rng rng(1);
  Image<std::uint8_t> gray(kCamera.width, kCamera.height);
  const auto corner = [](double column, double row) { return square_brightness(12 * column, 12 * row); };
  for (int v = 0; v < gray.height(); ++v)
    for (int u = 0; u < gray.width(); ++u) {
      const double column = std::floor(u / kSquare_px), row = std::floor(v / kSquare_px);
      const double x = u / kSquare_px - column, y = v / kSquare_px - row;
      const double upper = std::lerp(corner(column, row), corner(column + 1, row), x);
      const double lower = std::lerp(corner(column, row + 1), corner(column + 1, row + 1), x);
      const double level = 100 + contrast * (std::lerp(upper, lower, y) - 125) + rng.normal(0, kNoise);
      gray(u, v) = static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    }
  return gray;
}

/// In windows of seven pixels there is nothing but noise.
TEST(FeatureDetector, FaintTextureUnderNoiseIsFoundInCoarserImages) {
  EXPECT_GT(detect(smooth_under_noise(0.35), {}).size(), 60U);
  EXPECT_LT(detect(smooth_under_noise(0), {}).size(), 5U);
}

TEST(FeatureDetector, ShiTomasiLooksOnlyWhereThereIsDepth) {
  FeatureParams params;
  params.detector = CornerDetector::kShiTomasi;
  params.subpixel = false;
  DepthImage depth = constant_depth(640, 480, 2000);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 400; ++x) depth.units(x, y) = 0;
  }
  const FeatureSet features = detect(textured(640, 480), depth, params);
  EXPECT_GT(features.size(), 50U);
  for (const Feature& f : features) EXPECT_GE(f.pixel.x(), 400);
}

TEST(FeatureDetector, GatesKeepFeaturesButNotTheirPlace) {
  const Image<std::uint8_t> gray = textured(640, 480);
  for (const std::uint16_t unit : std::array<std::uint16_t, 2>{0, 6000}) {  // none, and beyond 5.5 m
    const FeatureSet features = detect(gray, constant_depth(640, 480, unit));
    EXPECT_GT(features.size(), 400U);
    for (const Feature& f : features) EXPECT_FALSE(f.has_depth);
  }
  FeatureDetector strict({}, kCamera, {5.5, 0.001});  // 1 mm: no reading at 2 m is that accurate
  for (const Feature& f : strict.detect(gray, constant_depth(640, 480, 2000))) EXPECT_FALSE(f.has_depth);
}

TEST(FeatureDetector, PlacesFeaturesWhereTheCameraSeesThem) {
  PinholeCamera mirrored = kCamera;
  mirrored.fy = -480;
  for (const PinholeCamera& camera : {kCamera, mirrored}) {
    FeatureDetector detector({}, camera, {});
    const FeatureSet features = detector.detect(textured(640, 480), constant_depth(640, 480, 1234));
    ASSERT_FALSE(features.empty());
    for (const Feature& f : features) {
      ASSERT_TRUE(f.has_depth);
      EXPECT_NEAR(f.p_camera.z(), 1.234, 1e-9);
      EXPECT_LT((camera.project(f.p_camera) - f.pixel).norm(), 1e-9);
      EXPECT_GT(f.covariance.determinant(), 0);
    }
  }
}

}  // namespace
}  // namespace hm
