#pragma once
#include <functional>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/core/statistics.hpp"
#include "hm/evaluation/surface_distance.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

struct MeshErrorParams {
  int samples = 1'000'000;
  double threshold_m = 0.02;
  /// Seed of the sampled points.
  int seed = 1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"samples",
               {1, 1e9},
               "number of points sampled on each surface; larger is more precise but slower",
               ParamLevel::kBasic},
      self.samples);
    v(ParamDoc{"threshold_m",
               {1e-6, 10},
               "distance within which a point counts as correct (precision) or reconstructed (recall)",
               ParamLevel::kBasic},
      self.threshold_m);
  }
};

/// Signed distance to the true surface in metres, positive in free space. Called from several threads.
using SignedDistanceFunction = std::function<double(const Vec3&)>;

/// Samples points uniformly by area over a mesh, in the order of its triangles (stratified: the i-th of n
/// lies in the i-th n-th of the area). Invalid and empty triangles get none; empty when there is no area.
std::vector<Vec3> sample_surface(const TriangleMesh& mesh, std::size_t count, std::uint64_t seed);

/// Accuracy: distances of the reconstructed surface from the true one.
struct MeshAccuracy {
  Summary distance_m;                     ///< unsigned: mean, median, p95 ...
  double bias_m = 0;                      ///< mean signed distance; positive: in front of the true surface
  double within_ratio = 0;                ///< share within threshold_m (precision)
  std::vector<float> signed_distances_m;  ///< one per sample, for histograms
};

/// Samples the reconstruction uniformly by area and computes the distance of every point. Error when it has
/// no area.
Result<MeshAccuracy> mesh_accuracy(const TriangleMesh& reconstruction, const SurfaceDistance& truth,
                                   const MeshErrorParams& params, const ParallelLoop& loop);
Result<MeshAccuracy> mesh_accuracy(const TriangleMesh& reconstruction, const SignedDistanceFunction& truth,
                                   const MeshErrorParams& params, const ParallelLoop& loop);

/// Completeness: share of the true surface that was reconstructed.
struct MeshCompleteness {
  double ratio = 0;           ///< share of the points within threshold_m of the reconstruction (recall)
  Summary distance_m;         ///< from each point to the reconstruction
  std::vector<bool> reached;  ///< for each point: within threshold_m
};

/// Computes the completeness. `truth_points` are the relevant points of the true surface (those visible to a
/// sensor, or sample_surface of the true mesh). Error when there are none or the reconstruction is empty.
Result<MeshCompleteness> mesh_completeness(const TriangleMesh& reconstruction,
                                           std::span<const Vec3> truth_points, const MeshErrorParams& params,
                                           const ParallelLoop& loop);

struct MeshError {
  MeshAccuracy accuracy;
  MeshCompleteness completeness;
  double f_score = 0;  ///< harmonic mean of precision and recall at threshold_m (Knapitsch et al. 2017)
};

/// Names of the two meshes in Error::where of evaluate_mesh().
inline constexpr const char *kEvaluatedMesh = "the evaluated mesh", *kTrueMesh = "the true mesh";

/// Accuracy and completeness against a true mesh. Empty `visible_points`: the whole true mesh is used. Error
/// when one of the two has no surface; `where` says which.
Result<MeshError> evaluate_mesh(const TriangleMesh& reconstruction, const TriangleMesh& truth,
                                const MeshErrorParams& params, const ParallelLoop& loop,
                                std::span<const Vec3> visible_points = {});

/// Signed error of every vertex, metres, for heat-maps; NaN for a vertex that is not finite.
std::vector<float> vertex_errors_m(const TriangleMesh& reconstruction, const SurfaceDistance& truth,
                                   const ParallelLoop& loop);
std::vector<float> vertex_errors_m(const TriangleMesh& reconstruction, const SignedDistanceFunction& truth,
                                   const ParallelLoop& loop);

}  // namespace hm
