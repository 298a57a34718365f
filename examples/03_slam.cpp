// How do frames without poses become a map that stays right when a loop closes?
#include <cstdio>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/rgbd/slam_pipeline.hpp"

int main(int argc, char** argv) {
  const auto recording = hm::open_recording(argc > 1 ? argv[1] : "recording");
  if (!recording) {
    std::printf("%s\n", hm::to_string(recording.error()).c_str());
    return 1;
  }
  // A live camera: the pipeline keeps every second frame, compressed, for when a loop moves it. A recording,
  // or your own store, can give frames again instead: input.frames = recording->get().
  hm::SlamInput input{(*recording)->camera()};
  input.max_kept_bytes = 500'000'000;
  auto slam = hm::SlamPipeline::create(input, {"tsdf.voxel_size_m=0.04", "slam.map_stride=2"});
  if (!slam) {
    std::printf("%s\n", hm::to_string(slam.error()).c_str());
    return 1;
  }
  for (std::size_t i = 0; i < (*recording)->info().frame_count; ++i) {
    auto frame = (*recording)->read(i);
    if (!frame) continue;
    const hm::SlamStep step = slam->add(std::move(*frame));
    if (!step.T_map_camera) std::printf("frame %zu: no pose: %s\n", i, step.reason.c_str());
    if (step.keyframe && step.T_map_camera)
      std::printf("frame %2zu is a keyframe, %.2f m from the start\n", i,
                  step.T_map_camera->translation().norm());
  }
  // Closes the last loops, brings the map to the final poses.
  if (const auto finished = slam->finish(); !finished) {
    std::printf("%s\n", hm::to_string(finished.error()).c_str());
    return 1;
  }
  const hm::SlamCounts counts = slam->counts();
  const hm::TriangleMesh mesh = slam->mesh();
  std::printf("%zu of %zu frames tracked, %zu keyframes, %zu loops, %zu triangles; %.1f MB of frames kept\n",
              counts.frames_tracked, counts.frames, counts.keyframes, counts.loops, mesh.triangles.size(),
              static_cast<double>(counts.kept_bytes) * 1e-6);
  if (!hm::write_tum_trajectory("slam.tum", slam->trajectory()) || !hm::write_mesh("slam.ply", mesh))
    return 1;
  return counts.frames_tracked * 10 >= counts.frames * 9 && !mesh.triangles.empty() ? 0 : 1;
}
