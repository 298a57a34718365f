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

/// Points of one depth image in space, with what they look like.
struct ColoredPoints {
  Vec3 p_map_origin = Vec3::Zero();
  std::vector<Eigen::Vector3f> p_map;
  std::vector<Rgb8> colors;
};

struct KeyframePointParams {
  int stride_px = 1;
  double max_depth_m = 4.0;
  double max_sigma_m = 0.05;  ///< readings less certain by the Gaussian mixture of their window are left out
  double top_m = 0;           ///< points above are left out; 0: none
  DepthNoise noise;
};

/// The readings of a frame that are certain enough, at its pose (dissertation 3.4). The frame has a pose; one
/// without colour gives grey points.
ColoredPoints keyframe_points(const RgbdFrame& frame, const PinholeCamera& camera,
                              const KeyframePointParams& params);

/// A coloured point map: one point in each cell of a voxel grid, the mean of what fell into it.
class PointMap {
 public:
  explicit PointMap(double voxel_m);
  ~PointMap();
  PointMap(PointMap&&) noexcept;
  PointMap& operator=(PointMap&&) noexcept;
  void add(const ColoredPoints& points);
  [[nodiscard]] std::size_t size() const;
  /// The points as vertices of a mesh without triangles, in the order of z, y, x.
  [[nodiscard]] TriangleMesh points() const;
  /// The mean colour of the cell that holds a point; `otherwise` where it is empty.
  [[nodiscard]] Rgb8 color_at(const Eigen::Vector3f& p_map, Rgb8 otherwise) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Maps made of the keyframes' images.
struct KeyframeMaps {
  std::unique_ptr<PointMap> points;            ///< slam.points_voxel_m
  std::unique_ptr<PointMap> colors;            ///< cells of the occupancy map
  std::unique_ptr<MultiVolumeGrid> occupancy;  ///< slam.octomap_resolution_m
  std::unique_ptr<MultiVolumeGrid> volumes;    ///< by section mvog
  std::size_t keyframes = 0, unreadable = 0;
};

struct KeyframeMapParams {
  SlamParams slam;  ///< which maps, how far and how fine
  MvogParams mvog;
  DepthNoise depth_noise;
  double max_depth_sigma_m = 0.05;  ///< see KeyframePointParams
};

/// Reads the keyframes of the first map again and makes the maps that slam.maps names; stopped early, of
/// those read so far.
KeyframeMaps make_keyframe_maps(const Recording& recording, const CorrectedKeyframes& keyframes,
                                const KeyframeMapParams& params, const RunContext& run);

/// Colours of the occupancy map's voxels: white unless it is occupied, as OctoMap has it.
std::vector<Rgb8> voxel_colors(const KeyframeMaps& maps, std::span<const OccupancyVoxel> voxels);

}  // namespace hm
