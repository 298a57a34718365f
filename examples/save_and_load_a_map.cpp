// How do I keep a map, and open it (or a part of it) later?
#include <cstdio>

#include "hm/io/rgbd/recording.hpp"
#include "hm/mesh/whole_mesh.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/mapping/map_store.hpp"

int main(int argc, char** argv) {
  const auto recording = hm::open_recording(argc > 1 ? argv[1] : "recording");
  if (!recording) return 1;
  hm::DensePipeline pipeline(hm::DenseParams(), (*recording)->info().camera.without_distortion(), 1);

  hm::MapHeader header;
  header.voxel_size_m = pipeline.grid().voxel_size_m();
  header.sdf_unit_m = pipeline.grid().sdf_unit_m();
  header.program_version = "an example";
  auto file = hm::MapFile::create("example.hmap", header);
  if (!file) return 1;
  hm::MapSaver saver(std::move(*file));
  for (std::size_t i = 0; i < 3; ++i) {
    const auto frame = (*recording)->read(i);
    if (!frame) return 1;
    saver.note(pipeline.process(*frame).scan.changed);
    if (!saver.save(pipeline.grid(), header)) return 1;  // writes only what changed; safe against a kill
  }

  const auto map = hm::MapFile::open("example.hmap", hm::MapOpenMode::kRead);
  if (!map) return 1;
  const auto grid = hm::load_grid(*map);
  if (!grid) return 1;
  const hm::ParallelLoop loop;
  const auto saved = hm::extract_mesh(pipeline.grid(), {}, loop), loaded = hm::extract_mesh(*grid, {}, loop);

  hm::MapLoadOptions half;
  half.region = pipeline.grid().bounds();
  half.region->max().x() = half.region->center().x();
  const auto part = hm::load_grid(*map, half);
  if (!part) return 1;
  std::printf("%zu triangles saved, %zu loaded; %zu of %zu volumes in the western half\n",
              saved.triangles.size(), loaded.triangles.size(), part->volume_count(), grid->volume_count());
  return saved.vertices == loaded.vertices && part->volume_count() < grid->volume_count() ? 0 : 1;
}
