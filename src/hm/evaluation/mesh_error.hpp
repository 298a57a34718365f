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
  int seed = 1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"samples", {1, 1e9}, "points sampled on each surface", ParamLevel::kBasic}, self.samples);
    v(ParamDoc{"threshold_m",
               {1e-6, 10},
               "a true point this close to the reconstruction counts as reconstructed",
               ParamLevel::kBasic},
      self.threshold_m);
    v(ParamDoc{"seed", {0, 2147483647.0}, "seed of the sampled points"}, self.seed);
  }
};

/// Signed distance to the true surface in metres, positive in free space. Called from several threads.
using SignedDistanceFunction = std::function<double(const Vec3&)>;

/// Points spread evenly by area over a mesh, in the order of its triangles (stratified: the i-th of n lies
/// in the i-th n-th of the area). Broken and empty triangles get none; empty when there is no area.
std::vector<Vec3> sample_surface(const TriangleMesh& mesh, std::size_t count, std::uint64_t seed);

/// How far a reconstructed surface is from the true one.
struct MeshAccuracy {
  Summary distance_m;                     ///< unsigned: mean, median, p95 ...
  double bias_m = 0;                      ///< mean signed distance; positive: in front of the true surface
  double within_ratio = 0;                ///< share within threshold_m (precision)
  std::vector<float> signed_distances_m;  ///< one per sample, for histograms
};

/// Samples the reconstruction evenly by area and measures every point. An error when it has no area.
Result<MeshAccuracy> mesh_accuracy(const TriangleMesh& reconstruction, const SurfaceDistance& truth,
                                   const MeshErrorParams& params, const ParallelLoop& loop);
Result<MeshAccuracy> mesh_accuracy(const TriangleMesh& reconstruction, const SignedDistanceFunction& truth,
                                   const MeshErrorParams& params, const ParallelLoop& loop);

/// How much of the true surface is there.
struct MeshCompleteness {
  double ratio = 0;           ///< share of the points within threshold_m of the reconstruction (recall)
  Summary distance_m;         ///< from each point to the reconstruction
  std::vector<bool> reached;  ///< for each point
};

/// `truth_points` are points of the true surface that count (those that a sensor saw, or
/// sample_surface of the true mesh). An error when there is none or the reconstruction is empty.
Result<MeshCompleteness> mesh_completeness(const TriangleMesh& reconstruction,
                                           std::span<const Vec3> truth_points, const MeshErrorParams& params,
                                           const ParallelLoop& loop);

struct MeshError {
  MeshAccuracy accuracy;
  MeshCompleteness completeness;
  double f_score = 0;  ///< harmonic mean of precision and recall at threshold_m (Knapitsch et al. 2017)
};

/// Accuracy and completeness against a true mesh. `visible_points` empty: the whole true mesh counts.
Result<MeshError> evaluate_mesh(const TriangleMesh& reconstruction, const TriangleMesh& truth,
                                const MeshErrorParams& params, const ParallelLoop& loop,
                                std::span<const Vec3> visible_points = {});

/// Signed error of every vertex, metres, for heat-maps; NaN for a vertex that is not finite.
std::vector<float> vertex_errors_m(const TriangleMesh& reconstruction, const SurfaceDistance& truth,
                                   const ParallelLoop& loop);
std::vector<float> vertex_errors_m(const TriangleMesh& reconstruction, const SignedDistanceFunction& truth,
                                   const ParallelLoop& loop);

}  // namespace hm
