#pragma once
#include <optional>
#include <string>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/result.hpp"

namespace hm::bench {

/// One number of a benchmark, as bench/run judges it.
struct Measurement {
  std::string name;  ///< a row of bench/rows.py
  double ours = 0;
  std::optional<double> peer;  ///< nothing without a peer, or when it is not installed
};

/// Result of one benchmark: its numbers, and text for the document.
struct BenchResult {
  std::vector<Measurement> rows;
  JsonValue details = JsonValue::object();
};

/// How a benchmark is run.
struct BenchOptions {
  int threads = 1;      ///< ours; the peer's come from OMP_NUM_THREADS and limit_peer_threads()
  int rounds = 3;       ///< every frame counts with its fastest round
  int frame_limit = 0;  ///< 0: all; less for a quick look
};

Result<BenchResult> bench_scalable(const BenchOptions& options);
Result<BenchResult> bench_voxelblock(const BenchOptions& options);
Result<BenchResult> bench_simd(const BenchOptions& options);
Result<BenchResult> bench_threads(const BenchOptions& options);
Result<BenchResult> bench_carving(const BenchOptions& options);
Result<BenchResult> bench_tango(const BenchOptions& options);
Result<BenchResult> bench_steady(const BenchOptions& options);
Result<BenchResult> bench_kernel_limit(const BenchOptions& options);
Result<BenchResult> bench_mesh_incremental(const BenchOptions& options);
Result<BenchResult> bench_mesh_whole(const BenchOptions& options);
Result<BenchResult> bench_seams(const BenchOptions& options);
Result<BenchResult> bench_accuracy(const BenchOptions& options);
Result<BenchResult> bench_completeness(const BenchOptions& options);
Result<BenchResult> bench_fidelity(const BenchOptions& options);
Result<BenchResult> bench_plicp_1081(const BenchOptions& options);
Result<BenchResult> bench_plicp_bag(const BenchOptions& options);
Result<BenchResult> bench_plicp_ablation(const BenchOptions& options);
Result<BenchResult> bench_plicp_still(const BenchOptions& options);
Result<BenchResult> bench_height(const BenchOptions& options);
Result<BenchResult> bench_late_laser(const BenchOptions& options);
Result<BenchResult> bench_mvog(const BenchOptions& options);
Result<BenchResult> bench_align_room(const BenchOptions& options);
Result<BenchResult> bench_align_sevenscenes(const BenchOptions& options);
Result<BenchResult> bench_intel_relations(const BenchOptions& options);
Result<BenchResult> bench_loop_soak(const BenchOptions& options);
Result<BenchResult> bench_bundle_soak(const BenchOptions& options);
Result<BenchResult> bench_depth_calibration(const BenchOptions& options);
Result<BenchResult> bench_places(const BenchOptions& options);
Result<BenchResult> bench_vio_tango(const BenchOptions& options);
Result<BenchResult> bench_vo_vs_opencv(const BenchOptions& options);
Result<BenchResult> bench_slam_house(const BenchOptions& options);
Result<BenchResult> bench_vo_sevenscenes(const BenchOptions& options);
Result<BenchResult> bench_vo_every_5th(const BenchOptions& options);
Result<BenchResult> bench_vo_tum_xyz(const BenchOptions& options);
Result<BenchResult> bench_vo_tum_rpy(const BenchOptions& options);
Result<BenchResult> bench_vo_depth_only(const BenchOptions& options);
Result<BenchResult> bench_vo_people(const BenchOptions& options);
Result<BenchResult> bench_vo_rolling(const BenchOptions& options);
Result<BenchResult> bench_slam_recordings(const BenchOptions& options);
Result<BenchResult> bench_vo_icl(const BenchOptions& options);
Result<BenchResult> bench_covariance_used(const BenchOptions& options);
Result<BenchResult> bench_vo_hour(const BenchOptions& options);
Result<BenchResult> bench_fly_hover(const BenchOptions& options);
Result<BenchResult> bench_fly_step(const BenchOptions& options);
Result<BenchResult> bench_fly_attitude(const BenchOptions& options);
Result<BenchResult> bench_page_mesh(const BenchOptions& options);
Result<BenchResult> bench_page_live(const BenchOptions& options);
Result<BenchResult> bench_station_producer(const BenchOptions& options);
Result<BenchResult> bench_link_noise(const BenchOptions& options);
Result<BenchResult> bench_fly_robust(const BenchOptions& options);
Result<BenchResult> bench_fly_waypoints(const BenchOptions& options);
Result<BenchResult> bench_fly_failsafes(const BenchOptions& options);
Result<BenchResult> bench_fly_speed(const BenchOptions& options);
Result<BenchResult> bench_fly_soak(const BenchOptions& options);
Result<BenchResult> bench_core_host(const BenchOptions& options);

}  // namespace hm::bench
