#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mapping/mapping_params.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/alignment/dense_alignment.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"

namespace hm {

class IncrementalMesher;
class MeshObserver;
class ParallelLoop;
class VolumeGrid;

/// Reason why a frame without a pose is not in the map.
inline constexpr std::string_view kNoPose = "no pose";

/// Result of processing one frame.
struct FrameOutcome {
  bool integrated = false;
  std::string skipped_because;               ///< reason, if not integrated
  SE3 T_world_camera;                        ///< pose used for integration
  std::optional<AlignmentResult> alignment;  ///< set if the pose was aligned
  ScanStats scan;
  double mesh_ms = 0;
  double pack_ms = 0;               ///< for packing idle volumes
  std::size_t volumes_waiting = 0;  ///< queued for meshing
};

/// Dense reconstruction in memory (dissertation ch. 4): integrates frames with poses into a volume grid and
/// its mesh. Not thread safe; computes on `threads` threads, with bit-identical results for any number.
///
/// Memory per volume of 8 x 8 x 8 voxels: 2 kB, 4 kB with colours, 1.7 kB packed, plus its mesh (live_mesh);
/// tsdf.max_map_mb limits the volumes. Query and save the grid with map_query.hpp.
class DensePipeline {
 public:
  /// `camera`: of depth and colour, without lens distortion. The parameters must be within their ranges and
  /// pass check_params() (tsdf_params.hpp); `threads` is at least 1.
  DensePipeline(const DenseParams& parameters, const PinholeCamera& camera, int threads);
  ~DensePipeline();
  DensePipeline(const DensePipeline&) = delete;
  DensePipeline& operator=(const DensePipeline&) = delete;

  /// At least 1, from now on.
  void set_threads(int threads);
  /// Continues with a loaded grid, whose voxel and unit sizes must be those of the parameters.
  void adopt(VolumeGrid grid);

  /// Integrates a frame (4.3) and, with live_mesh, meshes the changes within the budget. Depth and colour are
  /// of the camera's size, p_world = T_world_camera * p_camera; with reconstruction.align the pose is
  /// corrected first (4.2.8; T_map_input()). A frame without a pose, with a pose that is not rigid or finite,
  /// with images of the wrong size, or without a reading in range is skipped, with the reason. After a result
  /// with scan.out_of_memory set, process no more frames.
  FrameOutcome process(const RgbdFrame& frame);
  /// The same for a frame with its pose in the map frame, without alignment.
  FrameOutcome process_in_map(const RgbdFrame& frame);

  // ---- exchange with a rebuilt map (MapRebuild) ----
  /// Replaces these volumes by those of another grid; volumes that it does not have are released.
  void replace(std::span<const VolumeKey> keys, const VolumeGrid& from);
  /// Exchanges the whole grid. The old mesh is kept until the new one has been computed, as after process().
  void swap_grid(VolumeGrid& other);

  /// Receiver of every volume that changes from here on, called by the functions that change the grid: to
  /// keep a saved map up to date (MapSaver::note). An empty one ends it.
  using ChangeSink = std::function<void(std::span<const ChangedVolume> changed)>;
  void set_change_sink(ChangeSink sink);

  /// Transform from the frame of the input poses to the map, as estimated by alignment so far
  /// (TrajectoryAligner::T_map_odom).
  [[nodiscard]] const SE3& T_map_input() const;
  /// Sets this transform when a map is resumed, or after a loop closure.
  void set_T_map_input(const SE3& T_map_input);

  /// From here on the observer sees every change of the mesh, and first the mesh as it is. Null: nobody. It
  /// must outlive the pipeline.
  void observe_mesh(MeshObserver* observer);

  /// Meshes all pending changes and returns the whole mesh, with small pieces removed and simplified as set
  /// in the parameters.
  TriangleMesh finished_mesh();
  /// The same at the end of a run: releases the grid's memory before building the whole mesh, to limit the
  /// peak memory. The grid is empty afterwards.
  TriangleMesh take_finished_mesh();

  [[nodiscard]] const VolumeGrid& grid() const;
  /// Grid for saving (MapSaver); do not change its contents.
  [[nodiscard]] VolumeGrid& grid();
  [[nodiscard]] const IncrementalMesher& mesher() const;
  [[nodiscard]] const ParallelLoop& loop() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
