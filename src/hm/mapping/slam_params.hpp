#pragma once
#include <string>

#include "hm/core/params.hpp"

namespace hm {

/// How a recording is run through the whole RGB-D system; what is computed is said by the other sections.
struct SlamParams {
  bool start_at_pose = true;
  int map_stride = 1;
  double rebuild_shift_voxel = 0.25;
  bool rebuild_online = true;
  bool align = false;
  int align_memory_frames = 300;
  bool matrices = true;
  std::string maps;
  double map_depth_m = 4.0;
  double map_top_m = 0;
  double points_voxel_m = 0.01;
  double octomap_resolution_m = 0.05;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(
        ParamDoc{
            "start_at_pose",
            {},
            "begin at the recording's pose of the first frame, where it has one; else level at the origin"},
        self.start_at_pose);
    v(ParamDoc{"map_stride", {1, 1000}, "every n-th frame with a pose goes into the dense map"},
      self.map_stride);
    v(ParamDoc{"rebuild_shift_voxel",
               {0, 100},
               "what frames saw is rebuilt when loops move them by more than this, measured at 3 m"},
      self.rebuild_shift_voxel);
    v(
        ParamDoc{
            "rebuild_online",
            {},
            "bring the map to corrected poses while tracking, on a thread of its own; else at the end only"},
        self.rebuild_online);
    v(
        ParamDoc{
            "align", {}, "correct odometry's poses by aligning depth pictures to what was seen just before"},
        self.align);
    v(
        ParamDoc{
            "align_memory_frames", {0, 1e6}, "what was seen so many frames ago is forgotten; 0: nothing is"},
        self.align_memory_frames);
    v(ParamDoc{"matrices", {}, "draw the matrices of place recognition"}, self.matrices);
    v(
        ParamDoc{
            "maps", {}, "maps to write besides the mesh: any of points, octomap, mvog, with commas between"},
        self.maps);
    v(ParamDoc{"map_depth_m", {0.1, 100}, "readings beyond do not go into these maps"}, self.map_depth_m);
    v(ParamDoc{"map_top_m",
               {-1000, 1000},
               "these maps end at this height, to cut ceilings away; 0: they do not"},
      self.map_top_m);
    v(ParamDoc{"points_voxel_m", {0.001, 1}, "spacing of the points of the coloured point map"},
      self.points_voxel_m);
    v(ParamDoc{"octomap_resolution_m", {0.005, 1}, "edge of a cell of the occupancy map"},
      self.octomap_resolution_m);
  }
};

}  // namespace hm
