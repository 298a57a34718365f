// hm_bench NAME [--threads N] [--rounds N] [--frames N]: measures one benchmark and prints one JSON object.
// bench/run calls it, one process a benchmark, so that memory and thread settings of one do not touch the
// next.
#include <array>
#include <charconv>
#include <cstdio>
#include <cstring>

#include "dense/peer.hpp"
#include "hm/io/bytes/json.hpp"
#include "measurement.hpp"

namespace {

using hm::bench::BenchOptions;
using hm::bench::BenchResult;

struct Known {
  const char* name;
  hm::Result<BenchResult> (*run)(const BenchOptions&);
};
constexpr auto kKnown = std::to_array<Known>({{"scalable", hm::bench::bench_scalable},
                                              {"slam_house", hm::bench::bench_slam_house},
                                              {"voxelblock", hm::bench::bench_voxelblock},
                                              {"simd", hm::bench::bench_simd},
                                              {"threads", hm::bench::bench_threads},
                                              {"carving", hm::bench::bench_carving},
                                              {"tango", hm::bench::bench_tango},
                                              {"steady", hm::bench::bench_steady},
                                              {"kernel_limit", hm::bench::bench_kernel_limit},
                                              {"mesh_incremental", hm::bench::bench_mesh_incremental},
                                              {"mesh_whole", hm::bench::bench_mesh_whole},
                                              {"seams", hm::bench::bench_seams},
                                              {"accuracy", hm::bench::bench_accuracy},
                                              {"completeness", hm::bench::bench_completeness},
                                              {"fidelity", hm::bench::bench_fidelity},
                                              {"plicp_1081", hm::bench::bench_plicp_1081},
                                              {"plicp_bag", hm::bench::bench_plicp_bag},
                                              {"plicp_ablation", hm::bench::bench_plicp_ablation},
                                              {"plicp_still", hm::bench::bench_plicp_still},
                                              {"height", hm::bench::bench_height},
                                              {"late_laser", hm::bench::bench_late_laser},
                                              {"mvog", hm::bench::bench_mvog},
                                              {"intel_relations", hm::bench::bench_intel_relations},
                                              {"loop_soak", hm::bench::bench_loop_soak},
                                              {"bundle_soak", hm::bench::bench_bundle_soak},
                                              {"align_room", hm::bench::bench_align_room},
                                              {"align_sevenscenes", hm::bench::bench_align_sevenscenes},
                                              {"places", hm::bench::bench_places},
                                              {"depth_calibration", hm::bench::bench_depth_calibration},
                                              {"vo_sevenscenes", hm::bench::bench_vo_sevenscenes},
                                              {"vo_every_5th", hm::bench::bench_vo_every_5th},
                                              {"vo_tum_xyz", hm::bench::bench_vo_tum_xyz},
                                              {"vo_tum_rpy", hm::bench::bench_vo_tum_rpy},
                                              {"vo_depth_only", hm::bench::bench_vo_depth_only},
                                              {"vo_people", hm::bench::bench_vo_people},
                                              {"vo_rolling", hm::bench::bench_vo_rolling},
                                              {"slam_recordings", hm::bench::bench_slam_recordings},
                                              {"vo_icl", hm::bench::bench_vo_icl},
                                              {"covariance_used", hm::bench::bench_covariance_used},
                                              {"vo_hour", hm::bench::bench_vo_hour},
                                              {"vio_tango", hm::bench::bench_vio_tango},
                                              {"vo_vs_opencv", hm::bench::bench_vo_vs_opencv},
                                              {"fly_hover", hm::bench::bench_fly_hover},
                                              {"fly_step", hm::bench::bench_fly_step},
                                              {"fly_attitude", hm::bench::bench_fly_attitude},
                                              {"fly_robust", hm::bench::bench_fly_robust},
                                              {"fly_waypoints", hm::bench::bench_fly_waypoints},
                                              {"fly_failsafes", hm::bench::bench_fly_failsafes},
                                              {"fly_speed", hm::bench::bench_fly_speed},
                                              {"fly_soak", hm::bench::bench_fly_soak},
                                              {"core_host", hm::bench::bench_core_host},
                                              {"link_noise", hm::bench::bench_link_noise},
                                              {"page_mesh", hm::bench::bench_page_mesh},
                                              {"page_live", hm::bench::bench_page_live},
                                              {"station_producer", hm::bench::bench_station_producer}});

/// Reads "--name value" pairs; false for anything else.
bool read_flags(int count, char** words, BenchOptions& options) {
  for (int i = 0; i < count; i += 2) {
    int* target = nullptr;
    if (std::strcmp(words[i], "--threads") == 0) target = &options.threads;
    if (std::strcmp(words[i], "--rounds") == 0) target = &options.rounds;
    if (std::strcmp(words[i], "--frames") == 0) target = &options.frame_limit;
    if (!target || i + 1 >= count) return false;
    const char* end = words[i + 1] + std::strlen(words[i + 1]);
    if (std::from_chars(words[i + 1], end, *target).ptr != end || *target < 0) return false;
  }
  return options.threads > 0 && options.rounds > 0;
}

hm::JsonValue to_json(const BenchResult& result) {
  auto rows = hm::JsonValue::array();
  for (const auto& row : result.rows) {
    auto object = hm::JsonValue::object({{"name", row.name}, {"ours", row.ours}});
    hm::JsonValue& peer = object["peer"];
    if (row.peer) peer = *row.peer;
    rows.push_back(std::move(object));
  }
  return hm::JsonValue::object({{"rows", rows}, {"details", result.details}});
}

}  // namespace

int main(int count, char** words) {
  BenchOptions options;
  const Known* known = nullptr;
  for (const Known& candidate : kKnown)
    if (count > 1 && std::strcmp(words[1], candidate.name) == 0) known = &candidate;
  if (!known || !read_flags(count - 2, words + 2, options)) {
    std::fputs("usage: hm_bench NAME [--threads N] [--rounds N] [--frames N]; names:", stderr);
    for (const Known& candidate : kKnown) std::fprintf(stderr, " %s", candidate.name);
    std::fputs("\n", stderr);
    return 2;
  }
  hm::bench::limit_peer_threads(options.threads);
  const auto result = known->run(options);
  if (!result) {
    std::fprintf(stderr, "%s\n", hm::to_string(result.error()).c_str());
    return result.error().code == hm::ErrorCode::kNotFound ? 3 : 1;
  }
  std::printf("%s\n", hm::to_json_text(to_json(*result)).c_str());
  return 0;
}
