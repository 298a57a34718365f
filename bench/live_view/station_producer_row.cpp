// What showing a live scan costs the thread that integrates, with viewers at the station: one that reads as
// fast as it can, five slow ones, and one that vanishes every ten seconds.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <list>
#include <thread>

#include "dense/scene_frames.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/live/station_view.hpp"
#include "hm/station/live_frames.hpp"
#include "hm/station/station.hpp"
#include "hm/station/testing/web_client.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

using std::chrono::duration;

constexpr double kRate_hz = 5;
constexpr int kSlowViewers = 5;
constexpr double kSlow_bytes_per_s = 300e3, kVanishAfter_s = 10;

/// Reads what the station sends, and acknowledges it, on a thread of its own.
class BenchViewer {
 public:
  /// As fast as it can where `bytes_per_s` is 0.
  BenchViewer(std::uint16_t port, double bytes_per_s)
      : client_(port, 0.2), bytes_per_s_(bytes_per_s), thread_([this] { run(); }) {}
  ~BenchViewer() {
    stop_ = true;
    thread_.join();
  }
  BenchViewer(const BenchViewer&) = delete;
  BenchViewer& operator=(const BenchViewer&) = delete;

 private:
  void run() {
    client_.upgrade("/live");
    client_.send_text(R"({"type":"hello","protocol":1,"session":"","pages":[]})");
    while (!stop_) {
      const auto message = client_.read_message();
      if (!message || message->opcode != 2) continue;
      const auto decoded = decode_live_message(message->bytes());
      if (!decoded) continue;
      client_.send_text(fmt::format(R"({{"type":"ack","sequence":{}}})", decoded->sequence));
      if (bytes_per_s_ > 0)
        std::this_thread::sleep_for(
            duration<double>(static_cast<double>(message->data.size()) / bytes_per_s_));
    }
  }

  WebClient client_;
  double bytes_per_s_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// The viewers of the row.
class Audience {
 public:
  explicit Audience(std::uint16_t port) : port_(port) {
    viewers_.emplace_back(port, 0);
    for (int i = 0; i < kSlowViewers; ++i) viewers_.emplace_back(port, kSlow_bytes_per_s);
    viewers_.emplace_back(port, 0);
  }
  /// One of them leaves, another comes, where it is time.
  void at(double time_s) {
    if (time_s < vanishes_at_s_) return;
    viewers_.pop_back();
    viewers_.emplace_back(port_, 0);
    vanishes_at_s_ += kVanishAfter_s;
  }

 private:
  std::uint16_t port_;
  double vanishes_at_s_ = kVanishAfter_s;
  std::list<BenchViewer> viewers_;
};

struct Spent {
  double alone_s = 0, shown_s = 0;
};

/// The same frames into two pipelines, one shown and one not, in turns: whatever else happens on the machine
/// happens to both.
Result<Spent> spent_on_a_scan(const Simulation& simulation, const DenseParams& params) {
  const auto source = simulated_frames(simulation, {0, 1, 40});
  StationOptions where;
  where.port_given = true;
  auto station = Station::start(std::move(where));
  if (!station) return forward_error(station);
  const std::string url = (*station)->url();
  Audience audience(static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1))));
  DensePipeline alone(params, source->camera(), 1), shown(params, source->camera(), 1);
  StationView view((*station)->store());
  shown.observe_mesh(&view);
  Spent spent;
  const auto process_alone = [&](const RgbdFrame& frame) {
    const double begin_s = thread_cpu_s();
    alone.process(frame);
    spent.alone_s += thread_cpu_s() - begin_s;
  };
  const auto process_shown = [&](const RgbdFrame& frame) {
    const double begin_s = thread_cpu_s();
    LiveCamera camera;
    camera.stamp = frame.stamp;
    camera.frame = &frame;
    camera.camera = source->camera();
    camera.T_map_camera = shown.process(frame).T_world_camera;
    view.on_camera(camera);
    spent.shown_s += thread_cpu_s() - begin_s;
  };
  std::size_t count = 0;
  while (true) {
    const auto chunk = source->next_chunk();  // simulated while nobody waits
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) return spent;
    const Stopwatch watch;
    double due_s = 0;
    for (const RgbdFrame& frame : *chunk) {
      if (count % 2 == 0) process_alone(frame);
      process_shown(frame);
      if (count % 2 == 1) process_alone(frame);
      due_s += 1 / kRate_hz;
      std::this_thread::sleep_for(duration<double>(std::max(0.0, due_s - watch.seconds())));
      audience.at(static_cast<double>(++count) / kRate_hz);
    }
  }
}

}  // namespace

Result<BenchResult> bench_station_producer(const BenchOptions& options) {
  SimulationParams scene;  // the demo's scan: 3 cm voxels, a tablet's depth camera
  scene.frame_limit = options.frame_limit ? options.frame_limit : 400;
  DenseParams params;
  params.tsdf.voxel_size_m = 0.03;
  const auto spent = spent_on_a_scan(Simulation(scene), params);
  if (!spent) return forward_error(spent);
  BenchResult result;
  result.rows = {{"station_producer", 100 * (spent->shown_s / spent->alone_s - 1), {}}};
  result.details = JsonValue::object(
      {{"frames", scene.frame_limit}, {"alone_s", spent->alone_s}, {"shown_s", spent->shown_s}});
  return result;
}

}  // namespace hm::bench
