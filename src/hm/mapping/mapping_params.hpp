#pragma once
#include <string>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/mesh/mesh_params.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/tsdf/alignment/alignment_params.hpp"
#include "hm/tsdf/projection/tsdf_params.hpp"

namespace hm {

/// Settings of a run through the dense pipeline; the other sections decide what is computed.
struct ReconstructionParams {
  int begin_frame = 0;
  int frame_limit = 0;
  int frame_stride = 1;
  /// Images decoded ahead.
  int prefetch_frames = 4;
  bool align = false;
  bool live_mesh = true;
  double mesh_budget_ms = 15.0;
  double save_interval_s = 20.0;
  int save_interval_frames = 0;
  std::string mesh_formats = "ply,glb";
  bool pictures = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"begin_frame", {0, 1e9}, "first frame of the recording that is used", ParamLevel::kBasic},
      self.begin_frame);
    v(ParamDoc{"frame_limit", {0, 1e9}, "frames at most; 0 for all", ParamLevel::kBasic}, self.frame_limit);
    v(ParamDoc{"frame_stride", {1, 1e6}, "use every n-th frame", ParamLevel::kBasic}, self.frame_stride);
    v(ParamDoc{"align",
               {},
               "correct each given pose by aligning its depth image to the map",
               ParamLevel::kBasic},
      self.align);
    v(ParamDoc{"live_mesh",
               {},
               "keep the mesh up to date while scanning; it is complete at the end in any case",
               ParamLevel::kBasic},
      self.live_mesh);
    v(ParamDoc{"mesh_budget_ms",
               {0, 1e6},
               "time for meshing after each frame; 0 for as long as it takes",
               ParamLevel::kBasic},
      self.mesh_budget_ms);
    v(
        ParamDoc{
            "save_interval_s", {0, 1e6}, "the map is saved this often while running; 0 for only at the end"},
        self.save_interval_s);
    v(ParamDoc{"save_interval_frames", {0, 1e9}, "and after every so many frames; 0 for not"},
      self.save_interval_frames);
    v(ParamDoc{"mesh_formats",
               {},
               "mesh files to write: any of ply, glb, obj, with commas between",
               ParamLevel::kBasic},
      self.mesh_formats);
    v(ParamDoc{"pictures", {}, "draw figures of the result for the report", ParamLevel::kBasic},
      self.pictures);
  }
};

/// Settings of a run through the whole RGB-D system; the other sections decide what is computed.
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
    v(ParamDoc{"map_stride",
               {1, 1000},
               "every n-th frame with a pose goes into the dense map",
               ParamLevel::kBasic},
      self.map_stride);
    v(ParamDoc{"rebuild_shift_voxel",
               {0, 100},
               "what frames saw is rebuilt when loops move them by more than this, measured at 3 m"},
      self.rebuild_shift_voxel);
    v(
        ParamDoc{
            "rebuild_online",
            {},
            "bring the map to corrected poses while tracking, on a thread of its own; else at the end only",
            ParamLevel::kBasic},
        self.rebuild_online);
    v(ParamDoc{"align", {}, "correct odometry's poses by aligning depth images to what was seen just before"},
      self.align);
    v(
        ParamDoc{
            "align_memory_frames", {0, 1e6}, "what was seen so many frames ago is forgotten; 0: nothing is"},
        self.align_memory_frames);
    v(ParamDoc{"matrices", {}, "draw the matrices of place recognition"}, self.matrices);
    v(ParamDoc{"maps",
               {},
               "maps to write besides the mesh: any of points, octomap, mvog, with commas between",
               ParamLevel::kBasic},
      self.maps);
    v(ParamDoc{"map_depth_m", {0.1, 100}, "readings beyond do not go into these maps", ParamLevel::kBasic},
      self.map_depth_m);
    v(ParamDoc{"map_top_m",
               {-1000, 1000},
               "these maps end at this height, to cut ceilings away; 0: they do not",
               ParamLevel::kBasic},
      self.map_top_m);
    v(ParamDoc{"points_voxel_m",
               {0.001, 1},
               "spacing of the points of the coloured point map",
               ParamLevel::kBasic},
      self.points_voxel_m);
    v(ParamDoc{"octomap_resolution_m", {0.005, 1}, "edge of a cell of the occupancy map", ParamLevel::kBasic},
      self.octomap_resolution_m);
  }
};

/// Parameters by which frames with poses become a map and a mesh.
struct DenseParams {
  TsdfParams tsdf;
  DepthNoise depth_noise;
  AlignmentParams alignment;
  MeshParams mesh;
  ReconstructionParams reconstruction;
};

/// Parameters of a dense map whose poses change when loops are closed.
struct MappingParams : DenseParams {
  SlamParams slam;
};

/// The formats named in ReconstructionParams::mesh_formats; an error names an unknown one.
Result<std::vector<std::string>> mesh_formats(const ReconstructionParams& params);
/// The maps named in SlamParams::maps; an error names an unknown one.
Result<std::vector<std::string>> map_kinds(const SlamParams& params);

}  // namespace hm
