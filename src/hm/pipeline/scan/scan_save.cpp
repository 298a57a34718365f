#include "hm/pipeline/scan/scan_save.hpp"

#include <algorithm>
#include <utility>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/mapping/dense_pipeline.hpp"

namespace hm {
namespace {

/// Between two saves: what changes in this time is saved in a tenth of a second.
constexpr double kInterval_s = 5;

}  // namespace

Result<std::unique_ptr<ScanSave>> ScanSave::begin(SlamPipeline& pipeline, ResultFolder& folder,
                                                  const RgbdParameters& parameters,
                                                  const SlamSaveState& state) {
  auto map = as_run_failure(MapFile::create(folder.staging() / "map.hmap",
                                            slam_map_header(parameters, pipeline.dense().grid(), state)));
  if (!map) return forward_error(map);
  return std::unique_ptr<ScanSave>(new ScanSave(pipeline, folder, parameters, state, std::move(*map)));
}

ScanSave::ScanSave(SlamPipeline& pipeline, ResultFolder& folder, const RgbdParameters& parameters,
                   const SlamSaveState& state, MapFile map)
    : pipeline_(pipeline), folder_(folder), parameters_(parameters), state_(state), saver_(std::move(map)) {
  pipeline_.dense().set_change_sink([this](std::span<const ChangedVolume> changed) { saver_.note(changed); });
}

ScanSave::~ScanSave() {
  pipeline_.dense().set_change_sink({});
  (void)saver_.finish_save(pipeline_.dense().grid());
  if (trajectory_.valid()) trajectory_.wait();
}

std::filesystem::path ScanSave::place_of(const char* name) const {
  return (is_published_ ? folder_.path() : folder_.staging()) / name;
}

Result<void> ScanSave::begin_map(std::size_t frames) {
  is_saving_ = true;
  state_.next_frame = frames;
  VolumeGrid& grid = pipeline_.dense().grid();
  const MapHeader header = slam_map_header(parameters_, grid, state_);
  return as_run_failure(saver_.begin_save(grid, [header](const std::set<VolumeKey>&) { return header; }));
}

Result<void> ScanSave::after_frame(std::size_t frames) {
  if (is_saving_) {
    const auto saved = as_run_failure(saver_.continue_save(pipeline_.dense().grid()));
    if (!saved) return saved;
    const bool is_done =
        !saver_.saving() && trajectory_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    return is_done ? finish_save() : Result<void>();
  }
  const double interval_s = std::min(kInterval_s, parameters_.reconstruction.save_interval_s);
  if (interval_s <= 0 || since_save_.seconds() < interval_s) return {};
  Trajectory path = pipeline_.trajectory_now();
  if (path.empty()) return {};
  since_save_.restart();
  trajectory_ = std::async(std::launch::async, [file = place_of("trajectory.tum"), path = std::move(path)] {
    return write_tum_trajectory(file, path);
  });
  return begin_map(frames);
}

/// The first save gets its place in the folder.
Result<void> ScanSave::finish_save() {
  is_saving_ = false;
  if (const auto written = as_run_failure(trajectory_.get()); !written) return written;
  if (is_published_) return {};
  std::vector<std::filesystem::path> files{folder_.staging() / "map.hmap",
                                           folder_.staging() / "trajectory.tum",
                                           folder_.staging() / "parameters.toml"};
  const auto written = as_run_failure(write_file_text(files.back(), list_slam(parameters_).to_toml()));
  if (!written) return written;
  is_published_ = true;
  return saver_.move_file(folder_.path() / "map.hmap",
                          [&] { return folder_.publish(files, RunState::kRunning); });
}

Result<void> ScanSave::save_all(std::size_t frames) {
  VolumeGrid& grid = pipeline_.dense().grid();
  if (trajectory_.valid()) trajectory_.wait();
  // What changed since a save that is still under way began follows in one of its own.
  if (const auto saved = as_run_failure(saver_.finish_save(grid)); !saved) return saved;
  if (const auto begun = begin_map(frames); !begun) return begun;
  trajectory_ =
      std::async(std::launch::async, [file = place_of("trajectory.tum"), path = pipeline_.trajectory_now()] {
        return write_tum_trajectory(file, path);
      });
  if (const auto saved = as_run_failure(saver_.finish_save(grid)); !saved) return saved;
  trajectory_.wait();
  return finish_save();
}

}  // namespace hm
