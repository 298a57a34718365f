// Rows about meshing and memory: per frame, the whole, seams, bytes of the map.
#include <algorithm>
#include <array>
#include <cmath>

#include "dense/peer.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/mesh/incremental_mesher.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr double kVoxel_m = 0.02, kBand_m = 0.08;

FrameRange range_of(const BenchOptions& options) {
  return {static_cast<std::size_t>(options.frame_limit), 1, 40};
}

Result<void> integrate_all(FrameSource& source, std::span<Contender* const> contenders) {
  while (true) {
    const auto chunk = source.next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) return {};
    for (Contender* contender : contenders) {
      contender->prepare(*chunk);
      for (std::size_t i = 0; i < chunk->size(); ++i) contender->integrate(i);
    }
  }
}

using Lattice = std::array<int, 3>;

/// True when all 8 corners of the cube with this low corner are known.
bool is_observed(const VolumeGrid& grid, const Lattice& cube) {
  for (int corner = 0; corner < 8; ++corner)
    if (grid.voxel(cube[0] + (corner & 1), cube[1] + (corner >> 1 & 1), cube[2] + (corner >> 2)).weight() ==
        0)
      return false;
  return true;
}

/// The low corners of the four cubes around the lattice edge that a vertex lies on.
std::array<Lattice, 4> cubes_around(const Eigen::Vector3f& vertex, double voxel_size_m) {
  const Vec3 at = vertex.cast<double>() / voxel_size_m - Vec3::Constant(0.5);
  int axis = 0;
  (at.array() - at.array().round()).abs().maxCoeff(&axis);
  Lattice low{};
  for (int i = 0; i < 3; ++i)
    low[static_cast<std::size_t>(i)] = static_cast<int>(i == axis ? std::floor(at[i]) : std::round(at[i]));
  std::array<Lattice, 4> cubes{low, low, low, low};
  for (std::size_t i = 0; i < 4; ++i) {
    cubes[i][static_cast<std::size_t>((axis + 1) % 3)] -= static_cast<int>(i & 1);
    cubes[i][static_cast<std::size_t>((axis + 2) % 3)] -= static_cast<int>(i >> 1);
  }
  return cubes;
}

struct SeamCount {
  std::size_t open = 0, inside = 0, inside_at_borders = 0;
};

/// An open edge lies in the face between two cubes. It is rightly open when one of them is not observed;
/// otherwise it is a crack, at a volume border if the cubes belong to different volumes.
SeamCount count_seams(const VolumeGrid& grid, const TriangleMesh& mesh) {
  SeamCount count;
  for (const auto& [a, b] : open_edges(mesh)) {
    ++count.open;
    const auto of_a = cubes_around(mesh.vertices[a], grid.voxel_size_m());
    std::vector<Lattice> both;
    for (const Lattice& cube : cubes_around(mesh.vertices[b], grid.voxel_size_m()))
      if (std::find(of_a.begin(), of_a.end(), cube) != of_a.end()) both.push_back(cube);
    if (std::any_of(both.begin(), both.end(), [&](const Lattice& c) { return !is_observed(grid, c); }))
      continue;
    ++count.inside;
    const auto volume = [](const Lattice& c) { return Lattice{c[0] >> 3, c[1] >> 3, c[2] >> 3}; };
    if (both.size() != 2 || volume(both[0]) != volume(both[1])) ++count.inside_at_borders;
  }
  return count;
}

}  // namespace

Result<BenchResult> bench_mesh_incremental(const BenchOptions& options) {
  auto source = open_frames("sevenscenes_a", range_of(options));
  if (!source) return forward_error(source);
  const TsdfParams params = common_params(kVoxel_m, kBand_m);
  const ParallelLoop loop(options.threads);
  VolumeGrid grid = Integrator::make_grid(params);
  Integrator integrator(params, {}, (*source)->camera(), loop);
  IncrementalMesher mesher(MeshParams{}, loop);
  double integrate_ms = 0, mesh_ms = 0, frames = 0;
  while (true) {
    const auto chunk = (*source)->next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) break;
    for (const RgbdFrame& frame : *chunk) {
      const Stopwatch watch;
      const ScanStats scan = integrator.integrate(grid, frame);
      const double integrated_ms = watch.milliseconds();
      mesher.mark_changed(scan.changed);
      mesher.update(grid);
      mesh_ms += watch.milliseconds() - integrated_ms;
      integrate_ms += integrated_ms;
      frames += 1;
    }
  }
  return BenchResult{
      {{"mesh_incremental", mesh_ms / integrate_ms, {}}},
      JsonValue::object({{"mesh_ms", mesh_ms / frames}, {"integrate_ms", integrate_ms / frames}})};
}

Result<BenchResult> bench_mesh_whole(const BenchOptions& options) {
  auto source = open_frames("sevenscenes_a", range_of(options));
  if (!source) return forward_error(source);
  const PinholeCamera camera = (*source)->camera();
  OurContender us(common_params(kVoxel_m, kBand_m), camera, options.threads);
  const auto scalable = make_peer({PeerGrid::kScalable, kVoxel_m, kBand_m, 4.0, true}, camera);
  const auto blocks = make_peer({PeerGrid::kVoxelBlock, kVoxel_m, kBand_m, 4.0, true}, camera);
  std::vector<Contender*> contenders{&us};
  if (has_peer()) contenders.insert(contenders.end(), {scalable.get(), blocks.get()});
  if (const auto done = integrate_all(**source, contenders); !done) return forward_error(done);

  double ours_ms = 1e9, scalable_ms = 1e9, blocks_ms = 1e9;
  TriangleMesh mesh;
  for (int round = 0; round < 5; ++round) {
    const Stopwatch watch;
    mesh = extract_mesh(us.grid(), MeshParams{}, us.loop());
    ours_ms = std::min(ours_ms, watch.milliseconds());
    if (!has_peer()) continue;
    double ms = 0;
    scalable->extract(ms);
    scalable_ms = std::min(scalable_ms, ms);
    blocks->extract(ms);
    blocks_ms = std::min(blocks_ms, ms);
  }
  BenchResult result;
  const auto bytes = static_cast<double>(us.grid().map_bytes());
  result.rows = {{"mesh_whole", ours_ms, {}},
                 {"map_memory", bytes * 1e-6, {}},
                 {"map_memory_voxelblock", bytes * 1e-6, {}}};
  result.details = JsonValue::object({{"volumes", us.grid().volume_count()},
                                      {"vertices", mesh.vertices.size()},
                                      {"triangles", mesh.triangles.size()}});
  if (!has_peer()) return result;
  result.rows[0].peer = std::min(scalable_ms, blocks_ms);
  result.rows[1].peer = static_cast<double>(scalable->map_bytes()) * 1e-6;
  result.rows[2].peer = static_cast<double>(blocks->map_bytes()) * 1e-6;
  result.details["scalable_mesh_ms"] = scalable_ms;
  result.details["voxelblock_mesh_ms"] = blocks_ms;
  result.details["scalable_units"] = scalable->block_count();
  result.details["voxelblock_blocks"] = blocks->block_count();
  return result;
}

Result<BenchResult> bench_seams(const BenchOptions& options) {
  SimulationParams scene;
  scene.frame_limit = options.frame_limit ? options.frame_limit : 400;
  const Simulation simulation(scene);
  SeamCount total;
  JsonValue details = JsonValue::object();
  for (const std::string name : {"house", "sevenscenes_a"}) {
    std::unique_ptr<FrameSource> source = simulated_frames(simulation, range_of(options));
    if (name != "house") {
      auto recording = open_frames(name, range_of(options));
      if (!recording) continue;  // the simulated house is judged in any case
      source = std::move(*recording);
    }
    OurContender us(TsdfParams{}, source->camera(), options.threads);
    Contender* const contenders[] = {&us};
    if (const auto done = integrate_all(*source, contenders); !done) return forward_error(done);
    const SeamCount count = count_seams(us.grid(), extract_mesh(us.grid(), MeshParams{}, us.loop()));
    details[name] = JsonValue::object(
        {{"open_edges", count.open}, {"inside", count.inside}, {"at_borders", count.inside_at_borders}});
    total.inside += count.inside;
  }
  return BenchResult{{{"seams", static_cast<double>(total.inside), {}}}, details};
}

}  // namespace hm::bench
