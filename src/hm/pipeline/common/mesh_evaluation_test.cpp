#include "hm/pipeline/common/mesh_evaluation.hpp"

#include <gmock/gmock.h>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm {
namespace {

TriangleMesh one_square_metre() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST(MeshEvaluation, ErrorsNameTheFileAtFault) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = one_square_metre();
  TriangleMesh points = mesh;
  points.triangles.clear();
  ASSERT_TRUE(write_mesh(folder / "truth_mesh.ply", mesh));
  ASSERT_TRUE(write_mesh(folder / "points.ply", points));
  const auto truth = read_mesh_truth(folder.path()), no_truth = read_mesh_truth(folder / "points.ply");
  ASSERT_TRUE(truth && no_truth);
  const ParallelLoop loop;
  MeshErrorParams params;
  params.samples = 1000;
  EXPECT_TRUE(evaluate_mesh_file(folder / "a.ply", mesh, *truth, params, loop));
  const auto of_mesh = evaluate_mesh_file(folder / "a.ply", points, *truth, params, loop);
  ASSERT_FALSE(of_mesh);
  EXPECT_EQ(of_mesh.error().where, folder / "a.ply");
  const auto of_truth = evaluate_mesh_file(folder / "a.ply", mesh, *no_truth, params, loop);
  ASSERT_FALSE(of_truth);
  EXPECT_EQ(of_truth.error().where, folder / "points.ply");
}

TEST(MeshEvaluation, AnotherUnitIsNamed) {
  const MeshTruth truth{one_square_metre(), {}, "truth.ply"};
  for (const auto& [scale, words] : {std::pair{1000.0F, "1000 times"}, std::pair{0.01F, "0.01 times"}}) {
    TriangleMesh mesh = truth.mesh;
    for (auto& vertex : mesh.vertices) vertex *= scale;
    EXPECT_THAT(mesh_size_warning("mesh.ply", mesh, truth), ::testing::HasSubstr(words));
  }
  TriangleMesh part = truth.mesh;
  for (auto& vertex : part.vertices) vertex *= 0.1F;
  EXPECT_EQ(mesh_size_warning("mesh.ply", part, truth), "");
}

}  // namespace
}  // namespace hm
