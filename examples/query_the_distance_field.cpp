// How far is a point from the nearest surface, and in which direction (for planning, collision checks)?
#include <cstdio>

#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/dense_pipeline.hpp"

int main(int argc, char** argv) {
  const auto recording = hm::open_recording(argc > 1 ? argv[1] : "recording");
  if (!recording) return 1;
  const hm::RecordingInfo& info = (*recording)->info();
  hm::DensePipeline pipeline(hm::DenseParams(), info.camera.without_distortion(), hm::available_threads());
  const auto first = (*recording)->read(0);
  if (!first || !pipeline.process(*first).integrated) return 1;

  // Along the ray of the middle pixel: positive in front of the surface, negative behind it.
  const int x = first->depth.width() / 2, y = first->depth.height() / 2;
  const double depth_m = first->depth.depth_m(x, y);
  int known = 0;
  for (const double offset_m : {-0.04, -0.02, 0.0, 0.02, 0.04, 1.0}) {
    const hm::Vec3 p_camera = info.camera.without_distortion().unproject({x, y}, depth_m + offset_m);
    if (const auto sample = pipeline.grid().sample(*first->T_world_camera * p_camera)) {
      std::printf("%+.2f m behind the reading: distance %+.3f m, gradient (%.2f %.2f %.2f)\n", offset_m,
                  sample->distance_m, sample->gradient.x(), sample->gradient.y(), sample->gradient.z());
      ++known;
    } else {
      std::printf("%+.2f m behind the reading: unknown, the sensor did not see it\n", offset_m);
    }
  }
  return known >= 3 && known < 6 ? 0 : 1;
}
