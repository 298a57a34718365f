#pragma once
#include <memory>
#include <span>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/mapping_params.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/mvog/mvog_params.hpp"
#include "hm/slam/rgbd/corrected_keyframes.hpp"

namespace hm {

/// Coloured 3D points of one depth image, in the map frame.
struct ColoredPoints {
  Vec3 p_map_origin = Vec3::Zero();
  std::vector<Eigen::Vector3f> p_map;
  std::vector<Rgb8> colors;
};

struct KeyframePointParams {
  int stride_px = 1;
  double max_depth_m = 4.0;
  double max_sigma_m = 0.05;  ///< readings with a larger standard deviation (Gaussian mixture) are skipped
  double top_m = 0;           ///< points above this height (along `up`) are skipped; 0: no limit
  Vec3 up = Vec3::UnitZ();
  DepthNoise noise;
};

/// Converts the sufficiently certain readings of a frame to points (dissertation 3.4). The frame must have a
/// pose; without colour the points are grey.
ColoredPoints keyframe_points(const RgbdFrame& frame, const PinholeCamera& camera,
                              const KeyframePointParams& params);

/// Coloured point map: one point per voxel, the mean of all points in it.
class PointMap {
 public:
  explicit PointMap(double voxel_m);
  ~PointMap();
  PointMap(PointMap&&) noexcept;
  PointMap& operator=(PointMap&&) noexcept;
  void add(const ColoredPoints& points);
  [[nodiscard]] std::size_t size() const;
  /// Points as vertices of a mesh without triangles, sorted by z, y, x.
  [[nodiscard]] TriangleMesh points() const;
  /// Mean colour of the voxel that contains a point; `otherwise` if it is empty.
  [[nodiscard]] Rgb8 color_at(const Eigen::Vector3f& p_map, Rgb8 otherwise) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Maps built from the keyframes' images.
struct KeyframeMaps {
  std::unique_ptr<PointMap> points;            ///< voxels of slam.points_voxel_m
  std::unique_ptr<PointMap> colors;            ///< colours of the cells of the occupancy map
  std::unique_ptr<MultiVolumeGrid> occupancy;  ///< resolution slam.octomap_resolution_m
  std::unique_ptr<MultiVolumeGrid> volumes;    ///< parameters of section mvog
  std::size_t keyframes = 0, unreadable = 0;
};

struct KeyframeMapParams {
  SlamParams slam;  ///< kinds of maps, depth limits, resolutions
  MvogParams mvog;
  DepthNoise depth_noise;
  double max_depth_sigma_m = 0.05;  ///< see KeyframePointParams
  Vec3 up = Vec3::UnitZ();
};

/// Reads the keyframes of the first map again and builds the maps listed in slam.maps; if stopped early, from
/// the keyframes read so far.
KeyframeMaps make_keyframe_maps(const FrameSource& frames, const CorrectedKeyframes& keyframes,
                                const KeyframeMapParams& params, const RunContext& run);

/// Colours of the occupancy map's voxels: white unless occupied, as in OctoMap.
std::vector<Rgb8> voxel_colors(const KeyframeMaps& maps, std::span<const OccupancyVoxel> voxels);

}  // namespace hm
