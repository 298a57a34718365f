#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/run_context.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/mesh/mesh_params.hpp"
#include "hm/pipeline/common/mvog_file.hpp"

namespace hm {

/// Input and output of a conversion; their kinds follow from the paths.
struct ConversionOptions {
  std::filesystem::path from, to;
  MeshParams mesh;    ///< for maps and meshes: pieces to remove, simplification
  SliceParams slice;  ///< for occupancy grids as pgm: the heights of the slice
  RecordingOptions recording_options;
  RunContext run;  ///< its stop is not looked at
};

/// Result of a conversion.
struct ConversionSummary {
  std::string text;         ///< in words: "1234 vertices, 2345 triangles"
  std::size_t items = 0;    ///< triangles, poses or frames
  std::size_t skipped = 0;  ///< frames of a recording that could not be read
  std::vector<std::string> warnings = {};
  std::vector<std::filesystem::path> outputs = {};  ///< where they are others than ConversionOptions::to
};

/// mesh -> mesh (written as .ply .obj .glb), map (.hmap) -> mesh, occupancy grid (.mvog) -> OctoMap (.ot
/// .bt), points of the occupied cells (.ply) or map_server's pair of a slice (.yaml, .yml or .pgm: both
/// files), trajectory (TUM, EuRoC, KITTI) -> .tum .txt .kitti, recording (a folder) -> TUM recording (a
/// folder). Distortion is removed from a recording's images. Errors: input that cannot be read, a name that
/// what was read cannot become (kUsage), a failure to write (kInternal).
Result<ConversionSummary> convert(const ConversionOptions& options);

}  // namespace hm
