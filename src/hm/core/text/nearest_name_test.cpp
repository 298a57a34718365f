#include "hm/core/text/nearest_name.hpp"

#include <gtest/gtest.h>

#include <array>

namespace hm {
namespace {

constexpr std::array<std::string_view, 6> kNames{"tsdf.kernel", "tsdf.voxel_size_m", "mesh.max_voxel_levels",
                                                 "slam.maps",   "reconstruct",       "--output"};

TEST(NearestName, OneThatContainsTheWordFirst) {
  EXPECT_EQ(nearest_name("voxel", kNames), "tsdf.voxel_size_m");
  EXPECT_EQ(nearest_name("VOXEL_SIZE", kNames), "tsdf.voxel_size_m");
  EXPECT_EQ(nearest_name("levels", kNames), "mesh.max_voxel_levels");
}

TEST(NearestName, OtherwiseOneWithFewLettersChanged) {
  EXPECT_EQ(nearest_name("recontruct", kNames), "reconstruct");
  EXPECT_EQ(nearest_name("--outptu", kNames), "--output");
  EXPECT_EQ(nearest_name("tsdf.voxel_sise_m", kNames), "tsdf.voxel_size_m");
}

TEST(NearestName, NothingWhenNothingIsNear) {
  EXPECT_EQ(nearest_name("xyzzyplugh", kNames), std::nullopt);
  EXPECT_EQ(nearest_name("", kNames), std::nullopt);
  EXPECT_EQ(nearest_name("voxel", {}), std::nullopt);
}

TEST(NearestName, AnUnknownNameIsSaidWithTheNearestOrAll) {
  EXPECT_EQ(unknown_name("parameter", "recontruct", kNames),
            "unknown parameter 'recontruct'; did you mean 'reconstruct'?");
  const std::array<std::string_view, 2> worlds{"house", "room"};
  EXPECT_EQ(unknown_name("world", "moons", worlds), "unknown world 'moons'; valid ones are house room");
}

}  // namespace
}  // namespace hm
