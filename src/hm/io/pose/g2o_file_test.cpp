#include "hm/io/pose/g2o_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using ::testing::HasSubstr;

const std::string kText =
    "VERTEX_SE2 10 1 2 0.5\nVERTEX_SE2 12 2 2 -0.5\r\n\n# a remark\nFIX 10\n"
    "EDGE_SE2 10 12 1 0.1 -1 100 1 2 90 3 400\nEDGE_SE2 12 11 0.5 0 0.25 1 0 0 1 0 1\nVERTEX_XY 3 1 2\n";

TEST(G2oFile, Reads) {
  const TemporaryFolder folder;
  test::write_bytes(folder / "a.g2o", kText + "EDGE_SE2 12 1");
  const auto read = read_g2o_2d(folder / "a.g2o");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->ids, (std::vector<std::int64_t>{10, 11, 12}));
  EXPECT_EQ(read->fixed, (std::vector<std::size_t>{0}));
  EXPECT_EQ(read->other_lines, 1U);
  ASSERT_EQ(read->skipped.size(), 1U);
  EXPECT_EQ(read->skipped[0].reason, SkippedLines::Reason::kCutOff);
  ASSERT_EQ(read->graph.edges.size(), 2U);
  const PoseEdge2D& edge = read->graph.edges[0];
  EXPECT_EQ(edge.from, 0U);
  EXPECT_EQ(edge.to, 2U);
  EXPECT_EQ(edge.kind, PoseEdgeKind::kLoop);
  Mat3 information;
  information << 100, 1, 2, 1, 90, 3, 2, 3, 400;
  EXPECT_EQ(edge.information, information);
  // Node 11 has no vertex: it stands where the edge from 12 puts it.
  const SE2 expected = SE2(2, 2, -0.5) * SE2(0.5, 0, 0.25);
  EXPECT_LT((read->graph.T_map_node[1].vector() - expected.vector()).norm(), 1e-12);
}

TEST(G2oFile, WrittenGraphReadsBackTheSame) {
  const TemporaryFolder folder;
  Rng rng(5);
  PoseGraph2D graph;
  for (int i = 0; i < 50; ++i)
    graph.T_map_node.emplace_back(rng.normal(0, 30), rng.normal(0, 1e-3), rng.uniform(-3, 3));
  for (std::size_t i = 0; i + 1 < 50; ++i) {
    const Mat3 root = Mat3::NullaryExpr([&] { return rng.normal(); });
    graph.edges.push_back({i, i + 1, SE2(rng.normal(), 1 / 3.0, rng.uniform(-3, 3)),
                           (root * root.transpose()).selfadjointView<Eigen::Upper>(),
                           PoseEdgeKind::kOdometry});
  }
  ASSERT_TRUE(write_g2o_2d(graph, folder / "b.g2o"));
  const auto read = read_g2o_2d(folder / "b.g2o");
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->graph.T_map_node.size(), 50U);
  ASSERT_EQ(read->graph.edges.size(), 49U);
  for (std::size_t i = 0; i < 50; ++i)
    EXPECT_EQ(read->graph.T_map_node[i].vector(), graph.T_map_node[i].vector());
  for (std::size_t i = 0; i < 49; ++i) {
    EXPECT_EQ(read->graph.edges[i].T_from_to.vector(), graph.edges[i].T_from_to.vector());
    EXPECT_EQ(read->graph.edges[i].information, graph.edges[i].information);
    EXPECT_EQ(read->graph.edges[i].kind, PoseEdgeKind::kOdometry);
  }
}

TEST(G2oFile, MistakesAreNamed) {
  const TemporaryFolder folder;
  for (const std::string text :
       {"VERTEX_SE2 0 1 2\n", "VERTEX_SE2 1 1 2 nan\n", "VERTEX_SE2 0 1 2 0\n", "VERTEX_SE2 -1 0 0 0\n",
        "VERTEX_SE2\n", "EDGE_SE2 0 0 1 0 0 1 0 0 1 0 1\n", "EDGE_SE2 0 1 1 0 0 -1 0 0 1 0 1\n",
        "EDGE_SE2 0 1 1 0 0 1 0 0 1 0\n", "FIX a\n"}) {
    test::write_bytes(folder / "a.g2o", "VERTEX_SE2 0 0 0 0\n" + text);
    const auto read = read_g2o_2d(folder / "a.g2o");
    ASSERT_FALSE(read) << text;
    EXPECT_THAT(read.error().where, HasSubstr("a.g2o:2")) << text;
  }
  test::write_bytes(folder / "a.g2o", "VERTEX_SE2 0 0 0 0\nEDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\n");
  const auto apart = read_g2o_2d(folder / "a.g2o");
  ASSERT_FALSE(apart);
  EXPECT_THAT(apart.error().message, HasSubstr("node 1"));
  for (const std::string text : {"", "FIX 0\n", "VERTEX_SE2_X 1\n", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n"}) {
    test::write_bytes(folder / "a.g2o", text);
    EXPECT_FALSE(read_g2o_2d(folder / "a.g2o")) << text;
  }
  EXPECT_FALSE(read_g2o_2d(folder / "none"));
}

TEST(G2oFile, EveryDamageIsAnErrorOrAGraph) {
  const TemporaryFolder folder;
  test::for_each_damaged(kText, 1000, [&](const std::string& bytes) {
    test::write_bytes(folder / "damaged", bytes);
    const auto read = read_g2o_2d(folder / "damaged");
    if (!read) return;
    for (const SE2& node : read->graph.T_map_node) EXPECT_TRUE(node.vector().allFinite());
    for (const PoseEdge2D& edge : read->graph.edges) {
      EXPECT_LT(edge.from, read->graph.T_map_node.size());
      EXPECT_LT(edge.to, read->graph.T_map_node.size());
      EXPECT_TRUE(edge.information.allFinite());
    }
  });
}

const std::string kUnit21 = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";
const std::string kSpatial =
    "VERTEX_SE3:QUAT 4 1 2 3 0 0 0.6 0.8\nVERTEX_SE3:QUAT 7 0 0 0 0 0 0 1\r\nFIX 4\nVERTEX_SE2 1 0 0 0\n"
    "EDGE_SE3:QUAT 4 7 1 0.5 0 0 0 0 1 11 1 2 3 4 5 12 6 7 8 9 13 10 11 12 14 13 14 15 15 16\n"
    "EDGE_SE3:QUAT 7 9 0 0 2 1 0 0 0" +
    kUnit21 + "\n";

TEST(G2oFile3D, Reads) {
  const TemporaryFolder folder;
  test::write_bytes(folder / "a.g2o", kSpatial + "EDGE_SE3:QUAT 4 7 1");
  const auto read = read_g2o_3d(folder / "a.g2o");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->ids, (std::vector<std::int64_t>{4, 7, 9}));
  EXPECT_EQ(read->fixed, (std::vector<std::size_t>{0}));
  EXPECT_EQ(read->other_lines, 1U);
  ASSERT_EQ(read->skipped.size(), 1U);
  ASSERT_EQ(read->graph.edges.size(), 2U);
  // A quarter and a bit about z: cos = 0.28, sin = 0.96.
  EXPECT_NEAR(read->graph.T_map_node[0].rotation()(1, 0), 0.96, 1e-12);
  const Mat6& information = read->graph.edges[0].information;
  EXPECT_EQ(information, Mat6(information.transpose()));
  EXPECT_EQ(information(0, 5), 5);
  EXPECT_EQ(information(1, 2), 6);
  EXPECT_EQ(information(5, 5), 16);
  EXPECT_EQ(read->graph.edges[0].kind, PoseEdgeKind::kOdometry);
  // Node 9 has no vertex: half a turn about x, 2 m along z from node 7.
  EXPECT_LT((read->graph.T_map_node[2].translation() - Vec3(0, 0, 2)).norm(), 1e-12);
  EXPECT_NEAR(read->graph.T_map_node[2].rotation()(1, 1), -1, 1e-12);
}

TEST(G2oFile3D, WrittenGraphReadsBackTheSame) {
  const TemporaryFolder folder;
  Rng rng(6);
  const auto pose = [&rng] { return SE3::exp(Vec6::NullaryExpr([&rng] { return rng.normal(); })); };
  PoseGraph3D graph;
  for (std::size_t i = 0; i < 30; ++i) {
    graph.T_map_node.push_back(pose());
    if (i == 0) continue;
    const Mat6 root = Mat6::NullaryExpr([&rng] { return rng.normal(); });
    graph.edges.push_back({i - 1, i, pose(), (root * root.transpose()).selfadjointView<Eigen::Upper>(),
                           PoseEdgeKind::kOdometry});
  }
  ASSERT_TRUE(write_g2o_3d(graph, folder / "b.g2o"));
  const auto read = read_g2o_3d(folder / "b.g2o");
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->graph.T_map_node.size(), 30U);
  ASSERT_EQ(read->graph.edges.size(), 29U);
  for (std::size_t i = 0; i < 30; ++i)
    EXPECT_LT((read->graph.T_map_node[i].matrix() - graph.T_map_node[i].matrix()).norm(), 1e-14);
  for (std::size_t i = 0; i < 29; ++i) {
    EXPECT_LT((read->graph.edges[i].T_from_to.matrix() - graph.edges[i].T_from_to.matrix()).norm(), 1e-14);
    EXPECT_EQ(read->graph.edges[i].information, graph.edges[i].information);
  }
}

TEST(G2oFile3D, MistakesAreNamed) {
  const TemporaryFolder folder;
  const std::string edge = "EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1";
  for (const std::string& text :
       {std::string("VERTEX_SE3:QUAT 1 0 0 0 0 0 0\n"), std::string("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 0\n"),
        std::string("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1.1\n"), std::string("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n"),
        std::string("VERTEX_SE3:QUAT 1 0 inf 0 0 0 0 1\n"), edge + "\n", edge + kUnit21 + " 1\n",
        "EDGE_SE3:QUAT 1 1 0 0 0 0 0 0 1" + kUnit21 + "\n", edge + " -1" + kUnit21.substr(2) + "\n"}) {
    test::write_bytes(folder / "a.g2o", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n" + text);
    const auto read = read_g2o_3d(folder / "a.g2o");
    ASSERT_FALSE(read) << text;
    EXPECT_THAT(read.error().where, HasSubstr("a.g2o:2")) << text;
  }
  test::write_bytes(folder / "a.g2o", "VERTEX_SE2 0 0 0 0\n");
  EXPECT_FALSE(read_g2o_3d(folder / "a.g2o"));
}

TEST(G2oFile3D, EveryDamageIsAnErrorOrAGraph) {
  const TemporaryFolder folder;
  test::for_each_damaged(kSpatial, 1000, [&](const std::string& bytes) {
    test::write_bytes(folder / "damaged", bytes);
    const auto read = read_g2o_3d(folder / "damaged");
    if (!read) return;
    for (const SE3& node : read->graph.T_map_node) EXPECT_TRUE(is_rigid(node));
    for (const PoseEdge3D& edge : read->graph.edges) {
      EXPECT_LT(edge.from, read->graph.T_map_node.size());
      EXPECT_LT(edge.to, read->graph.T_map_node.size());
      EXPECT_TRUE(edge.information.allFinite());
    }
  });
}

}  // namespace
}  // namespace hm
