#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hm/core/rng.hpp"
#include "hm/tsdf/update/discrete_update_filter.hpp"

// Reference: table in section (c) of the dense specification, where truncating, flooring and plain rounding
// filters drift or stall; the filters must stay near the exact running mean in all rows.
namespace hm {
namespace {

struct SdfCase {
  const char* name;
  double unit_mm;
  int cap;
  double truth_mm;
  double start_mm;  ///< the mean that the voxel already holds, at full weight; NaN: starts unknown
  double noise_mm;
  double allowed_mm;  ///< root mean square distance from the float filter
};

double rms_from_float_filter(const SdfCase& c, int observations) {
  double sum = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    Rng rng(static_cast<std::uint64_t>(run));
    TsdfVoxel voxel;
    double mean = 0, weight = 0;
    if (!std::isnan(c.start_mm)) {
      voxel = TsdfVoxel::make(static_cast<std::int16_t>(std::lround(c.start_mm / c.unit_mm)),
                              static_cast<std::uint16_t>(c.cap * kWeightOne));
      mean = c.start_mm;
      weight = c.cap;
    }
    for (int i = 0; i < observations; ++i) {
      const double sample = rng.normal(c.truth_mm, c.noise_mm);
      voxel = add_observation(voxel, round_to_even(static_cast<float>(sample / c.unit_mm)), kWeightOne,
                              static_cast<float>(c.cap * kWeightOne));
      mean += (sample - mean) / (weight + 1);
      weight = std::min(weight + 1, static_cast<double>(c.cap));
    }
    const double error = voxel.sdf() * c.unit_mm - mean;
    sum += error * error;
  }
  return std::sqrt(sum / kRuns);
}

TEST(SdfFilter, NeitherDriftsNorStalls) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  // tolerance: in the table trunc and floor err by 12.6, 0.94, 0.67, 0.32 mm, round by 5.00 where it stalls.
  for (const SdfCase& c : {SdfCase{"unit 0.1 mm, noise 10 mm", 0.1, 255, 20, kUnknown, 10, 0.75},
                           SdfCase{"unit 0.1 mm, 5 mm off", 0.1, 255, 20, 15, 0.3, 0.2},
                           SdfCase{"unit 0.01 mm, 5 mm off", 0.01, 255, 20, 15, 0.3, 0.05},
                           SdfCase{"unit 0.01 mm, cap 64", 0.01, 64, 20, 15, 0.3, 0.05}})
    EXPECT_LT(rms_from_float_filter(c, 1500), c.allowed_mm) << c.name;
}

TEST(SdfFilter, OurUnitStaysWithinATenthOfAMillimetreOfFloat) {
  EXPECT_LT(rms_from_float_filter({"2 cm voxels", 0.24 / 32767 * 1e3, 100, 20, 15, 10, 0}, 1500), 0.1);
  EXPECT_LT(rms_from_float_filter({"3 cm voxels", 0.36 / 32767 * 1e3, 100, 20, 15, 0.3, 0}, 1500), 0.1);
}

TEST(SdfFilter, ASampleThatDiffersAlwaysMoves) {
  for (int sample = -300; sample <= 300; ++sample) {
    TsdfVoxel voxel = TsdfVoxel::make(0, 60000);
    voxel = add_observation(voxel, static_cast<float>(sample), 256, 65280);
    if (sample == 0) {
      EXPECT_EQ(voxel.sdf(), 0);
    } else {
      EXPECT_GT(voxel.sdf() * sample, 0) << sample;
    }
  }
}

TEST(SdfFilter, TheSmallestStepScalesWithTheWeight) {
  for (const int weight : {1, 2, 8, 32, 64, 128, 256})
    for (int sample = -1000; sample <= 1000; ++sample) {
      const TsdfVoxel moved = add_observation(TsdfVoxel::make(0, 60000), static_cast<float>(sample),
                                              static_cast<float>(weight), 65280);
      const bool is_felt = 2 * std::abs(sample) * weight >= kWeightOne;
      EXPECT_EQ(moved.sdf() != 0, is_felt) << sample << ", weight " << weight;
    }
}

TEST(SdfFilter, WeightZeroChangesNothing) {
  for (const TsdfVoxel voxel : {TsdfVoxel{}, TsdfVoxel::make(-500, 1000), TsdfVoxel::make(300, 1)})
    for (const float sample : {-32767.0f, -1.0f, 0.0f, 700.0f})
      EXPECT_EQ(add_observation(voxel, sample, 0, 25600), voxel) << sample;
}

TEST(SdfFilter, ExtremesDoNotOverflow) {
  TsdfVoxel voxel;
  for (int i = 0; i < 300; ++i) voxel = add_observation(voxel, -32767.0f, 256, 255 * 256);
  EXPECT_EQ(voxel.sdf(), -32767);
  EXPECT_EQ(voxel.weight(), 255 * 256);
  for (int i = 0; i < 3000; ++i) voxel = add_observation(voxel, 32767.0f, 256, 255 * 256);
  EXPECT_GT(voxel.sdf(), 32000);
}

TEST(Carving, TakesWeightAndForgetsAtZero) {
  const TsdfVoxel voxel = TsdfVoxel::make(-500, 1000);
  EXPECT_EQ(take_weight(voxel, 400).weight(), 600);
  EXPECT_EQ(take_weight(voxel, 400).sdf(), -500);
  EXPECT_EQ(take_weight(voxel, 1000), TsdfVoxel{});
  EXPECT_EQ(take_weight(voxel, 5000), TsdfVoxel{});
}

/// Table (c), colour rows: error of the mean (levels) after a step from 40 to 200 levels.
double color_error(std::uint32_t cap, int observations) {
  ColorVoxel voxel = ColorVoxel::make(40, 40, 40, static_cast<std::uint8_t>(cap));
  for (int i = 0; i < observations; ++i) voxel = add_color(voxel, 0x00c8c8c8u, cap);
  return std::abs(200.0 - voxel.g());
}

TEST(ColorFilter, FollowsAStepInsteadOfStalling) {
  EXPECT_LE(color_error(254, 300),
            50);  // exact mean: 49; truncating never moves (160), rounding stalls at 113
  EXPECT_LE(color_error(16, 50), 7.7);
  EXPECT_LE(color_error(16, 300), 1);
  EXPECT_LE(color_error(64, 300), 2);
}

TEST(ColorFilter, ChannelsAreIndependentAndExactAtFirst) {
  ColorVoxel voxel = add_color({}, 0x0003c8ffu, 24);
  EXPECT_EQ(voxel, ColorVoxel::make(0xff, 0xc8, 0x03, 1));
  voxel = add_color(voxel, 0x0003c8ffu - 0x64, 24);
  EXPECT_EQ(voxel, ColorVoxel::make(0xff - 0x32, 0xc8, 0x03, 2));
}

TEST(RoundToEven, TiesGoToEven) {
  EXPECT_EQ(round_to_even(2.5f), 2.0f);
  EXPECT_EQ(round_to_even(3.5f), 4.0f);
  EXPECT_EQ(round_to_even(-2.5f), -2.0f);
  EXPECT_EQ(round_to_even(-0.5f), 0.0f);
}

}  // namespace
}  // namespace hm
