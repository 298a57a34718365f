// How far is a point from the nearest surface? Save a map, load it, and query distance, gradient and colour.
#include <cstdio>
#include <vector>

#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/mapping/map_query.hpp"

int main(int argc, char** argv) {
  const auto recording = hm::open_recording(argc > 1 ? argv[1] : "recording");
  if (!recording) return 1;
  hm::DensePipeline pipeline(hm::DenseParams(), (*recording)->camera(), 1);
  const auto first = (*recording)->read(0);
  if (!first || !pipeline.process(*first).integrated) return 1;
  if (const auto saved = hm::save_map("example.hmap", pipeline.grid()); !saved) {
    std::printf("%s\n", hm::to_string(saved.error()).c_str());
    return 1;
  }

  const auto map = hm::MapQuery::open("example.hmap");  // MapQuery(pipeline.grid()) queries the live map
  if (!map) return 1;
  const hm::Vec3 size = map->bounds().sizes();
  std::printf("example.hmap: %zu blocks in %.1f x %.1f x %.1f m\n", map->volume_count(), size.x(), size.y(),
              size.z());

  // Along the ray of the middle pixel: positive in front of the surface, negative behind it.
  const int x = first->depth.width() / 2, y = first->depth.height() / 2;
  std::vector<hm::Vec3> points;
  for (const double offset_m : {-0.04, -0.02, 0.0, 0.02, 0.04, 1.0})
    points.push_back(*first->T_world_camera *
                     (*recording)->camera().unproject({x, y}, first->depth.depth_m(x, y) + offset_m));
  std::vector<hm::GridSample> samples(points.size());
  map->at(points, samples);
  int known = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const hm::GridSample& sample = samples[i];
    if (!sample.known) {
      std::printf("(%.2f %.2f %.2f): unknown, the camera did not see it\n", points[i].x(), points[i].y(),
                  points[i].z());
      continue;
    }
    ++known;
    const hm::Rgb8 color = sample.color.value_or(hm::Rgb8{});
    std::printf("(%.2f %.2f %.2f): distance %+.3f m, away from it is (%.2f %.2f %.2f), colour %d %d %d\n",
                points[i].x(), points[i].y(), points[i].z(), sample.distance_m, sample.gradient.x(),
                sample.gradient.y(), sample.gradient.z(), color.r, color.g, color.b);
  }
  // A part of a map needs only its own memory.
  hm::Box3 west = map->bounds();
  west.max().x() = west.center().x();
  const auto half = hm::MapQuery::open("example.hmap", west);
  if (!half) return 1;
  std::printf("its western half: %zu blocks\n", half->volume_count());
  return known >= 3 && !samples.back().known && half->volume_count() < map->volume_count() ? 0 : 1;
}
