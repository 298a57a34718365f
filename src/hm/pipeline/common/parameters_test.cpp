#include "hm/pipeline/common/parameters.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace hm {
namespace {

TEST(Parameters, NamesAreUniqueSnakeCaseAndTextsAreThere) {
  Parameters parameters;
  const ParamList list = list_all(parameters);
  std::set<std::string> names;
  for (const ParamRef& param : list.all()) {
    EXPECT_TRUE(names.insert(param.name).second) << param.name;
    EXPECT_THAT(param.name, testing::MatchesRegex("[a-z_]+\\.[a-z0-9_]+"));
    EXPECT_GE(param.help.size(), 6u) << param.name;
  }
  EXPECT_GT(names.size(), 50u);
}

TEST(Parameters, DefaultsAreValidAndTomlReadsBack) {
  Parameters parameters;
  auto list = list_all(parameters);
  EXPECT_TRUE(list.check());
  EXPECT_TRUE(check_parameters(parameters));
  parameters.tsdf.voxel_size_m = 0.0123;
  parameters.simulation.sensor = SensorPreset::kKinect;
  parameters.reconstruction.mesh_formats = "obj, ply";
  Parameters copy;
  auto copy_list = list_all(copy);
  const auto read = copy_list.read_toml(list.to_toml(), "text");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(copy_list.to_toml(), list.to_toml());
  EXPECT_EQ(copy.tsdf.voxel_size_m, 0.0123);
}

TEST(Parameters, MapParametersLeaveOutWhatMayChange) {
  Parameters a, b;
  b.tsdf.max_map_mb = 100;
  b.tsdf.kernel = KernelChoice::kScalar;
  b.mesh.simplify_keep_ratio = 0.5;
  EXPECT_EQ(map_parameters(a), map_parameters(b));
  b.depth_noise.constant_m = 0.01;
  EXPECT_NE(map_parameters(a), map_parameters(b));
}

TEST(Parameters, MeshFormats) {
  ReconstructionParams params;
  params.mesh_formats = "ply, obj";
  EXPECT_THAT(mesh_formats(params).value(), testing::ElementsAre("ply", "obj"));
  params.mesh_formats = "";
  EXPECT_TRUE(mesh_formats(params).value().empty());
  params.mesh_formats = "ply,stl";
  const auto wrong = mesh_formats(params);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().code, ErrorCode::kUsage);
  EXPECT_THAT(wrong.error().message, testing::HasSubstr("stl"));
}

TEST(Parameters, ContradictionsAreUsageErrors) {
  Parameters parameters;
  parameters.tsdf.near_m = 3;
  parameters.tsdf.far_m = 2;
  const auto checked = check_parameters(parameters);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::kUsage);
}

TEST(Parameters, MarkdownHasARowForEach) {
  Parameters parameters;
  const auto list = list_all(parameters);
  const std::string text = to_markdown(list);
  for (const ParamRef& param : list.all()) EXPECT_THAT(text, testing::HasSubstr("| `" + param.name + "` |"));
  EXPECT_THAT(explain(*list.find("tsdf.method")), testing::HasSubstr("projection, traversal"));
}

}  // namespace
}  // namespace hm
