#include "hm/io/map/octomap_file.hpp"

#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <array>
#include <cmath>
#include <map>
#include <memory>

#include "hm/io/bytes/file_name.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

constexpr double kResolution = 0.1;

OccupancyVoxel voxel(int x, int y, int z, float probability) {
  OccupancyVoxel v;
  v.p_world_centre = (Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5) * kResolution).cast<float>();
  v.size_m = static_cast<float>(kResolution);
  v.probability = probability;
  v.state = probability >= 0.5F ? Occupancy::kOccupied : Occupancy::kFree;
  return v;
}

std::vector<OccupancyVoxel> random_voxels(int count) {
  Rng rng(3);
  std::map<std::array<int, 3>, float> cells;
  for (int i = 0; i < count; ++i) {
    const auto at = [&] { return static_cast<int>(rng.below(60)) - 30; };
    const float probability = rng.below(3) == 0 ? 0.9F : 0.2F;
    cells[{at(), at(), at()}] = probability;
  }
  std::vector<OccupancyVoxel> voxels;
  for (const auto& [key, p] : cells) voxels.push_back(voxel(key[0], key[1], key[2], p));
  for (int z = 32; z < 40; ++z)  // a cube that becomes one leaf of 8 cells' edge
    for (int y = 32; y < 40; ++y)
      for (int x = -40; x < -32; ++x) voxels.push_back(voxel(x, y, z, 0.2F));
  return voxels;
}

octomap::point3d point(const OccupancyVoxel& v) {
  return {v.p_world_centre.x(), v.p_world_centre.y(), v.p_world_centre.z()};
}

/// Opens a file as OctoMap's own tools do.
std::unique_ptr<octomap::OcTree> open_with_octomap(const std::filesystem::path& path) {
  if (lower_extension(path) == ".bt") {
    auto tree = std::make_unique<octomap::OcTree>(1.0);
    return tree->readBinary(path.string()) ? std::move(tree) : nullptr;
  }
  auto* tree = octomap::AbstractOcTree::read(path.string());
  return std::unique_ptr<octomap::OcTree>(dynamic_cast<octomap::OcTree*>(tree));
}

class OctomapFile : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Kinds, OctomapFile, testing::Values("map.bt", "map.ot", "map.BT", "map.Ot"));

TEST_P(OctomapFile, OctomapReadsWhatWeWrite) {
  const TemporaryFolder folder;
  const auto path = folder / GetParam();
  const auto voxels = random_voxels(5000);
  ASSERT_TRUE(write_octomap(path, voxels, kResolution).has_value());
  const auto tree = open_with_octomap(path);
  ASSERT_NE(tree, nullptr);
  EXPECT_DOUBLE_EQ(tree->getResolution(), kResolution);
  std::size_t cells = 0;
  for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf) {
    const auto side = static_cast<std::size_t>(std::lround(leaf.getSize() / kResolution));
    cells += side * side * side;
  }
  EXPECT_EQ(cells, voxels.size()) << "no cell more, none less";
  for (const OccupancyVoxel& v : voxels) {
    const auto* node = tree->search(point(v));
    ASSERT_NE(node, nullptr);
    ASSERT_EQ(tree->isNodeOccupied(node), v.state == Occupancy::kOccupied);
    if (path.extension() == ".ot") {
      ASSERT_NEAR(node->getOccupancy(), v.probability, 1e-5);
    }
  }
  const std::size_t size = tree->size();
  tree->prune();
  EXPECT_EQ(tree->size(), size) << "is pruned already";
}

TEST(ColorOctomapFile, OctomapReadsColoursAsWritten) {
  const TemporaryFolder folder;
  const auto voxels = random_voxels(3000);
  Rng rng(5);
  std::vector<Rgb8> colors;
  for (const OccupancyVoxel& v : voxels)  // the cube at the end has one colour, so that it becomes one leaf
    colors.push_back(v.p_world_centre.z() > 3.15F ? Rgb8{10, 20, 30}
                                                  : Rgb8{static_cast<std::uint8_t>(rng.below(256)),
                                                         static_cast<std::uint8_t>(rng.below(256)),
                                                         static_cast<std::uint8_t>(rng.below(256))});
  ASSERT_TRUE(write_color_octomap(folder / "map.ot", voxels, colors, kResolution).has_value());
  octomap::ColorOcTree register_the_kind(1.0);
  const std::unique_ptr<octomap::AbstractOcTree> any(
      octomap::AbstractOcTree::read((folder / "map.ot").string()));
  const auto* tree = dynamic_cast<octomap::ColorOcTree*>(any.get());
  ASSERT_NE(tree, nullptr);
  EXPECT_DOUBLE_EQ(tree->getResolution(), kResolution);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const auto* node = tree->search(point(voxels[i]));
    ASSERT_NE(node, nullptr);
    ASSERT_EQ(tree->isNodeOccupied(node), voxels[i].state == Occupancy::kOccupied);
    ASSERT_NEAR(node->getOccupancy(), voxels[i].probability, 1e-5);
    ASSERT_EQ((Rgb8{node->getColor().r, node->getColor().g, node->getColor().b}), colors[i]);
  }
  EXPECT_LT(tree->getNumLeafNodes(), voxels.size()) << "the cube is one leaf";
  EXPECT_FALSE(write_color_octomap(folder / "map.bt", voxels, colors, kResolution).has_value());
}

TEST_P(OctomapFile, WeReadWhatOctomapWrites) {
  const TemporaryFolder folder;
  const auto path = folder / GetParam();
  octomap::OcTree tree(0.05);
  Rng rng(11);
  for (int i = 0; i < 50; ++i) {
    octomap::Pointcloud cloud;
    for (int k = 0; k < 40; ++k)
      cloud.push_back(static_cast<float>(rng.uniform(-3, 3)), static_cast<float>(rng.uniform(-3, 3)),
                      static_cast<float>(rng.uniform(-1, 1)));
    tree.insertPointCloud(cloud, octomap::point3d(0.01F, 0.02F, 0.03F));
  }
  ASSERT_TRUE(lower_extension(path) == ".bt" ? tree.writeBinary(path.string()) : tree.write(path.string()));
  const auto read = read_octomap(path);
  ASSERT_TRUE(read.has_value()) << to_string(read.error());
  EXPECT_DOUBLE_EQ(read->resolution_m, 0.05);
  EXPECT_EQ(read->voxels.size(), tree.getNumLeafNodes());
  for (const OccupancyVoxel& v : read->voxels) {
    unsigned depth = 16;
    for (double side = 0.05; side < static_cast<double>(v.size_m) * 0.99; side *= 2) --depth;
    const auto* node = tree.search(point(v), depth);
    ASSERT_NE(node, nullptr);
    ASSERT_EQ(tree.isNodeOccupied(node), v.state == Occupancy::kOccupied);
    if (path.extension() == ".ot") {
      ASSERT_NEAR(node->getOccupancy(), v.probability, 1e-5);
    }
  }
  // And once more through our own hands, large leaves included.
  ASSERT_TRUE(write_octomap(folder / "again.bt", read->voxels, 0.05).has_value());
  const auto again = open_with_octomap(folder / "again.bt");
  ASSERT_NE(again, nullptr);
  if (lower_extension(path) == ".bt") {
    EXPECT_EQ(again->getNumLeafNodes(), tree.getNumLeafNodes());
  }
}

TEST_P(OctomapFile, EmptyMapsAreFilesToo) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_octomap(folder / GetParam(), {}, 0.2).has_value());
  const auto read = read_octomap(folder / GetParam());
  ASSERT_TRUE(read.has_value()) << to_string(read.error());
  EXPECT_TRUE(read->voxels.empty());
  EXPECT_DOUBLE_EQ(read->resolution_m, 0.2);
}

TEST_P(OctomapFile, DamageIsAnErrorWithItsPlace) {
  const TemporaryFolder folder;
  const auto path = folder / GetParam();
  ASSERT_TRUE(write_octomap(path, random_voxels(20), kResolution).has_value());
  const std::string good = test::read_bytes(path);
  test::for_each_damaged(good, 300, [&](const std::string& bytes) {
    const auto damaged = folder / (std::string("damaged_") + GetParam());
    test::write_bytes(damaged, bytes);
    const auto read = read_octomap(damaged);
    ASSERT_FALSE(read && bytes.size() < good.size()) << "cut off at " << bytes.size();
    if (read) return;  // another probability is as good as the one before
    ASSERT_NE(read.error().where.find("damaged_"), std::string::npos);
    ASSERT_FALSE(read.error().message.empty());
  });
  test::write_bytes(path, good + "x");
  EXPECT_FALSE(read_octomap(path).has_value());
}

TEST(OctomapFileErrors, AreTold) {
  const TemporaryFolder folder;
  EXPECT_EQ(write_octomap(folder / "map.pcd", {}, 0.1).error().code, ErrorCode::kUsage);
  EXPECT_EQ(write_octomap(folder / "map.bt", {}, 0).error().code, ErrorCode::kInvalidValue);
  const std::vector<OccupancyVoxel> far{voxel(40000, 0, 0, 0.9F)};
  EXPECT_EQ(write_octomap(folder / "map.bt", far, kResolution).error().code, ErrorCode::kInvalidValue);
  EXPECT_EQ(read_octomap(folder / "none.bt").error().code, ErrorCode::kNotFound);
  test::write_bytes(folder / "color.ot",
                    "# Octomap OcTree file\nid ColorOcTree\nsize 1\nres 0.1\ndata\nxxxxxxxxx");
  EXPECT_EQ(read_octomap(folder / "color.ot").error().code, ErrorCode::kUnsupported);
  std::string deep = "# Octomap OcTree binary file\nid OcTree\nsize 100000\nres 0.1\ndata\n";
  for (int i = 0; i < 100000; ++i) deep += std::string("\x03\x00", 2);
  test::write_bytes(folder / "deep.bt", deep);
  EXPECT_EQ(read_octomap(folder / "deep.bt").error().code, ErrorCode::kCorrupted);
}

}  // namespace
}  // namespace hm
