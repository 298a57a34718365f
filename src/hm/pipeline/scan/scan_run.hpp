#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/cameras/camera_driver.hpp"
#include "hm/core/run_context.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"
#include "hm/pipeline/rgbd/slam_run.hpp"

namespace hm {

/// A camera to scan with, and the folder of the results.
struct ScanOptions {
  CameraRequest camera;
  std::filesystem::path output;  ///< a folder, made if needed; the recording is its folder `recording`
  /// kResume: the recording is continued. Its frames are tracked again before the camera is read, so that new
  /// frames find their place in the map.
  ExistingResult existing = ExistingResult::kRefuse;
  std::optional<double> duration_s = {};  ///< ends the scan; none: until it is stopped, or the camera ends
  RgbdParameters parameters;
  RunContext run;  ///< asked to stop, the scan ends as it should
  /// Until the last frame; none: run.threads. The camera and the recording need a processor, and a loop that
  /// waits for a thread without one is slower than a loop on one thread.
  std::optional<int> live_threads = {};
};

/// Result of a scan.
struct ScanSummary {
  CaptureSummary capture;
  std::optional<SlamSummary> slam;  ///< none: the camera failed, and only what there was has been saved
  std::optional<Error> failure;     ///< of the camera, or of recording
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// Scans with a live camera: tracks and maps its frames (SlamPipeline), and records them in TUM layout at the
/// same time, each on a thread of its own. Where tracking is slower than the camera the newest frame wins;
/// the recording has all of them. Map and trajectory are saved every few seconds (ScanSave). In the end it
/// writes what run_slam() writes of a recording.
///
/// A camera that fails (unplugged): recording, map, trajectory and mesh are saved as they are, without the
/// corrections of the end, and the summary has the failure. It also has it where frames could not be
/// recorded.
///
/// Errors: no such camera, output folder unusable, a recording there of another camera, or the one that is
/// replayed, parameters that contradict, not a single pose, the map cannot be saved.
Result<ScanSummary> run_scan(const ScanOptions& options);

/// Those of visit(SlamSummary), with capture{}; of a failed scan capture{} alone.
void visit(const ScanSummary& summary, SummaryTree& v);
std::string to_text(const ScanSummary& summary);

}  // namespace hm
