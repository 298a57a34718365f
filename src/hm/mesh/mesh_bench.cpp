// Timings of meshing: one volume, the changes of a frame, the whole mesh.
#include <benchmark/benchmark.h>

#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/mesh/incremental_mesher.hpp"
#include "hm/mesh/marching_cubes.hpp"
#include "hm/mesh/whole_mesh.hpp"

namespace hm {
namespace {

/// A room of 3.2 x 2.6 x 2.1 m with spheres, voxels of 2 cm, noise of 1 mm, known within 4 voxels of the
/// surface, as from a depth camera.
double room_distance_m(const Vec3& p) {
  const Vec3 half(1.6, 1.3, 1.05);
  double distance = (half - p.cwiseAbs()).minCoeff();
  for (int i = 0; i < 12; ++i) {
    const Vec3 center(std::sin(1.7 * i) * 1.2, std::sin(2.9 * i + 1) * 0.9, std::sin(4.3 * i + 2) * 0.7);
    distance = std::min(distance, (p - center).norm() - 0.22 - 0.01 * i);
  }
  return distance;
}

VolumeGrid make_room() {
  VolumeGrid grid(0.02, 1e-5);
  Rng rng(1);
  const double band_m = 0.08;
  for (int z = -8; z < 8; ++z)
    for (int y = -10; y < 10; ++y)
      for (int x = -12; x < 12; ++x) {
        const Vec3 center = (Vec3(x, y, z) + Vec3::Constant(0.5)) * grid.volume_size_m();
        if (std::abs(room_distance_m(center)) > band_m + grid.volume_size_m() * 0.87) continue;
        Volume* volume = grid.allocate({x, y, z});
        grid.allocate_colors(*volume);
        bool any = false;
        for (int i = 0; i < kVolumeVoxels; ++i) {
          const Vec3 at = (8 * Vec3(x, y, z) + Vec3(i & 7, i >> 3 & 7, i >> 6) + Vec3::Constant(0.5)) * 0.02;
          const double distance = room_distance_m(at);
          if (std::abs(distance) > band_m) continue;
          any = true;
          const double noisy = distance + rng.normal(0, 1e-3);
          volume->voxels[i] =
              TsdfVoxel::make(static_cast<std::int16_t>(noisy / grid.sdf_unit_m()), kWeightOne);
          volume->colors[i] = ColorVoxel{rng.next_u32() | 0xff000000u};
        }
        if (!any) grid.release({x, y, z});
      }
  return grid;
}

const VolumeGrid& room() {
  static const VolumeGrid grid = make_room();
  return grid;
}

std::vector<ChangedVolume> everything(const VolumeGrid& grid) {
  std::vector<ChangedVolume> changed;
  for (const VolumeKey key : grid.sorted_keys()) changed.push_back({key, 63, false});
  return changed;
}

void add_rates(benchmark::State& state, double volumes, double vertices) {
  const auto per = [&](double n) {
    return benchmark::Counter(n, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  };
  state.counters["s_per_volume"] = per(volumes);
  state.counters["s_per_vertex"] = per(vertices);
  state.counters["volumes"] = volumes;
  state.counters["vertices"] = vertices;
}

/// Kernel only, on volumes with (1) or without (0) a surface.
void mesh_volumes(benchmark::State& state) {
  std::vector<const Volume*> volumes;
  double vertices = 0;
  for (const VolumeKey key : room().sorted_keys()) {
    const Volume* volume = room().find(key);
    const VolumeMesh mesh = mesh_volume(room(), *volume, 1);
    if (mesh.empty() == (state.range(0) != 0)) continue;
    volumes.push_back(volume);
    vertices += static_cast<double>(mesh.vertex_count());
  }
  for (auto _ : state)
    for (const Volume* volume : volumes) benchmark::DoNotOptimize(mesh_volume(room(), *volume, 1));
  add_rates(state, static_cast<double>(volumes.size()), vertices);
}
BENCHMARK(mesh_volumes)->ArgName("surface")->Arg(1)->Arg(0)->Unit(benchmark::kMillisecond);

/// Changes of one camera frame: about 570 adjacent volumes, half of them with a surface. With `unpack`, also
/// unpacks the changed meshes to vertex and triangle arrays, as a viewer does.
void frame_update(benchmark::State& state) {
  std::vector<ChangedVolume> changed;
  for (const ChangedVolume& volume : everything(room())) {
    if (volume.key.x > 0 && volume.key.y > 0 && changed.size() < 570) changed.push_back(volume);
  }
  const ParallelLoop loop(static_cast<int>(state.range(0)));
  IncrementalMesher mesher(MeshParams{}, loop);
  double vertices = 0, surface = 0;
  for (auto _ : state) {
    mesher.mark_changed(changed);
    const MeshUpdateStats stats = mesher.update(room());
    if (state.range(1))
      for (const VolumeKey key : stats.updated) benchmark::DoNotOptimize(unpack(*mesher.find(key), 0.02));
    vertices = static_cast<double>(stats.vertices_made);
    surface = static_cast<double>(stats.updated.size());
  }
  add_rates(state, static_cast<double>(changed.size()), vertices);
  state.counters["with_surface"] = surface;
}
BENCHMARK(frame_update)
    ->ArgNames({"threads", "unpack"})
    ->Args({1, 0})
    ->Args({2, 0})
    ->Args({1, 1})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// mark_changed and update for every volume of the room, as after a scan of all of it.
void incremental_update(benchmark::State& state) {
  const ParallelLoop loop(static_cast<int>(state.range(0)));
  IncrementalMesher mesher(MeshParams{}, loop);
  const auto changed = everything(room());
  mesher.mark_changed(changed);
  mesher.update(room());
  for (auto _ : state) {
    mesher.mark_changed(changed);
    benchmark::DoNotOptimize(mesher.update(room()));
  }
  add_rates(state, static_cast<double>(changed.size()), static_cast<double>(mesher.vertex_count()));
}
BENCHMARK(incremental_update)
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void mark_changed(benchmark::State& state) {
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  const auto changed = everything(room());
  for (auto _ : state) mesher.mark_changed(changed);
  add_rates(state, static_cast<double>(changed.size()), 1);
}
BENCHMARK(mark_changed)->Unit(benchmark::kMillisecond);

void unpack_volumes(benchmark::State& state) {
  const ParallelLoop loop(1);
  IncrementalMesher mesher(MeshParams{}, loop);
  mesher.mark_all(room());
  mesher.update(room());
  const auto volumes = mesher.volumes();
  for (auto _ : state)
    for (const VolumeMesh* mesh : volumes) benchmark::DoNotOptimize(unpack(*mesh, 0.02));
  add_rates(state, static_cast<double>(volumes.size()), static_cast<double>(mesher.vertex_count()));
}
BENCHMARK(unpack_volumes)->Unit(benchmark::kMillisecond);

void weld_whole(benchmark::State& state) {
  const ParallelLoop loop(static_cast<int>(state.range(0)));
  IncrementalMesher mesher(MeshParams{}, loop);
  mesher.mark_all(room());
  mesher.update(room());
  std::size_t vertices = 0;
  for (auto _ : state) vertices = mesher.whole_mesh().vertices.size();
  add_rates(state, static_cast<double>(mesher.volumes().size()), static_cast<double>(vertices));
  state.counters["bytes_per_vertex"] = static_cast<double>(mesher.bytes()) / static_cast<double>(vertices);
}
BENCHMARK(weld_whole)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

void extract_whole(benchmark::State& state) {
  const ParallelLoop loop(static_cast<int>(state.range(0)));
  std::size_t vertices = 0;
  for (auto _ : state) vertices = extract_mesh(room(), MeshParams{}, loop).vertices.size();
  add_rates(state, static_cast<double>(room().volume_count()), static_cast<double>(vertices));
}
BENCHMARK(extract_whole)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace hm

BENCHMARK_MAIN();
