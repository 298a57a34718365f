#include "hm/pipeline/common/parameters.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "hm/pipeline/calibrate/calibrate_parameter_list.hpp"
#include "hm/pipeline/dense/dense_parameter_list.hpp"
#include "hm/pipeline/flight/mission/flight_mission.hpp"
#include "hm/pipeline/laser/laser_params.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"
#include "hm/pipeline/simulate/simulate_parameter_list.hpp"

namespace hm {
namespace {

/// Every section of every part that a verb registers, once: what `hm params show` can list.
struct AllSections {
  std::vector<ParameterPart> parts{
      make_parameter_part(list_dense),       make_parameter_part(list_slam),
      make_parameter_part(list_laser),       make_parameter_part(list_simulation),
      make_parameter_part(list_calibration), make_parameter_part(list_flight_mission)};
  ParamList list;
  AllSections() {
    for (const ParameterPart& part : parts) list.add_missing(part.list);
  }
};

TEST(Parameters, NamesAreUniqueSnakeCaseAndTextsAreThere) {
  const AllSections sections;
  const ParamList& list = sections.list;
  std::set<std::string> names;
  for (const ParamRef& param : list.all()) {
    EXPECT_TRUE(names.insert(param.name).second) << param.name;
    EXPECT_THAT(param.name, testing::MatchesRegex("[a-z_]+\\.[a-z0-9_]+"));
    EXPECT_GE(param.help.size(), 6u) << param.name;
  }
  EXPECT_GT(names.size(), 50u);
}

TEST(Parameters, DefaultsAreValidAndTomlReadsBack) {
  AllSections sections, copy;
  EXPECT_TRUE(sections.list.check());
  for (const ParameterPart& part : sections.parts) EXPECT_TRUE(!part.check || part.check());
  for (const char* change :
       {"tsdf.voxel_size_m=0.0123", "simulation.sensor=kinect", "reconstruction.mesh_formats=\"obj, ply\""})
    EXPECT_TRUE(sections.list.set(change)) << change;
  const auto read = copy.list.read_toml(sections.list.to_toml(), "text");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(copy.list.to_toml(), sections.list.to_toml());
  EXPECT_EQ(value_text(*copy.list.find("tsdf.voxel_size_m")), "0.0123");
}

TEST(Parameters, APartsOwnSectionsComeBeforeThoseThatItLacks) {
  DenseParameters own;
  ParamList list = list_dense(own);
  const std::size_t own_count = list.all().size();
  const ParameterPart rgbd = make_parameter_part(list_slam);
  list.add_missing(rgbd.list);
  EXPECT_GT(list.all().size(), own_count);
  ASSERT_TRUE(list.set("tsdf.voxel_size_m=0.05"));
  EXPECT_EQ(own.tsdf.voxel_size_m, 0.05);
  EXPECT_NE(value_text(*rgbd.list.find("tsdf.voxel_size_m")), "0.05");
}

TEST(Parameters, MapParametersLeaveOutWhatMayChange) {
  DenseParams a, b;
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
  DenseParams parameters;
  parameters.tsdf.near_m = 3;
  parameters.tsdf.far_m = 2;
  const auto checked = check_parameters(parameters);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::kUsage);
}

TEST(Parameters, FewAreShownUnlessAskedFor) {
  const AllSections sections;
  const auto all = sections.list.all();
  const auto basic = std::ranges::count(all, ParamLevel::kBasic, &ParamRef::level);
  EXPECT_LE(basic, 80);
  EXPECT_LE(all.size(), 300U);
}

TEST(Parameters, OldNamesAreErrorsThatSayTheNewOnes) {
  AllSections sections;
  const auto message = [&](const char* assignment) {
    const auto set = sections.list.set(assignment);
    return set ? std::string() : set.error().message;
  };
  EXPECT_THAT(message("matcher.max_iterations=3"), testing::HasSubstr("'pl_icp.max_iterations'"));
  EXPECT_THAT(message("loops.min_score=0.5"), testing::HasSubstr("'laser_loops.min_score'"));
  EXPECT_THAT(message("keyframe_loops.link_visits=true"), testing::HasSubstr("'rgbd_loops.match_covisible'"));
  EXPECT_THAT(message("keyframe_loops.gate_chi2=1"), testing::HasSubstr("no parameter any more"));
}

TEST(Parameters, MarkdownHasARowForEach) {
  const AllSections sections;
  const ParamList& list = sections.list;
  const std::string basic = to_markdown(list, ParamLevel::kBasic),
                    expert = to_markdown(list, ParamLevel::kExpert);
  for (const ParamRef& param : list.all()) {
    const auto row = testing::HasSubstr("| `" + param.name + "` |");
    EXPECT_THAT(param.level == ParamLevel::kBasic ? basic : expert, row);
    EXPECT_THAT(param.level == ParamLevel::kBasic ? expert : basic, testing::Not(row));
  }
  EXPECT_THAT(explain(*list.find("tsdf.method")), testing::HasSubstr("projection, traversal"));
}

}  // namespace
}  // namespace hm
