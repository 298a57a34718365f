#include "hm/pipeline/experiments/rgbd/uncertainty_experiment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "hm/core/rng.hpp"
#include "hm/io/rgbd/tum_writer.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// A still recording: a wall at 2 m with a pillar at 1 m before its middle; each reading scatters by
/// `sigma_m`, and in the column at the pillar's left edge comes from the wall every second frame.
class UncertaintyExperiment : public testing::Test {
 protected:
  UncertaintyExperiment() {
    folder_ = fs::path(testing::TempDir()) / fmt::format("hm_uncertainty_{}", getpid());
    fs::remove_all(folder_);
  }
  ~UncertaintyExperiment() override { fs::remove_all(folder_); }

  void write(int frames, double sigma_m) const {
    const PinholeCamera camera{kWidth, kHeight, 100, 100, 47.5, 35.5, {}};
    auto writer = TumWriter::create(folder_, camera);
    ASSERT_TRUE(writer) << to_string(writer.error());
    Rng rng(4);
    for (int i = 0; i < frames; ++i) {
      RgbdFrame frame;
      frame.stamp = frame.color_stamp = Time::from_seconds(0.1 * (i + 1));
      frame.depth = {Image<std::uint16_t>(kWidth, kHeight), 1e-4};
      frame.color = Image<Rgb8>(kWidth, kHeight, Rgb8{100, 100, 100});
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const bool pillar = x == kLeft ? i % 2 == 0 : x > kLeft && x < kRight;
          const double z = (pillar ? 1.0 : 2.0) + rng.normal(0, sigma_m);
          frame.depth.units(x, y) = static_cast<std::uint16_t>(std::lround(z / 1e-4));
        }
      const auto added = writer->add(frame);
      ASSERT_TRUE(added) << to_string(added.error());
    }
    ASSERT_TRUE(writer->finish());
  }

  [[nodiscard]] Result<UncertaintyResult> compare() const {
    FeatureParams features;
    features.depth_noise = {0, 0, kSigma_m};  // as the readings are, at every depth
    return record_uncertainty(folder_, {}, features, {.views = 1, .frames = 60, .predictions = 3}, {});
  }

  static constexpr int kWidth = 96, kHeight = 72, kLeft = 30, kRight = 60;
  static constexpr double kSigma_m = 0.01;
  fs::path folder_;
};

TEST_F(UncertaintyExperiment, FindsTheDeviationsThatWerePutIn) {
  write(60, kSigma_m);
  const auto result = compare();
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(result->frames, 60u);
  EXPECT_EQ(result->models[0].error_m[0].count, 3u * kWidth * kHeight);
  // Two depths, 1 m apart, half of the time each: half a metre; elsewhere the noise.
  double edge = 0, wall = 0;
  for (int y = 0; y < kHeight; ++y) {
    edge += static_cast<double>(result->images.actual_m(kLeft, y)) / kHeight;
    wall += static_cast<double>(result->images.actual_m(10, y)) / kHeight;
  }
  EXPECT_NEAR(edge, 0.504, 0.003);  // n / (n - 1)
  EXPECT_NEAR(wall, kSigma_m, 0.001);
  // Three columns at the left edge (one flickers), two at the right.
  EXPECT_EQ(result->models[0].error_m[static_cast<std::size_t>(PixelSet::kEdges)].count, 3u * 5u * kHeight);
  EXPECT_TRUE(result->warnings.empty());
}

TEST_F(UncertaintyExperiment, EdgesAreWhereTheModelsDiffer) {
  write(60, kSigma_m);
  const auto result = compare();
  ASSERT_TRUE(result) << to_string(result.error());
  // The quadratic model knows nothing of an edge: of five columns one deviates by 0.5 m.
  EXPECT_NEAR(result->error_m(0, PixelSet::kEdges), 0.5 / std::sqrt(5.0), 0.01);
  // Everything but those columns is right for it: only the sample's own scatter is left (1 in 118 squared).
  EXPECT_NEAR(result->error_m(0, PixelSet::kAll), 0.5 / std::sqrt(static_cast<double>(kWidth)), 0.003);
  // A window with a share w of its weight 1 m farther away deviates by sqrt(w (1 - w)): 4/2/1 at the column
  // that flickers and its neighbours. Its pixel at the pillar has w = 1/4 to the left and 0 to the right.
  for (int y = 1; y < kHeight - 1; ++y) {
    const float predicted = result->images.predicted_m[2](kRight, y);
    EXPECT_NEAR(predicted, std::sqrt(0.25 * 0.75), 0.02) << y;
  }
}

TEST_F(UncertaintyExperiment, ToldWhenTheSceneMoves) {
  write(60, 5 * kSigma_m);
  const auto result = compare();
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_EQ(result->warnings.size(), 1u);
  EXPECT_THAT(result->warnings.front(), testing::HasSubstr("did camera or scene move?"));
}

TEST_F(UncertaintyExperiment, TooFewFramesAreAnError) {
  write(9, kSigma_m);
  const auto result = compare();
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, testing::HasSubstr("9 frames can be read"));
}

TEST(SimulatedUncertainty, PlanesDeviateAsTheSensorDoes) {
  SimulationParams scene;
  scene.world = WorldKind::kHouse;
  scene.sensor = SensorPreset::kTangoTablet;
  FeatureParams features;
  features.depth_noise = sensor_model(scene.sensor).noise;
  const auto result = simulate_uncertainty(scene, features, {.views = 2, .frames = 60, .predictions = 2}, {});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(result->views, 2u);
  EXPECT_EQ(result->frames, 120u);
  // On planes the quadratic model is the sensor's own: what is left is the scatter of a sample of 60, a
  // deviation's share of 1 / sqrt(2 * 59) = 9 %.
  const auto planes = static_cast<std::size_t>(PixelSet::kPlanes);
  double squares = 0, count = 0;
  for (const RootMeanSquare& step : result->actual_by_depth_m[planes])
    squares += step.sum, count += static_cast<double>(step.count);
  ASSERT_GT(count, 1000);
  EXPECT_NEAR(result->error_m(0, PixelSet::kPlanes) / std::sqrt(squares / count), 0.092, 0.03);
  EXPECT_LT(result->error_m(1, PixelSet::kEdges), 0.7 * result->error_m(0, PixelSet::kEdges));
}

}  // namespace
}  // namespace hm
