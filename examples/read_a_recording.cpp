// How do I read the frames of a recording (TUM RGB-D, 7-Scenes, ICL-NUIM)?
#include <cstdio>

#include "hm/io/rgbd/recording.hpp"

int main(int argc, char** argv) {
  const auto recording = hm::open_recording(argc > 1 ? argv[1] : "recording");
  if (!recording) {
    std::printf("%s\n", hm::to_string(recording.error()).c_str());
    return 1;
  }
  const hm::RecordingInfo& info = (*recording)->info();
  std::printf("%zu frames, %d x %d\n", info.frame_count, info.camera.width, info.camera.height);

  std::size_t good = 0;
  hm::FramePrefetcher frames(**recording, 0, info.frame_count);  // decodes ahead on another thread
  while (const auto frame = frames.next()) {
    if (!*frame) {  // one bad picture is no reason to stop
      std::printf("skipped: %s\n", hm::to_string(frame->error()).c_str());
      continue;
    }
    const int x = (*frame)->depth.width() / 2, y = (*frame)->depth.height() / 2;
    std::printf("%zu: %.3f s, %.2f m in the middle, %s\n", (*frame)->index, (*frame)->stamp.seconds(),
                (*frame)->depth.depth_m(x, y), (*frame)->T_world_camera ? "with a pose" : "without a pose");
    ++good;
  }
  return good == info.frame_count ? 0 : 1;
}
