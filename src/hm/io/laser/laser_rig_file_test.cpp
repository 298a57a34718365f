#include "hm/io/laser/laser_rig_file.hpp"
#include "hm/core/testing/source_folder.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "hm/geometry/se2.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using ::testing::HasSubstr;

double difference(const SE3& a, const SE3& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff(); }

TEST(LaserRigFile, ComesBack) {
  const TemporaryFolder folder;
  LaserRig rig;
  rig.T_base_laser = SE3(rotation_from_roll_pitch_yaw({0.1, -0.2, 3.0}), {0.1, 0.2, 0.3});
  rig.T_base_imu = SE3(rotation_from_roll_pitch_yaw({-0.3, 0.7, 0}), {0, 0, -0.1});
  rig.horizontal = BeamRange{56, 1024};
  rig.T_base_range = SE3(rotation_from_roll_pitch_yaw({0.1, 1.4, 0.2}), {0.1, 0, -0.05});
  rig.down =
      LaserRig::Mirror{{0, 20}, SE3(rotation_from_roll_pitch_yaw({1.5, -0.7, -0.7}), {0.01, 0.02, 0.3})};
  rig.up =
      LaserRig::Mirror{{1060, 1080}, SE3(rotation_from_roll_pitch_yaw({-1.5, 0.7, 0.7}), {0.01, 0.5, 0.3})};
  ASSERT_TRUE(write_laser_rig(folder / "rig.toml", rig));
  const auto read = read_laser_rig(folder / "rig.toml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_LT(difference(read->T_base_laser, rig.T_base_laser), 1e-12);
  EXPECT_LT(difference(read->T_base_imu, rig.T_base_imu), 1e-12);
  EXPECT_LT(difference(read->down->T_base_virtual_laser, rig.down->T_base_virtual_laser), 1e-12);
  EXPECT_LT(difference(read->up->T_base_virtual_laser, rig.up->T_base_virtual_laser), 1e-12);
  EXPECT_EQ(read->horizontal->begin, 56U);
  ASSERT_TRUE(read->T_base_range);
  EXPECT_LT(difference(*read->T_base_range, *rig.T_base_range), 1e-12);
  EXPECT_EQ(read->down->beams.end, 20U);
  EXPECT_EQ(read->up->beams.begin, 1060U);

  ASSERT_TRUE(write_laser_rig(folder / "rig.toml", {}));
  const auto plain = read_laser_rig(folder / "rig.toml");
  ASSERT_TRUE(plain) << to_string(plain.error());
  EXPECT_FALSE(plain->horizontal || plain->down || plain->up || plain->T_base_range);
}

TEST(LaserRigFile, MistakesAreNamed) {
  const TemporaryFolder folder;
  const std::pair<const char*, const char*> kMistakes[] = {
      {"[laser]\nxyz = [0, 0, 0]\n", "unknown key `xyz` in [laser]"},
      {"[lasers]\n", "unknown key `lasers`"},
      {"laser = 3\n", "write [laser]"},
      {"[laser]\nxyz_m = [0, 0]\n", "three finite numbers"},
      {"[laser]\nxyz_m = [0, 0, nan]\n", "three finite numbers"},
      {"[laser]\nxyz_m = [0, true, 0]\n", "three finite numbers"},
      {"[laser]\nrpy_deg = \"0 0 0\"\n", "three finite numbers"},
      {"[down]\nxyz_m = [0, 0, 0]\n", "needs `beams"},
      {"[down]\nbeams = [20, 20]\n", "two whole numbers"},
      {"[down]\nbeams = [-1, 20]\n", "two whole numbers"},
      {"[down]\nbeams = [0.5, 20]\n", "two whole numbers"},
      {"[down]\nbeams = [0, 20]\n[horizontal]\nbeams = [19, 30]\n", "overlap"},
      {"[laser\n", ""},
  };
  for (const auto& [text, message] : kMistakes) {
    test::write_bytes(folder / "rig.toml", text);
    const auto rig = read_laser_rig(folder / "rig.toml");
    ASSERT_FALSE(rig) << text;
    EXPECT_THAT(rig.error().message, HasSubstr(message));
    EXPECT_THAT(rig.error().where, HasSubstr("rig.toml:"));
  }
  EXPECT_FALSE(read_laser_rig(folder / "none.toml"));
}

TEST(LaserRigFile, EveryDamageIsAnErrorOrARig) {
  const TemporaryFolder folder;
  LaserRig rig;
  rig.down = LaserRig::Mirror{{0, 20}, {}};
  ASSERT_TRUE(write_laser_rig(folder / "rig.toml", rig));
  test::for_each_damaged(test::read_bytes(folder / "rig.toml"), 500, [&](const std::string& bytes) {
    test::write_bytes(folder / "damaged.toml", bytes);
    const auto read = read_laser_rig(folder / "damaged.toml");
    if (read) {
      EXPECT_TRUE(is_rigid(read->T_base_laser));
    } else {
      EXPECT_FALSE(read.error().where.empty());
    }
  });
}

/// The dissertation author's vehicle: the mirror at beam 0 turns its beams straight down, the other one up.
TEST(LaserRigFile, CityFlyer) {
  const auto rig = read_laser_rig(test::source_folder() / "configs" / "city_flyer_rig.toml");
  ASSERT_TRUE(rig) << to_string(rig.error());
  EXPECT_EQ(rig->T_base_laser.translation(), Vec3(0, 0, 0.12));
  ASSERT_TRUE(rig->horizontal && rig->down && rig->up);
  EXPECT_EQ(rig->horizontal->size(), 968U);
  EXPECT_EQ(rig->down->beams.size(), 20U);
  const auto end_point = [](const LaserRig::Mirror& mirror, double angle_rad, double range_m) -> Vec3 {
    return mirror.T_base_virtual_laser *
           Vec3(range_m * std::cos(angle_rad), range_m * std::sin(angle_rad), 0);
  };
  // The beam at -135 degrees meets its mirror where the mirror is as far before the laser as behind it.
  const double first_rad = -135 * std::numbers::pi / 180;
  const Vec3 mirror_point = rig->T_base_laser * Vec3(-0.0474, -0.0474, 0);
  EXPECT_LT((end_point(*rig->down, first_rad, 0.0670) - mirror_point).norm(), 1e-4);
  EXPECT_LT((end_point(*rig->down, first_rad, 1.067) - (mirror_point - Vec3(0, 0, 1))).norm(), 1e-4);
  const Vec3 other_point = rig->T_base_laser * Vec3(-0.0474, 0.0474, 0);
  EXPECT_LT((end_point(*rig->up, -first_rad, 1.067) - (other_point + Vec3(0, 0, 1))).norm(), 1e-4);
}

}  // namespace
}  // namespace hm
