// How do depth images with poses become a coloured mesh?
#include <cstdio>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/dense_pipeline.hpp"

int main(int argc, char** argv) {
  // Frames come from your sensor; here they are read from a folder (TUM RGB-D, 7-Scenes, ICL-NUIM).
  const auto recording = hm::open_recording(argc > 1 ? argv[1] : "recording");
  if (!recording) {
    std::printf("%s\n", hm::to_string(recording.error()).c_str());
    return 1;
  }
  hm::DenseParams params;
  params.tsdf.voxel_size_m = 0.03;  // all parameters: docs/parameters.md
  hm::DensePipeline pipeline(params, (*recording)->camera(), /*threads=*/2);

  std::size_t integrated = 0;
  for (std::size_t i = 0; i < (*recording)->info().frame_count; ++i) {
    const auto frame =
        (*recording)->read(i);  // depth, colour, and T_world_camera: p_world = T_world_camera * p_camera
    if (!frame) {               // one bad picture is no reason to stop
      std::printf("left out: %s\n", hm::to_string(frame.error()).c_str());
      continue;
    }
    const hm::FrameOutcome outcome = pipeline.process(*frame);
    if (!outcome.integrated) std::printf("frame %zu left out: %s\n", i, outcome.skipped_because.c_str());
    integrated += outcome.integrated ? 1 : 0;
  }
  const hm::TriangleMesh mesh = pipeline.finished_mesh();
  if (const auto written = hm::write_mesh("mesh.ply", mesh); !written) {
    std::printf("%s\n", hm::to_string(written.error()).c_str());
    return 1;
  }
  std::printf("mesh.ply: %zu triangles, %.1f m2 of surface, from %zu frames\n", mesh.triangles.size(),
              hm::surface_area(mesh), integrated);
  return hm::surface_area(mesh) > 5 ? 0 : 1;
}
