#pragma once
#include <string>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/mesh/mesh_params.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/tsdf/alignment/alignment_params.hpp"
#include "hm/tsdf/tsdf_params.hpp"

namespace hm {

/// Settings of a run of the dense pipeline; the other sections determine the computation.
struct ReconstructionParams {
  int begin_frame = 0;
  int frame_limit = 0;
  int frame_stride = 1;
  /// Number of frames decoded ahead.
  int prefetch_frames = 4;
  bool register_color = true;
  bool align = false;
  bool level = false;
  bool live_mesh = true;
  double mesh_budget_ms = 15.0;
  double save_interval_s = 20.0;
  int save_interval_frames = 0;
  std::string mesh_formats = "ply,glb";
  bool pictures = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"begin_frame", {0, 1e9}, "first frame of the recording to use", ParamLevel::kBasic},
      self.begin_frame);
    v(ParamDoc{"frame_limit", {0, 1e9}, "maximum number of frames; 0: all", ParamLevel::kBasic},
      self.frame_limit);
    v(ParamDoc{"frame_stride", {1, 1e6}, "use every n-th frame", ParamLevel::kBasic}, self.frame_stride);
    v(ParamDoc{"register_color",
               {},
               "register colour images to depth where they are not and the images show how"},
      self.register_color);
    v(ParamDoc{"align",
               {},
               "correct each given pose by aligning its depth image to the map",
               ParamLevel::kBasic},
      self.align);
    v(ParamDoc{"level",
               {},
               "rotate the given poses so that z is up, by gravity, else floor and walls",
               ParamLevel::kBasic},
      self.level);
    v(ParamDoc{"live_mesh",
               {},
               "update the mesh while scanning; it is complete at the end in any case",
               ParamLevel::kBasic},
      self.live_mesh);
    v(ParamDoc{"mesh_budget_ms",
               {0, 1e6},
               "time limit for meshing after each frame; 0: none",
               ParamLevel::kBasic},
      self.mesh_budget_ms);
    v(ParamDoc{"save_interval_s", {0, 1e6}, "interval of saving the map during the run; 0: only at the end"},
      self.save_interval_s);
    v(ParamDoc{"save_interval_frames", {0, 1e9}, "interval of saving the map in frames; 0: none"},
      self.save_interval_frames);
    v(ParamDoc{"mesh_formats",
               {},
               "mesh files to write, separated by commas: ply, glb, obj",
               ParamLevel::kBasic},
      self.mesh_formats);
    v(ParamDoc{"pictures", {}, "draw figures of the result for the report", ParamLevel::kBasic},
      self.pictures);
  }
};

/// Settings of a run of the whole RGB-D system; the other sections determine the computation.
struct SlamParams {
  bool start_at_pose = true;
  bool level = true;
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
    v(ParamDoc{"start_at_pose",
               {},
               "start at the recording's pose of the first frame, if any; else level at the origin"},
      self.start_at_pose);
    v(ParamDoc{"level",
               {},
               "rotate the map so that z is up, unless its frame is given: by gravity, else floor and walls",
               ParamLevel::kBasic},
      self.level);
    v(ParamDoc{"map_stride",
               {1, 1000},
               "integrate every n-th frame with a pose into the dense map",
               ParamLevel::kBasic},
      self.map_stride);
    v(ParamDoc{"rebuild_shift_voxel",
               {0, 100},
               "the map is rebuilt where loops move frames by more than this, measured at 3 m; smaller "
               "corrects more often"},
      self.rebuild_shift_voxel);
    v(ParamDoc{"rebuild_online",
               {},
               "correct the map while tracking, on a separate thread; else only at the end",
               ParamLevel::kBasic},
      self.rebuild_online);
    v(
        ParamDoc{
            "align", {}, "correct odometry's poses by aligning depth images to a map of the recent frames"},
        self.align);
    v(ParamDoc{"align_memory_frames",
               {0, 1e6},
               "length of that map in frames; older volumes are dropped; 0: never"},
      self.align_memory_frames);
    v(ParamDoc{"matrices", {}, "draw the matrices of place recognition for the report"}, self.matrices);
    v(ParamDoc{"maps",
               {},
               "maps to write besides the mesh, separated by commas: points, octomap, mvog",
               ParamLevel::kBasic},
      self.maps);
    v(ParamDoc{"map_depth_m",
               {0.1, 100},
               "readings beyond this are not inserted into these maps",
               ParamLevel::kBasic},
      self.map_depth_m);
    v(ParamDoc{"map_top_m",
               {-1000, 1000},
               "upper end of these maps, to remove ceilings; 0: none",
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

/// Parameters of building a map and a mesh from frames with poses.
struct DenseParams {
  TsdfParams tsdf;
  DepthNoise depth_noise;
  AlignmentParams alignment;
  MeshParams mesh;
  ReconstructionParams reconstruction;
};

/// The same for a map whose poses change by loop closures.
struct MappingParams : DenseParams {
  SlamParams slam;
};

/// Parses ReconstructionParams::mesh_formats; the error names an unknown format.
Result<std::vector<std::string>> mesh_formats(const ReconstructionParams& params);
/// Parses SlamParams::maps; the error names an unknown kind.
Result<std::vector<std::string>> map_kinds(const SlamParams& params);

}  // namespace hm
