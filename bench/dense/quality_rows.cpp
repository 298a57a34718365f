// Rows about the result: against the closed form of the room, and how much of the house is there.
#include "dense/contender.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "hm/sim/world/room_scene.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

Result<TriangleMesh> reconstruct(FrameSource& source, const TsdfParams& params, int threads) {
  OurContender us(params, source.camera(), threads);
  while (true) {
    const auto chunk = source.next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) break;
    us.prepare(*chunk);
    for (std::size_t i = 0; i < chunk->size(); ++i) us.integrate(i);
  }
  return extract_mesh(us.grid(), MeshParams{}, us.loop());
}

}  // namespace

Result<BenchResult> bench_accuracy(const BenchOptions& options) {
  SimulationParams scene;
  scene.world = WorldKind::kRoom;
  scene.sensor = SensorPreset::kKinect;
  const Simulation simulation(scene);
  const std::size_t frames = options.frame_limit ? static_cast<std::size_t>(options.frame_limit) : 500;
  const auto source =
      simulated_frames(simulation, {frames, std::max<std::size_t>(simulation.frame_count() / frames, 1), 40});
  TsdfParams params;
  params.voxel_size_m = 0.01;
  const auto mesh = reconstruct(*source, params, options.threads);
  if (!mesh) return forward_error(mesh);
  const auto accuracy = mesh_accuracy(*mesh, SignedDistanceFunction(room_sdf), MeshErrorParams{},
                                      ParallelLoop(options.threads));
  if (!accuracy) return forward_error(accuracy);
  BenchResult result;
  result.rows = {{"accuracy", accuracy->distance_m.mean * 1e3, {}},
                 {"accuracy_p95", accuracy->distance_m.p95 * 1e3, {}},
                 {"accuracy_bias", std::abs(accuracy->bias_m) * 1e3, {}}};
  result.details = JsonValue::object({{"frames", frames},
                                      {"of_frames", simulation.frame_count()},
                                      {"triangles", mesh->triangles.size()},
                                      {"median_mm", accuracy->distance_m.median * 1e3},
                                      {"p99_mm", accuracy->distance_m.p99 * 1e3},
                                      {"max_mm", accuracy->distance_m.max * 1e3},
                                      {"bias_mm", accuracy->bias_m * 1e3}});
  return result;
}

Result<BenchResult> bench_completeness(const BenchOptions& options) {
  SimulationParams scene;
  scene.frame_limit = options.frame_limit;
  const Simulation simulation(scene);
  const auto source = simulated_frames(simulation, {0, 1, 40});
  TsdfParams params;
  params.voxel_size_m = 0.02;
  const auto mesh = reconstruct(*source, params, options.threads);
  if (!mesh) return forward_error(mesh);
  const ParallelLoop loop(options.threads);
  std::vector<Vec3> truth;
  for (const Eigen::Vector3f& point : simulation.visible_truth(loop).positions)
    truth.push_back(point.cast<double>());
  MeshErrorParams error;
  error.threshold_m = 0.02;
  const auto completeness = mesh_completeness(*mesh, truth, error, loop);
  if (!completeness) return forward_error(completeness);
  BenchResult result;
  result.rows = {{"completeness", completeness->ratio * 100, {}}};
  result.details = JsonValue::object({{"frames", simulation.frame_count()},
                                      {"truth_points", truth.size()},
                                      {"triangles", mesh->triangles.size()},
                                      {"median_mm", completeness->distance_m.median * 1e3},
                                      {"p95_mm", completeness->distance_m.p95 * 1e3}});
  return result;
}

}  // namespace hm::bench
