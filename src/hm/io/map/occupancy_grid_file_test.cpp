#include "hm/io/map/occupancy_grid_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

constexpr std::uint8_t kUnknown = OccupancyGrid2D::kUnknown;

OccupancyGrid2D some_grid() {
  OccupancyGrid2D grid;
  grid.resolution_m = 0.05;
  grid.origin_m = {-3.25, 7.5};
  grid.cells = {5, 3, kUnknown};
  grid.cells(0, 0) = 100;
  grid.cells(4, 0) = 0;
  grid.cells(2, 1) = 63;
  grid.cells(3, 2) = 12;
  return grid;
}

bool same(const Image<std::uint8_t>& a, const Image<std::uint8_t>& b) {
  return a.width() == b.width() && a.height() == b.height() && std::ranges::equal(a.pixels(), b.pixels());
}

std::string yaml(const std::string& more) {
  return "image: m.pgm\nresolution: 0.1\norigin: [1, 2, 0]\n" + more;
}

TEST(OccupancyGridFile, RawKeepsEveryValue) {
  const TemporaryFolder folder;
  const OccupancyGrid2D grid = some_grid();
  ASSERT_TRUE(write_occupancy_grid(folder / "map.yaml", grid, OccupancyGridMode::kRaw).has_value());
  const auto read = read_occupancy_grid(folder / "map.yaml");
  ASSERT_TRUE(read.has_value()) << to_string(read.error());
  EXPECT_TRUE(same(read->cells, grid.cells));
  EXPECT_EQ(read->resolution_m, grid.resolution_m);
  EXPECT_EQ(read->origin_m, grid.origin_m);
}

TEST(OccupancyGridFile, WritesThePairUnderTheNameAsGiven) {
  const OccupancyGrid2D grid = some_grid();
  const std::array<std::array<const char*, 3>, 6> cases{{{"a.yaml", "a.yaml", "a.pgm"},
                                                         {"a.yml", "a.yml", "a.pgm"},
                                                         {"a.pgm", "a.yaml", "a.pgm"},
                                                         {"a.PGM", "a.yaml", "a.PGM"},
                                                         {"a.Yaml", "a.Yaml", "a.pgm"},
                                                         {"a.b.YML", "a.b.YML", "a.b.pgm"}}};
  for (const auto& [name, description, image] : cases) {
    const TemporaryFolder folder;
    const auto files = occupancy_grid_files(folder / name);
    ASSERT_TRUE(files.has_value()) << name;
    EXPECT_EQ(files->description, folder / description) << name;
    EXPECT_EQ(files->image, folder / image) << name;
    ASSERT_TRUE(write_occupancy_grid(folder / name, grid, OccupancyGridMode::kRaw).has_value()) << name;
    EXPECT_TRUE(std::filesystem::exists(files->image)) << name;
    const auto read = read_occupancy_grid(files->description);
    ASSERT_TRUE(read.has_value()) << name << ": " << to_string(read.error());
    EXPECT_TRUE(same(read->cells, grid.cells)) << name;
  }
}

TEST(OccupancyGridFile, TrinaryKeepsStatesAndIsWhatMapServerExpects) {
  const TemporaryFolder folder;
  const OccupancyGrid2D grid = some_grid();
  ASSERT_TRUE(write_occupancy_grid(folder / "map.yaml", grid).has_value());
  const std::string picture = test::read_bytes(folder / "map.pgm");
  ASSERT_TRUE(picture.starts_with("P5\n"));
  const std::string pixels = picture.substr(picture.size() - 15);
  EXPECT_EQ(static_cast<unsigned char>(pixels[10]), 0) << "the lowest row is the last one";
  EXPECT_EQ(static_cast<unsigned char>(pixels[14]), 254);
  EXPECT_EQ(static_cast<unsigned char>(pixels[11]), 205);
  const std::string text = test::read_bytes(folder / "map.yaml");
  EXPECT_NE(text.find("image: map.pgm\n"), std::string::npos);
  EXPECT_NE(text.find("origin: [-3.25, 7.5, 0.0]\n"), std::string::npos);
  const auto read = read_occupancy_grid(folder / "map.yaml");
  ASSERT_TRUE(read.has_value()) << to_string(read.error());
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 5; ++x) EXPECT_EQ(read->state(x, y), grid.state(x, y)) << x << ' ' << y;
}

TEST(OccupancyGridFile, ReadsOtherPeoplesMaps) {
  const TemporaryFolder folder;
  test::write_bytes(folder / "m.pgm", "P2\n# comment\n3 2 # more\n255\n0 255 205\n255 128 10\n");
  test::write_bytes(
      folder / "map.yaml",
      "# a map\nimage: \"m.pgm\"\nresolution: 0.100000\norigin:\n- -1.5\n- 2\n- 0.0\nnegate: 0\n"
      "occupied_thresh: 0.65 # as usual\nfree_thresh: 0.196\n");
  const auto read = read_occupancy_grid(folder / "map.yaml");
  ASSERT_TRUE(read.has_value()) << to_string(read.error());
  EXPECT_EQ(read->origin_m, Eigen::Vector2d(-1.5, 2));
  EXPECT_EQ(read->cells(0, 1), 100);
  EXPECT_EQ(read->cells(1, 1), 0);
  EXPECT_EQ(read->cells(2, 1), kUnknown);
  EXPECT_EQ(read->cells(1, 0), kUnknown);
  test::write_bytes(folder / "map.yaml", yaml("negate: 1\n"));
  EXPECT_EQ(read_occupancy_grid(folder / "map.yaml")->cells(1, 1), 100);
  test::write_bytes(folder / "map.yaml", yaml("mode: scale\n"));
  const auto scaled = read_occupancy_grid(folder / "map.yaml");
  EXPECT_NEAR(scaled->cells(1, 0), 1 + 98 * (127.0 / 255 - 0.196) / (0.65 - 0.196), 1);
}

TEST(OccupancyGridFile, ErrorsNameThePlace) {
  const TemporaryFolder folder;
  EXPECT_EQ(write_occupancy_grid(folder / "map.png", some_grid()).error().code, ErrorCode::kUsage);
  EXPECT_EQ(occupancy_grid_files("map.png").error().code, ErrorCode::kUsage);
  EXPECT_EQ(write_occupancy_grid(folder / "map.yaml", {}).error().code, ErrorCode::kInvalidValue);
  test::write_bytes(folder / "m.pgm", "P5\n2 2\n255\nabcd");
  const auto error_of = [&](const std::string& text) {
    test::write_bytes(folder / "map.yaml", text);
    const auto read = read_occupancy_grid(folder / "map.yaml");
    return read ? Error{} : read.error();
  };
  ASSERT_EQ(error_of(yaml("")).message, "");
  EXPECT_EQ(error_of("resolution: 0.1\norigin: [0, 0, 0]\n").code, ErrorCode::kNotFound);
  EXPECT_EQ(error_of("image: m.pgm\nresolution: x\norigin: [0, 0, 0]\n").where,
            (folder / "map.yaml").string() + ":2");
  EXPECT_EQ(error_of("image: m.pgm\nresolution: 0.1\norigin: [0, 0, 1.57]\n").code, ErrorCode::kUnsupported);
  EXPECT_EQ(error_of(yaml("mode: strange\n")).code, ErrorCode::kUnsupported);
  test::write_bytes(folder / "m.pgm", "P5\n2 2\n255\nabc");
  EXPECT_EQ(error_of(yaml("")).code, ErrorCode::kTruncated);
  test::write_bytes(folder / "m.pgm", "P5\n1000000 1000000\n255\nabc");
  EXPECT_EQ(error_of(yaml("")).code, ErrorCode::kUnsupported);
}

TEST(OccupancyGridFile, SurvivesDamage) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_occupancy_grid(folder / "map.yaml", some_grid()).has_value());
  const std::string text = test::read_bytes(folder / "map.yaml"),
                    picture = test::read_bytes(folder / "map.pgm");
  const auto read = [&] {
    const auto grid = read_occupancy_grid(folder / "map.yaml");
    if (!grid) {
      EXPECT_FALSE(grid.error().message.empty());
    }
  };
  test::for_each_damaged(text, 300, [&](const std::string& bytes) {
    test::write_bytes(folder / "map.yaml", bytes);
    read();
  });
  test::write_bytes(folder / "map.yaml", text);
  test::for_each_damaged(picture, 300, [&](const std::string& bytes) {
    test::write_bytes(folder / "map.pgm", bytes);
    read();
  });
}

}  // namespace
}  // namespace hm
