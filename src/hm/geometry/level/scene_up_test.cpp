#include "hm/geometry/level/scene_up.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "hm/core/angle.hpp"
#include "hm/core/rng.hpp"

namespace hm {
namespace {

using Patches = std::vector<SurfacePatch>;

/// Rectangle from `corner` along two sides, facing the direction of their cross product, in patches of 10 cm
/// with the normal errors of a depth camera.
void add_rectangle(Patches& scene, const Vec3& corner, const Vec3& a, const Vec3& b, Rng& rng) {
  constexpr double kPiece_m = 0.1;
  const int along_a = std::max(1, static_cast<int>(a.norm() / kPiece_m)),
            along_b = std::max(1, static_cast<int>(b.norm() / kPiece_m));
  const Vec3 normal = a.cross(b).normalized();
  for (int i = 0; i < along_a; ++i)
    for (int j = 0; j < along_b; ++j) {
      const Vec3 centre =
          corner + (i + 0.5) / along_a * a + (j + 0.5) / along_b * b + rng.normal(0, 0.003) * normal;
      const Vec3 noise(rng.normal(0, 0.03), rng.normal(0, 0.03), rng.normal(0, 0.03));
      scene.push_back({centre, (normal + noise).normalized(), a.norm() * b.norm() / (along_a * along_b)});
    }
}

/// Closed box of these sizes; `inside`: its inner side, as of a room.
void add_box(Patches& scene, const Vec3& low, const Vec3& size, bool inside, Rng& rng) {
  for (int k = 0; k < 3; ++k) {
    Vec3 a = Vec3::Zero(), b = Vec3::Zero(), c = Vec3::Zero();
    a[(k + 1) % 3] = size[(k + 1) % 3], b[(k + 2) % 3] = size[(k + 2) % 3], c[k] = size[k];
    if (!inside) std::swap(a, b);
    add_rectangle(scene, low, a, b, rng);
    add_rectangle(scene, low + c, b, a, rng);
  }
}

/// Surface with random normals: plants, cables, people.
void add_clutter(Patches& scene, int pieces, Rng& rng) {
  for (int i = 0; i < pieces; ++i) {
    const Vec3 normal(rng.normal(), rng.normal(), rng.normal());
    scene.push_back(
        {Vec3(rng.uniform(0, 4), rng.uniform(0, 3), rng.uniform(0, 1)), normal.normalized(), 0.01});
  }
}

/// Room of 5 x 4 x 2.5 m with a table, a rotated cupboard, and clutter.
Patches furnished_room(Rng& rng) {
  Patches room;
  add_box(room, Vec3::Zero(), Vec3(5, 4, 2.5), true, rng);
  add_box(room, Vec3(1, 1, 0.7), Vec3(1.6, 0.8, 0.04), false, rng);
  Patches cupboard;
  add_box(cupboard, Vec3::Zero(), Vec3(1, 0.5, 1.8), false, rng);
  const Mat3 askew = so3_exp(Vec3(0, 0, 0.5));
  for (const SurfacePatch& p : cupboard)
    room.push_back({askew * p.centre + Vec3(3, 2.5, 0), askew * p.normal, p.area});
  add_clutter(room, 400, rng);
  return room;
}

Patches turned(const Patches& scene, const Mat3& R) {
  Patches out;
  for (const SurfacePatch& p : scene) out.push_back({R * p.centre, R * p.normal, p.area});
  return out;
}

/// Orientations of a camera with these yaws, this pitch downwards, rolled about its optical axis.
std::vector<Mat3> looks(double yaw_from_deg, double yaw_to_deg, double down_deg, double roll_deg,
                        const Mat3& R_world_level) {
  std::vector<Mat3> rotations;
  for (int i = 0; i <= 40; ++i) {
    const double yaw = (yaw_from_deg + (yaw_to_deg - yaw_from_deg) * i / 40) * kRadiansPerDegree;
    const double nod = (down_deg + 3 * std::sin(i)) * kRadiansPerDegree;
    Mat3 R_level_camera;  // looks along x
    R_level_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    rotations.push_back(R_world_level * so3_exp(Vec3(0, 0, yaw)) * so3_exp(Vec3(0, nod, 0)) * R_level_camera *
                        so3_exp(Vec3(0, 0, roll_deg * kRadiansPerDegree)));
  }
  return rotations;
}

double off_deg(const UpDirection& found, const Vec3& up) {
  return std::atan2(found.up.cross(up).norm(), found.up.dot(up)) * kDegreesPerRadian;
}

const Mat3 kTilt = so3_exp(Vec3(0.5, -0.4, 1.1));

TEST(SceneUp, ATiltedRoomIsLevelledWithinATenthOfADegree) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Rng rng(seed);
    const Mat3 R = so3_exp(Vec3(rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-3, 3)));
    const Patches room = turned(furnished_room(rng), R);
    const UpDirection found = find_scene_up(room, looks(-60, 60, 20, 4, R));
    ASSERT_EQ(found.source, UpSource::kFloorAndWalls) << seed;
    EXPECT_LT(off_deg(found, R.col(2)), 0.1) << seed;
  }
}

/// The mean upward direction of such a camera is wrong by 39 degrees.
TEST(SceneUp, ACameraThatLooksDownAtADeskDoesNotMislead) {
  Rng rng(2);
  Patches desk;
  add_rectangle(desk, Vec3(0, 0, 0.75), Vec3(1.6, 0, 0), Vec3(0, 1, 0), rng);
  add_rectangle(desk, Vec3(-1, -1, 0), Vec3(0.9, 0, 0), Vec3(0, 2, 0), rng);
  add_box(desk, Vec3(0.9, 0.3, 0.75), Vec3(0.1, 0.5, 0.4), false, rng);
  add_clutter(desk, 150, rng);
  const UpDirection found = find_scene_up(turned(desk, kTilt), looks(-15, 15, 39, 3, kTilt));
  ASSERT_EQ(found.source, UpSource::kFloorAndWalls);
  EXPECT_LT(off_deg(found, kTilt.col(2)), 0.3);
}

/// Scan of a camera that never looks up.
Patches without_ceiling(const Patches& room) {
  Patches seen;
  std::copy_if(room.begin(), room.end(), std::back_inserter(seen),
               [](const SurfacePatch& p) { return p.normal.z() > -0.8 || p.centre.z() < 2; });
  return seen;
}

TEST(SceneUp, ACameraHeldOnItsSideIsNotTakenForUpright) {
  for (const double roll_deg : {90.0, -90.0})
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Rng rng(seed);
      const Patches room = furnished_room(rng);
      const auto cameras = looks(-50, 70, 15, roll_deg, kTilt);
      const UpDirection found = find_scene_up(turned(without_ceiling(room), kTilt), cameras);
      EXPECT_EQ(found.source, UpSource::kFloorAndWalls) << roll_deg << " " << seed;
      EXPECT_LT(off_deg(found, kTilt.col(2)), 0.2) << roll_deg << " " << seed;
      // With a ceiling as large as the floor, upside down is equally likely.
      const UpDirection closed = find_scene_up(turned(room, kTilt), cameras);
      if (closed.known()) {
        EXPECT_LT(off_deg(closed, kTilt.col(2)), 0.2);
      }
    }
}

TEST(SceneUp, AtAnyRollItIsRightOrUnknown) {
  for (double roll_deg = -150; roll_deg <= 150; roll_deg += 15) {
    Rng rng(7);
    for (const Patches& room : {furnished_room(rng), without_ceiling(furnished_room(rng))}) {
      const UpDirection found = find_scene_up(turned(room, kTilt), looks(-50, 70, 15, roll_deg, kTilt));
      if (found.known()) {
        EXPECT_LT(off_deg(found, kTilt.col(2)), 1.0) << roll_deg;
      }
      EXPECT_TRUE(found.known() || std::abs(roll_deg) > 20) << roll_deg;
    }
  }
}

/// An attic: two slopes of 40 degrees above low walls cover more than the floor.
TEST(SceneUp, SlopedRoofsAreNotFloors) {
  Rng rng(4);
  Patches attic;
  add_rectangle(attic, Vec3::Zero(), Vec3(4, 0, 0), Vec3(0, 5, 0), rng);
  const double rise = 2 * std::tan(40 * kRadiansPerDegree);
  add_rectangle(attic, Vec3(0, 0, 0.6), Vec3(0, 5, 0), Vec3(2, 0, rise), rng);
  add_rectangle(attic, Vec3(4, 0, 0.6), Vec3(-2, 0, rise), Vec3(0, 5, 0), rng);
  add_rectangle(attic, Vec3::Zero(), Vec3(0, 5, 0), Vec3(0, 0, 0.6), rng);
  add_rectangle(attic, Vec3(4, 0, 0), Vec3(0, 0, 0.6), Vec3(0, 5, 0), rng);
  add_rectangle(attic, Vec3(0, 5, 0), Vec3(4, 0, 0), Vec3(0, 0, 2), rng);
  for (const double down_deg : {-20.0, 0.0, 25.0}) {
    const UpDirection found = find_scene_up(turned(attic, kTilt), looks(30, 150, down_deg, 0, kTilt));
    if (found.known()) {
      EXPECT_LT(off_deg(found, kTilt.col(2)), 1.0) << down_deg;
    }
  }
  EXPECT_TRUE(find_scene_up(turned(attic, kTilt), looks(30, 150, 10, 0, kTilt)).known());
}

/// A single slope cannot be distinguished from a floor.
TEST(SceneUp, OnePlaneAloneLeavesItUnknown) {
  Rng rng(5);
  Patches plane;
  add_rectangle(plane, Vec3::Zero(), Vec3(3, 0, 0), Vec3(0, 3, 0), rng);
  for (const double down_deg : {20.0, 45.0, 70.0, 90.0}) {
    const UpDirection found = find_scene_up(plane, looks(-10, 10, down_deg, 0, Mat3::Identity()));
    EXPECT_EQ(found.source, UpSource::kUnknown) << down_deg;
  }
  EXPECT_EQ(find_scene_up({}, {}).source, UpSource::kUnknown);
}

/// A camera rolled by 45 degrees and two perpendicular planes, each of which may be the floor.
TEST(SceneUp, HalfwayBetweenTwoPlanesItIsUnknown) {
  Rng rng(6);
  Patches edge;
  add_rectangle(edge, Vec3::Zero(), Vec3(2, 0, 0), Vec3(0, 2, 0), rng);
  add_rectangle(edge, Vec3::Zero(), Vec3(0, 0, 2), Vec3(2, 0, 0), rng);  // beside: faces +y
  for (const double roll_deg : {45.0, -45.0})
    EXPECT_FALSE(find_scene_up(edge, looks(-2, 2, 20, roll_deg, Mat3::Identity())).known()) << roll_deg;
}

TEST(SceneUp, StairsAreLevelAtEveryTread) {
  Rng rng(8);
  Patches stairs;
  for (int i = 0; i < 12; ++i) {
    add_rectangle(stairs, Vec3(0.28 * i, 0, 0.18 * (i + 1)), Vec3(0.28, 0, 0), Vec3(0, 1.2, 0), rng);
    add_rectangle(stairs, Vec3(0.28 * i, 0, 0.18 * i), Vec3(0, 0, 0.18), Vec3(0, 1.2, 0), rng);
  }
  add_rectangle(stairs, Vec3(0, 1.2, 0), Vec3(3.5, 0, 0), Vec3(0, 0, 3), rng);
  const UpDirection found = find_scene_up(turned(stairs, kTilt), looks(-40, 40, 10, 0, kTilt));
  ASSERT_TRUE(found.known());
  EXPECT_LT(off_deg(found, kTilt.col(2)), 0.5);
}

TEST(SceneUp, TheResultDoesNotDependOnTheOrderOfThePatches) {
  Rng rng(9);
  Patches room = furnished_room(rng);
  const auto cameras = looks(-60, 60, 20, 0, Mat3::Identity());
  const UpDirection first = find_scene_up(room, cameras);
  std::reverse(room.begin(), room.end());
  EXPECT_LT(off_deg(find_scene_up(room, cameras), first.up), 1e-3);
}

TEST(SceneUp, GravityIsRefinedByLevelSurfacesNearIt) {
  Rng rng(10);
  const Patches room = furnished_room(rng);
  const UpDirection gravity{so3_exp(Vec3(0.05, 0.04, 0)) * Vec3::UnitZ(), UpSource::kGravity, 0.05};
  const UpDirection refined = refine_gravity(gravity, room);
  EXPECT_EQ(refined.source, UpSource::kGravityAndLevels);
  EXPECT_LT(off_deg(refined, Vec3::UnitZ()), 0.2);
  EXPECT_LT(refined.sigma_rad, gravity.sigma_rad);
  // A ramp of five degrees is ignored if gravity is certain.
  const UpDirection sure{Vec3::UnitZ(), UpSource::kGravity, 0.01};
  Patches ramp;
  add_rectangle(ramp, Vec3::Zero(), Vec3(3, 0, 0), Vec3(0, 3, 0), rng);
  const UpDirection kept = refine_gravity(sure, turned(ramp, so3_exp(Vec3(5 * kRadiansPerDegree, 0, 0))));
  EXPECT_EQ(kept.source, UpSource::kGravity);
  EXPECT_LT(off_deg(kept, Vec3::UnitZ()), 1e-9);
}

TEST(SceneUp, BrokenTrianglesAreLeftOut) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {NAN, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 1}, {0, 1, 9}};
  const auto patches = patches_of(mesh);
  ASSERT_EQ(patches.size(), 1u);
  EXPECT_TRUE(patches.front().normal.isApprox(Vec3::UnitZ()));
  EXPECT_DOUBLE_EQ(patches.front().area, 0.5);
}

/// Noise averages out; drift that lifts the middle of a floor by 3 cm does not.
TEST(SceneUp, DeviationIsThatOfBentLevelsNotOfNoise) {
  Rng rng(9);
  const auto sigma_deg = [&](double step_m) {
    Patches scene = furnished_room(rng);
    for (SurfacePatch& patch : scene)
      if (std::abs(patch.normal.z()) > 0.9 && patch.centre.z() < 0.1 &&
          std::abs(patch.centre.x() - 2.5) < 1.2)
        patch.centre.z() += step_m;
    const auto candidates = scene_up_candidates(scene, {});
    for (const UpEvidence& e : candidates)
      if (e.up.z() > 0.99) return e.sigma_rad * kDegreesPerRadian;
    return -1.0;
  };
  const double flat = sigma_deg(0), bent = sigma_deg(0.03);
  EXPECT_GT(flat, 0);
  EXPECT_LT(flat, 0.35);
  EXPECT_GT(bent, 1.5 * flat);
}

}  // namespace
}  // namespace hm
