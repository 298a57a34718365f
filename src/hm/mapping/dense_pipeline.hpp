#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mapping/mapping_params.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/alignment/dense_alignment.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"

namespace hm {

class IncrementalMesher;
class ParallelLoop;
class VolumeGrid;

/// Outcome of one frame.
struct FrameOutcome {
  bool integrated = false;
  std::string skipped_because;               ///< in words, when it was not integrated
  SE3 T_world_camera;                        ///< with which it was integrated
  std::optional<AlignmentResult> alignment;  ///< nothing where poses are taken as given
  ScanStats scan;
  double mesh_ms = 0;
  double pack_ms = 0;               ///< packing volumes that are out of sight
  std::size_t volumes_waiting = 0;  ///< for meshing
};

/// The dense system in memory (dissertation ch. 4): frames with poses in, a volume grid and its mesh out.
/// One thread calls it; it computes on `threads` threads, with the same bits for any number of them.
///
/// Memory: 2 kB a volume of 8 x 8 x 8 voxels, 4 kB with colours, 1.7 kB out of sight, and the mesh of each
/// (live_mesh); tsdf.max_map_mb caps the volumes. Query and save the grid with map_query.hpp.
class DensePipeline {
 public:
  /// `camera`: of depth and colour, without lens distortion. The parameters must be within their ranges and
  /// pass check_params() (tsdf_params.hpp); `threads` is at least 1.
  DensePipeline(const DenseParams& parameters, const PinholeCamera& camera, int threads);
  ~DensePipeline();
  DensePipeline(const DensePipeline&) = delete;
  DensePipeline& operator=(const DensePipeline&) = delete;

  /// Goes on with a grid that was loaded. Its voxel and unit sizes must be those of the parameters.
  void adopt(VolumeGrid grid);

  /// Integrates a frame (4.3) and, with live_mesh, meshes what changed within the budget. Depth and colour
  /// are of the camera's size, p_world = T_world_camera * p_camera; with reconstruction.align the pose is
  /// corrected first (4.2.8; T_map_input()). A frame without a pose, with a pose that is not rigid or finite,
  /// with images of the wrong size, or without a reading in range is skipped, with the reason. After an
  /// outcome with scan.out_of_memory no more frames should be given: what the system has is used up.
  FrameOutcome process(const RgbdFrame& frame);
  /// Integrates a frame whose pose is in the map frame already: nothing is aligned. Skips frames as
  /// process().
  FrameOutcome process_in_map(const RgbdFrame& frame);

  // ---- a map that was made again beside this one (MapRebuild) ----
  /// Puts these volumes of another grid in the place of the map's; those that it does not have are released.
  void replace(std::span<const VolumeKey> keys, const VolumeGrid& from);
  /// Exchanges the whole map. The mesh of the old one stays until the new one's is made, as after process().
  void swap_grid(VolumeGrid& other);

  /// Motion from the world of the given poses into the map, as alignment found it so far
  /// (TrajectoryAligner::T_map_odom).
  [[nodiscard]] const SE3& T_map_input() const;
  /// Sets it when a map is resumed, or after a loop was closed.
  void set_T_map_input(const SE3& T_map_input);

  /// The whole mesh, everything that changed meshed, small pieces removed and simplified as the parameters
  /// say.
  TriangleMesh finished_mesh();
  /// finished_mesh() for the end of a run: gives the map's memory back before the whole mesh is made, so that
  /// a house needs no more memory at its end than while it was scanned. The grid is empty afterwards.
  TriangleMesh take_finished_mesh();

  [[nodiscard]] const VolumeGrid& grid() const;
  /// Gives access for saving (MapSaver); only process() changes what is in it.
  [[nodiscard]] VolumeGrid& grid();
  [[nodiscard]] const IncrementalMesher& mesher() const;
  [[nodiscard]] const ParallelLoop& loop() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
