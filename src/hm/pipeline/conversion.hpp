#pragma once
#include <filesystem>
#include <string>

#include "hm/core/progress.hpp"
#include "hm/core/result.hpp"
#include "hm/io/recording.hpp"
#include "hm/mesh/mesh_params.hpp"

namespace hm {

/// What is converted into what; the kinds are told from the paths.
struct ConversionOptions {
  std::filesystem::path from, to;
  MeshParams mesh;  ///< for maps and meshes: pieces to remove, simplification
  RecordingOptions recording_options;
  int threads = 1;
  std::string program_version;
  ProgressSink progress;
};

/// What a conversion did, in one line ("map -> mesh: 1,234 triangles").
struct ConversionSummary {
  std::string text;
  std::size_t items = 0;    ///< triangles, poses or frames
  std::size_t skipped = 0;  ///< frames of a recording that could not be read
};

/// mesh -> mesh (.ply .obj .glb), map (.hmap) -> mesh, trajectory (TUM, EuRoC, KITTI) -> .tum .txt .kitti,
/// recording (a folder) -> TUM recording (a folder). Distortion is removed from a recording's pictures.
Result<ConversionSummary> convert(const ConversionOptions& options);

}  // namespace hm
