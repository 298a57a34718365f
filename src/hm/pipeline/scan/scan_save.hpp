#pragma once
#include <future>
#include <memory>
#include <optional>

#include "hm/core/stopwatch.hpp"
#include "hm/mapping/map_store.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"
#include "hm/pipeline/rgbd/slam_pipeline.hpp"
#include "hm/pipeline/rgbd/slam_save.hpp"

namespace hm {

/// Keeps map and trajectory of a scan on disk while it runs: every few seconds what has changed of the map,
/// so that at any time little is left to be saved. The first save_all() publishes map.hmap, trajectory.tum
/// and parameters.toml; later saves change these files.
class ScanSave {
 public:
  /// Pipeline and folder must outlive it. Before the first frame. Error: the map's file cannot be made.
  static Result<std::unique_ptr<ScanSave>> begin(SlamPipeline& pipeline, ResultFolder& folder,
                                                 const RgbdParameters& parameters,
                                                 const SlamSaveState& state);
  /// Ends the saving of the map's changes; waits for a save under way.
  ~ScanSave();
  ScanSave(const ScanSave&) = delete;
  ScanSave& operator=(const ScanSave&) = delete;

  /// To be called after every frame, with its number: goes on with a save for about a millisecond, or begins
  /// the next one.
  Result<void> after_frame(std::size_t frames);
  /// Saves everything now, and waits until it is on disk.
  Result<void> save_all(std::size_t frames);

 private:
  ScanSave(SlamPipeline& pipeline, ResultFolder& folder, const RgbdParameters& parameters,
           const SlamSaveState& state, MapFile map);
  Result<void> begin_map(std::size_t frames);
  Result<void> finish_save();
  [[nodiscard]] std::filesystem::path place_of(const char* name) const;

  SlamPipeline& pipeline_;
  ResultFolder& folder_;
  RgbdParameters parameters_;
  SlamSaveState state_;
  MapSaver saver_;
  std::future<Result<void>> trajectory_;  ///< written by a thread; invalid: none is under way
  bool is_saving_ = false, is_published_ = false;
  Stopwatch since_save_;
};

}  // namespace hm
