#include "hm/mapping/dense_pipeline.hpp"

#include <algorithm>
#include <new>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/core/parallel.hpp"
#include "hm/core/process_memory.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/mapping/map_copy.hpp"
#include "hm/mesh/incremental_mesher.hpp"
#include "hm/mesh/simplify.hpp"
#include "hm/tsdf/alignment/trajectory_aligner.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"
#include "hm/tsdf/integration/integrator.hpp"

namespace hm {
namespace {

constexpr std::uint8_t kAllLayers = 0x3f;

/// Reason why a frame is unusable regardless of its depth, or empty.
std::string unusable_because(const RgbdFrame& frame, const PinholeCamera& camera) {
  if (!frame.T_world_camera) return std::string(kNoPose);
  if (!frame.T_world_camera->matrix().allFinite()) return "its pose is not finite";
  if (!is_rigid(*frame.T_world_camera)) return "its pose is not a rigid motion";
  if (frame.depth.width() != camera.width || frame.depth.height() != camera.height)
    return fmt::format("its depth image is {} x {}, the camera's {} x {}", frame.depth.width(),
                       frame.depth.height(), camera.width, camera.height);
  return {};
}

}  // namespace

struct DensePipeline::Impl {
  Impl(const DenseParams& all, const PinholeCamera& its_camera, int threads)
      : parameters(all),
        camera(its_camera),
        loop(threads),
        grid(Integrator::make_grid(all.tsdf)),
        integrator(all.tsdf, all.depth_noise, its_camera, loop),
        mesher(all.mesh, loop),
        aligner(all.alignment, all.tsdf, all.depth_noise, its_camera) {}

  DenseParams parameters;
  PinholeCamera camera;
  ParallelLoop loop;
  VolumeGrid grid;
  Integrator integrator;
  IncrementalMesher mesher;
  TrajectoryAligner aligner;
  ChangeSink change_sink;
  MeshObserver* observer = nullptr;

  void note(std::span<const ChangedVolume> changed) const {
    if (change_sink) change_sink(changed);
  }
  MeshUpdateStats update_mesh(double budget_ms = 0);
  void integrate(const RgbdFrame& frame, FrameOutcome& outcome);
  void mesh_and_pack(FrameOutcome& outcome);
};

DensePipeline::DensePipeline(const DenseParams& parameters, const PinholeCamera& camera, int threads)
    : impl_(std::make_unique<Impl>(parameters, camera, threads)) {
  HM_CHECK(camera.distortion.is_zero(), "the camera has lens distortion");
}
DensePipeline::~DensePipeline() = default;

void DensePipeline::set_threads(int threads) { impl_->loop = ParallelLoop(threads); }

const VolumeGrid& DensePipeline::grid() const { return impl_->grid; }
VolumeGrid& DensePipeline::grid() { return impl_->grid; }
const IncrementalMesher& DensePipeline::mesher() const { return impl_->mesher; }
const ParallelLoop& DensePipeline::loop() const { return impl_->loop; }
void DensePipeline::set_change_sink(ChangeSink sink) { impl_->change_sink = std::move(sink); }
const SE3& DensePipeline::T_map_input() const { return impl_->aligner.T_map_odom(); }
void DensePipeline::set_T_map_input(const SE3& T_map_input) { impl_->aligner.set_T_map_odom(T_map_input); }

void DensePipeline::adopt(VolumeGrid grid) {
  HM_CHECK(grid.voxel_size_m() == impl_->grid.voxel_size_m() && grid.sdf_unit_m() == impl_->grid.sdf_unit_m(),
           "voxels of {} m, units of {} m", grid.voxel_size_m(), grid.sdf_unit_m());
  if (impl_->change_sink)
    for (const VolumeGrid* one : {&impl_->grid, &grid}) impl_->note(all_volumes(*one));
  impl_->grid = std::move(grid);
  impl_->mesher.mark_all(impl_->grid);
}

FrameOutcome DensePipeline::process(const RgbdFrame& frame) {
  if (!impl_->parameters.reconstruction.align) return process_in_map(frame);
  FrameOutcome outcome;
  outcome.skipped_because = unusable_because(frame, impl_->camera);
  if (!outcome.skipped_because.empty()) return outcome;
  outcome.alignment = impl_->aligner.align(impl_->grid, frame.depth, *frame.T_world_camera);
  outcome.T_world_camera = outcome.alignment->T_world_camera;
  impl_->integrate(frame, outcome);
  return outcome;
}

FrameOutcome DensePipeline::process_in_map(const RgbdFrame& frame) {
  FrameOutcome outcome;
  outcome.skipped_because = unusable_because(frame, impl_->camera);
  if (!outcome.skipped_because.empty()) return outcome;
  outcome.T_world_camera = *frame.T_world_camera;
  impl_->integrate(frame, outcome);
  return outcome;
}

/// Integrates and meshes with the outcome's pose.
void DensePipeline::Impl::integrate(const RgbdFrame& frame, FrameOutcome& outcome) {
  outcome.scan = integrator.integrate(grid, {frame, outcome.T_world_camera});
  outcome.skipped_because = outcome.scan.nothing_integrated_because;
  outcome.integrated = outcome.skipped_because.empty();
  note(outcome.scan.changed);
  if (!outcome.scan.out_of_memory.empty()) return;
  try {
    mesh_and_pack(outcome);
  } catch (const std::bad_alloc&) {
    outcome.scan.out_of_memory = fmt::format(
        "out of memory: meshing and packing do not fit beside a map of {:.0f} MB and a mesh of {:.0f} MB; "
        "raise tsdf.voxel_size_m = {} or set tsdf.max_map_mb below what is free",
        1e-6 * static_cast<double>(grid.map_bytes()), 1e-6 * static_cast<double>(mesher.bytes()),
        parameters.tsdf.voxel_size_m);
  }
}

MeshUpdateStats DensePipeline::Impl::update_mesh(double budget_ms) {
  MeshUpdateStats stats = mesher.update(grid, budget_ms);
  if (observer) observer->on_mesh(mesher, stats.updated);
  return stats;
}

void DensePipeline::observe_mesh(MeshObserver* observer) {
  impl_->observer = observer;
  if (!observer) return;
  std::vector<VolumeKey> all;
  for (const VolumeMesh* volume : impl_->mesher.volumes()) all.push_back(volume->key());
  observer->on_mesh(impl_->mesher, all);
}

void DensePipeline::Impl::mesh_and_pack(FrameOutcome& outcome) {
  mesher.mark_changed(outcome.scan.changed);
  const ReconstructionParams& params = parameters.reconstruction;
  if (params.live_mesh) {
    const MeshUpdateStats mesh = update_mesh(params.mesh_budget_ms);
    outcome.mesh_ms = mesh.update_ms;
    outcome.volumes_waiting = mesh.volumes_waiting;
  }
  const Stopwatch packing;
  grid.pack_idle();
  outcome.pack_ms = packing.milliseconds();
}

void DensePipeline::replace(std::span<const VolumeKey> keys, const VolumeGrid& from) {
  VolumeGrid& grid = impl_->grid;
  std::vector<ChangedVolume> changed;
  for (const VolumeKey& key : keys) {
    const bool was_there = grid.contains(key);
    if (was_there) grid.release(key);
    const Volume* source = from.find(key);
    Volume* volume = source ? grid.allocate(key) : nullptr;
    if (!volume && !was_there) continue;
    changed.push_back({key, kAllLayers, volume == nullptr});
    if (!volume) continue;
    std::copy_n(source->voxels, kVolumeVoxels, volume->voxels);
    if (source->colors && grid.allocate_colors(*volume))
      std::copy_n(source->colors, kVolumeVoxels, volume->colors);
    grid.set_may_hold_interior(key, from.may_hold_interior(key));
  }
  impl_->note(changed);
  impl_->mesher.mark_changed(changed);
}

void DensePipeline::swap_grid(VolumeGrid& other) {
  HM_CHECK(!impl_->grid.snapshot_under_way(), "the map is being saved");
  std::swap(impl_->grid, other);
  if (impl_->change_sink)
    for (const VolumeGrid* grid : {&other, &impl_->grid}) impl_->note(all_volumes(*grid));
  impl_->mesher.mark_all(impl_->grid);
}

TriangleMesh DensePipeline::finished_mesh() {
  impl_->update_mesh();
  if (impl_->observer) impl_->observer->on_mesh_complete(impl_->mesher);
  return clean_mesh(impl_->mesher.whole_mesh(), impl_->parameters.mesh);
}

TriangleMesh DensePipeline::take_finished_mesh() {
  impl_->update_mesh();
  if (impl_->observer) impl_->observer->on_mesh_complete(impl_->mesher);
  impl_->grid = Integrator::make_grid(impl_->parameters.tsdf);
  trim_memory();
  TriangleMesh whole = impl_->mesher.whole_mesh();
  impl_->mesher = IncrementalMesher(impl_->parameters.mesh, impl_->loop);
  trim_memory();
  return clean_mesh(std::move(whole), impl_->parameters.mesh);
}

}  // namespace hm
