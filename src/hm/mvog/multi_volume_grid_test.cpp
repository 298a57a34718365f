#include "hm/mvog/multi_volume_grid.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "hm/mvog/dense_reference_test_support.hpp"

namespace hm {
namespace {

using test::DenseReference;
using test::exact_params;
using test::OwnedScan;
using test::random_scan;

/// Every cell of the reference and of a shell around it.
void expect_same_cells(const MultiVolumeGrid& grid, const DenseReference& reference) {
  std::set<DenseReference::Key> keys;
  for (const auto& [key, evidence] : reference.cells())
    for (int dz = -1; dz <= 1; ++dz) keys.insert({key[0], key[1], key[2] + dz});
  for (const auto& key : keys) {
    const Evidence ours = grid.evidence_at(reference.centre(key)), theirs = reference.at(key);
    ASSERT_EQ(ours, theirs) << "cell " << key[0] << ' ' << key[1] << ' ' << key[2] << ": " << ours.hits << '/'
                            << ours.misses << '/' << to_string(ours.assumed) << " instead of " << theirs.hits
                            << '/' << theirs.misses << '/' << to_string(theirs.assumed);
    ASSERT_EQ(grid.at(reference.centre(key)), reference.state(theirs));
  }
}

struct ReferenceCase {
  const char* name;
  MvogParams params;
  Eigen::Vector3d centre;
};

class AgainstReference : public testing::TestWithParam<ReferenceCase> {};

TEST_P(AgainstReference, EveryCellHasTheSameCounters) {
  const ReferenceCase& setup = GetParam();
  MultiVolumeGrid grid(setup.params);
  DenseReference reference(setup.params);
  Rng rng(5);
  OwnedScan scan;
  for (int i = 0; i < 30; ++i) {
    if (i % 3 != 2) scan = random_scan(rng, 60, 4, setup.centre);  // every third repeats the one before
    grid.insert(scan.view());
    reference.insert(scan);
  }
  ASSERT_GT(reference.cells().size(), 20000u);
  expect_same_cells(grid, reference);
  std::set<std::pair<int, int>> columns;
  for (const auto& [key, evidence] : reference.cells()) columns.insert({key[0], key[1]});
  EXPECT_EQ(grid.size().columns, columns.size());
}

MvogParams with(MvogParams params, double resolution_m, int cap, int view_cap, double view_distance) {
  params.resolution_m = resolution_m;
  params.evidence_cap = cap;
  params.same_view_cap = view_cap;
  params.same_view_distance_cell = view_distance;
  return params;
}
MvogParams glancing(int period) {
  MvogParams params = exact_params();
  params.glancing_period = period;
  return params;
}
MvogParams filled() {
  MvogParams params = exact_params();
  params.fill_slivers = true;
  return params;
}
INSTANTIATE_TEST_SUITE_P(
    Setups, AgainstReference,
    testing::Values(ReferenceCase{"exact", exact_params(), {0, 0, 0}},
                    ReferenceCase{"negative", exact_params(), {-50.3, -20.7, -33.1}},
                    ReferenceCase{"far", exact_params(), {913.7, -1200.2, 401.9}},
                    ReferenceCase{"small_caps", with(exact_params(), 0.1, 3, 2, 0.5), {0, 0, 0}},
                    ReferenceCase{"wide_views", with(exact_params(), 0.1, 15, 1, 12), {0, 0, 0}},
                    ReferenceCase{"coarse", with(exact_params(), 0.15, 8, 4, 0.5), {2, 3, 4}},
                    ReferenceCase{"all_glancing", glancing(1), {0, 0, 0}},
                    ReferenceCase{"few_glancing", glancing(3), {0, 0, 0}},
                    ReferenceCase{"filled", filled(), {0, 0, 0}}),
    [](const auto& param) { return param.param.name; });

TEST(MultiVolumeGrid, MergingSimilarVolumesKeepsWhatIsKnownAndNearlyAllStates) {
  const MvogParams params;
  MultiVolumeGrid grid(params), exact(filled());
  DenseReference reference(params);
  Rng rng(9);
  for (int i = 0; i < 40; ++i) {
    const OwnedScan scan = random_scan(rng, 200, 3, {0, 0, 0});
    grid.insert(scan.view());
    exact.insert(scan.view());
    reference.insert(scan);
  }
  std::size_t different = 0;
  for (const auto& [key, evidence] : reference.cells()) {
    const Occupancy ours = grid.at(reference.centre(key));
    if (evidence.hits + evidence.misses >
        0) {  // others may be slivers, filled where their neighbours are free
      ASSERT_NE(ours, Occupancy::kUnknown);
    }
    different += ours != reference.state(evidence);
  }
  EXPECT_LT(static_cast<double>(different), 0.03 * static_cast<double>(reference.cells().size()));
  EXPECT_LT(static_cast<double>(grid.size().runs), 0.95 * static_cast<double>(exact.size().runs));
}

TEST(MultiVolumeGrid, TheOrderOfScansDoesNotMatterBelowTheCaps) {
  const MvogParams params = with(glancing(1), 0.1, 15, 15, 0);
  Rng rng(2);
  std::vector<OwnedScan> scans;
  for (int i = 0; i < 14; ++i) scans.push_back(random_scan(rng, 80, 2, {0, 0, 0}));
  MultiVolumeGrid forwards(params), backwards(params);
  DenseReference reference(params);
  for (const auto& scan : scans) {
    forwards.insert(scan.view());
    reference.insert(scan);
  }
  for (auto scan = scans.rbegin(); scan != scans.rend(); ++scan) {
    std::ranges::reverse(scan->returns);
    backwards.insert(scan->view());
  }
  expect_same_cells(forwards, reference);
  expect_same_cells(backwards, reference);
}

TEST(MultiVolumeGrid, VerticalBeamsFillOneColumn) {
  MultiVolumeGrid grid;
  const std::vector<Eigen::Vector3f> floor{{0.05F, 0.05F, -1.03F}}, ceiling{{0.05F, 0.05F, 1.42F}};
  const auto stats = grid.insert({{0.05, 0.05, 0.2}, floor, ceiling});
  EXPECT_EQ(stats.returns, 1u);
  EXPECT_EQ(stats.no_returns, 1u);
  EXPECT_EQ(stats.columns, 1u);
  const auto volumes = grid.volumes_at({0.05, 0.05});
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_EQ(volumes[0].state, Occupancy::kOccupied);
  EXPECT_NEAR(volumes[0].bottom_m, -1.10, 1e-9);
  EXPECT_NEAR(volumes[0].top_m, -1.00, 1e-9);
  EXPECT_EQ(volumes[1].state, Occupancy::kFree);
  EXPECT_NEAR(volumes[1].top_m, 1.40, 1e-9) << "the middle of the level above was not reached";
  EXPECT_EQ(grid.at({0.05, 0.05, 1.5}), Occupancy::kUnknown);
  EXPECT_EQ(grid.at({0.15, 0.05, 0.2}), Occupancy::kUnknown);
}

TEST(MultiVolumeGrid, UselessBeamsAreCountedAndChangeNothing) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  MultiVolumeGrid grid;
  const std::vector<Eigen::Vector3f> points{
      {nan, 0, 0}, {0, inf, 0}, {1, 1, -inf}, {3e7F, 0, 0}, {0, 0, 5000}};
  auto stats = grid.insert({{0, 0, 0}, points, points});
  EXPECT_EQ(stats.not_finite, 6u);
  EXPECT_EQ(stats.out_of_bounds, 4u);
  EXPECT_EQ(stats.returns + stats.no_returns + stats.columns, 0u);
  EXPECT_EQ(grid.revision(), 0u);
  const std::vector<Eigen::Vector3f> good{{1, 0, 0}};
  stats = grid.insert(good, {nan, 0, 0});
  EXPECT_EQ(stats.not_finite, 1u);
  stats = grid.insert(good, {1e300, 0, 0});
  EXPECT_EQ(stats.out_of_bounds, 1u);
  EXPECT_EQ(grid.size().columns, 0u);
  EXPECT_EQ(grid.at({nan, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(grid.at({1e300, 0, 0}), Occupancy::kUnknown);
  EXPECT_TRUE(grid.bounds().isEmpty());
}

/// Scans of a wall at x = 2 from the given place, or through where it stood.
BeamScanStats scan_wall(MultiVolumeGrid& grid, double y, bool wall) {
  const std::vector<Eigen::Vector3f> end{{wall ? 2.05F : 4.05F, static_cast<float>(y), 0.52F}};
  return grid.insert(end, {0.05, y, 0.52});
}

TEST(MultiVolumeGrid, ARemovedObstacleDisappearsWithinTheCap) {
  for (const int cap : {1, 4, 8, 15}) {
    MvogParams params;
    params.evidence_cap = cap;
    params.same_view_cap = std::min(cap, 2);
    for (const double step_m : {0.0, 0.0004}) {  // standing still; and never twice at one place
      params.same_view_distance_cell = step_m == 0 ? 0.5 : 0;
      MultiVolumeGrid grid(params);
      for (int i = 0; i < 40; ++i) scan_wall(grid, 0.01 + i * step_m, true);
      ASSERT_EQ(grid.at({2.05, 0.05, 0.52}), Occupancy::kOccupied);
      int scans = 0;
      while (grid.at({2.05, 0.05, 0.52}) == Occupancy::kOccupied && scans < 100) {
        scan_wall(grid, 0.01 + (40 + scans) * step_m, false);
        ++scans;
      }
      EXPECT_LE(scans, cap) << "cap " << cap;
      for (int i = 0; i < cap; ++i) scan_wall(grid, 0.01 + (80 + i) * step_m, true);
      EXPECT_EQ(grid.at({2.05, 0.05, 0.52}), Occupancy::kOccupied) << "and it comes back";
    }
  }
}

TEST(MultiVolumeGrid, RepeatedScansOfOnePoseDoNotHarden) {
  MvogParams params;
  params.evidence_cap = 15;
  params.same_view_cap = 3;
  MultiVolumeGrid grid(params);
  for (int i = 0; i < 500; ++i) scan_wall(grid, 0.05 + 0.0001 * (i % 7), true);
  EXPECT_EQ(grid.evidence_at({2.05, 0.05, 0.52}), (Evidence{3, 0, Occupancy::kUnknown}));
  EXPECT_EQ(grid.evidence_at({1.05, 0.05, 0.52}).misses, 3);
  const std::uint64_t before = grid.revision();
  EXPECT_TRUE(scan_wall(grid, 0.05, true).same_view);
  EXPECT_EQ(grid.revision(), before) << "nothing new, nothing changed";
}

TEST(MultiVolumeGrid, TheChangeLogHoldsEveryChange) {
  MultiVolumeGrid grid(exact_params());
  DenseReference reference(exact_params());
  Rng rng(21);
  for (int i = 0; i < 12; ++i) {
    const auto before = reference.cells();
    const std::uint64_t revision = grid.revision();
    const OwnedScan scan = random_scan(rng, 20, 3, {0.4 * i, 0, 0});
    grid.insert(scan.view());
    reference.insert(scan);
    const auto changes = grid.changed_since(revision);
    std::set<std::array<int, 2>> tiles;
    for (const ChangedTile& tile : changes) {
      EXPECT_GT(tile.revision, revision);
      tiles.insert({static_cast<int>(std::lround(tile.min_m.x() / 0.8)),
                    static_cast<int>(std::lround(tile.min_m.y() / 0.8))});
    }
    EXPECT_EQ(tiles.size(), changes.size()) << "each once";
    std::set<std::array<int, 2>> expected;
    for (const auto& [key, evidence] : reference.cells()) {
      const auto old = before.find(key);
      if (old == before.end() || !(old->second == evidence)) expected.insert({key[0] >> 3, key[1] >> 3});
    }
    EXPECT_EQ(tiles, expected);
    EXPECT_TRUE(grid.changed_since(grid.revision()).empty());
  }
  EXPECT_EQ(grid.changed_since(0).size(), grid.size().tiles);
}

TEST(MultiVolumeGrid, EqualScansGiveEqualBytes) {
  const auto make = [] {
    MultiVolumeGrid grid;
    Rng rng(77);
    for (int i = 0; i < 20; ++i) grid.insert(random_scan(rng, 100, 3, {0.3 * i, -0.2 * i, 0}).view());
    return grid;
  };
  EXPECT_EQ(make().serialise(), make().serialise());
  EXPECT_EQ(make().bytes(), make().bytes());
}

TEST(MultiVolumeGrid, TheMemoryCapRefusesAndCounts) {
  MvogParams params;
  params.max_map_mb = 1;
  MultiVolumeGrid grid(params);
  Rng rng(4);
  std::size_t refused = 0;
  for (int i = 0; i < 40; ++i) {
    refused += grid.insert(random_scan(rng, 200, 60, {10.0 * i, 0, 0}).view()).columns_refused;
    ASSERT_LE(grid.bytes(), 1000000u);
  }
  EXPECT_GT(refused, 1000u);
  EXPECT_GT(grid.size().columns, 1000u);
}

TEST(MultiVolumeGrid, BytesFollowTheContents) {
  MultiVolumeGrid grid;
  const std::size_t empty = grid.bytes();
  Rng rng(6);
  for (int i = 0; i < 20; ++i) grid.insert(random_scan(rng, 100, 4, {0, 0, 0}).view());
  const MvogSize size = grid.size();
  EXPECT_EQ(size.bytes, grid.bytes());
  const std::size_t content = (size.runs + size.columns + size.tiles * 65) * 2;
  EXPECT_GT(grid.bytes(), content);
  EXPECT_LT(grid.bytes(), content * 8 / 5 + empty + 40000);
}

TEST(MultiVolumeGrid, ParametersAreChecked) {
  MvogParams params;
  EXPECT_TRUE(check_params(params).has_value());
  params.same_view_cap = 9;
  EXPECT_NE(check_params(params).error().message.find("evidence_cap"), std::string::npos);
  params = {};
  params.resolution_m = -1;
  EXPECT_FALSE(check_params(params).has_value());
}

}  // namespace
}  // namespace hm
