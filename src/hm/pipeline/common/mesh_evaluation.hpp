#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// The true surface of a scene, and, where it is known, the points of it that the recording could see.
struct MeshTruth {
  TriangleMesh mesh;
  std::vector<Vec3> visible_points;  ///< empty: the whole mesh counts
  std::filesystem::path path;        ///< file of the mesh
};

/// Reads a true mesh: a mesh file, or a folder with truth_mesh.ply and (if there is one) truth_visible.ply,
/// as `hm simulate` writes.
Result<MeshTruth> read_mesh_truth(const std::filesystem::path& path);

/// evaluate_mesh() of a mesh that was read from `path`; an error names the file that is at fault.
Result<MeshError> evaluate_mesh_file(const std::filesystem::path& path, const TriangleMesh& mesh,
                                     const MeshTruth& truth, const MeshErrorParams& params,
                                     const ParallelLoop& loop);

/// A warning where the mesh is so much larger or smaller than the truth that it must be in another unit;
/// empty otherwise.
std::string mesh_size_warning(const std::filesystem::path& path, const TriangleMesh& mesh,
                              const MeshTruth& truth);

/// Turns all of it, as into the frame of poses that were levelled.
void turn(MeshTruth& truth, const Mat3& R_turned_truth);

/// True when the folder of a recording holds a true mesh.
bool has_mesh_truth(const std::filesystem::path& folder);

/// A mesh's error, and what counts as near.
struct MeasuredMesh {
  const MeshError& error;
  const MeshErrorParams& params;
};
/// accuracy_mm{mean,median,rmse,p95,bias}, accuracy_ratio, completeness_ratio, f_score_ratio ...
void visit(const MeasuredMesh& mesh, SummaryTree& v);
/// Lines for a terminal.
std::string to_text(const MeasuredMesh& mesh);
/// A self-contained page: heat-map of the error, histogram, numbers.
std::string mesh_report_html(const TriangleMesh& mesh, const MeshTruth& truth, const MeasuredMesh& measured,
                             const ParallelLoop& loop);

/// Adds quantities of the distance from the true surface and its `bias`, millimetres, as an object.
void add_surface_error(SummaryTree& v, std::string_view key, const MeshAccuracy& accuracy,
                       SummaryTree::Quantities quantities);

}  // namespace hm
