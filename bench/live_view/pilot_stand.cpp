// hm_pilot_stand MESH DIR: a vehicle that a page flies while a model changes that the page is shown, faster
// than its line carries. No verb of the program does both; all parts are those of `hm fly teleop --serve` and
// `hm scan --serve`. Prints the address, and of every command of the page that reaches the autopilot its kind
// (CommandKind) and the time (s since 1970). Flies until it is killed.
#include <fcntl.h>
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/pipeline/flight/mission/flight_mission.hpp"
#include "hm/pipeline/live/live_station.hpp"
#include "hm/sim/sensor/laser_sensor.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

using namespace std::chrono_literals;

constexpr double kVoxel_m = 0.03;
constexpr std::size_t kChanges = 40;  ///< of pages in 50 ms: several times what the line carries

/// The autopilot of this library; says when commands reach it.
class ToldCore : public FlightCore {
 public:
  explicit ToldCore(std::unique_ptr<FlightCore> core) : core_(std::move(core)) {}
  void note_restarts(std::uint8_t restarts) override { core_->note_restarts(restarts); }
  AutopilotOutputs step(const AutopilotInputs& inputs) override {
    if (inputs.command && inputs.command->pilot == PagePilot::kPilot) {
      const std::chrono::duration<double> now = std::chrono::system_clock::now().time_since_epoch();
      fmt::print("command {} {:.6f}\n", static_cast<int>(inputs.command->kind), now.count());
      std::fflush(stdout);
    }
    return core_->step(inputs);
  }
  [[nodiscard]] BasicVehicleState<float> estimate() const override { return core_->estimate(); }
  [[nodiscard]] std::optional<Error> failure() const override { return core_->failure(); }
  [[nodiscard]] std::span<const CoreText> texts() const override { return core_->texts(); }

 private:
  std::unique_ptr<FlightCore> core_;
};

Result<std::unique_ptr<FlightCore>> told_core(const FlightRunParams& parameters) {
  const auto rig = city_flyer_rig(static_cast<std::size_t>(parameters.laser.beams));
  return std::unique_ptr<FlightCore>(
      std::make_unique<ToldCore>(make_host_core(core_aboard(parameters, rig))));
}

/// Page by page the same model again, each time as a newer version, until it is told to stop.
void change_pages(LiveStore& store, const std::stop_token& stop) {
  std::vector<LiveChange> pages;
  store.changes_after(0, pages);
  std::erase_if(pages, [](const LiveChange& page) { return page.slot.kind != LiveKind::kMeshPage; });
  for (std::size_t i = 0; !stop.stop_requested() && !pages.empty(); ++i) {
    const LiveSlot slot = pages[i % pages.size()].slot;
    const LiveItem item = store.read(slot).value();
    PageLevels levels = item.page;
    for (Payload& level : levels.levels) {
      if (!level) continue;
      LiveFrame frame = decode_live_payload(LiveKind::kMeshPage, *level).value();
      std::get<MeshPageFrame>(frame).version = item.version + 1;
      level = std::make_shared<const std::vector<std::byte>>(to_payload(frame));
    }
    store.put_page(slot.page, item.version + 1, item.stamp, std::move(levels));
    if (i % kChanges == 0) std::this_thread::sleep_for(50ms);
  }
}

Result<void> fly(const std::string& mesh_file, const std::string& folder) {
  const auto mesh = read_mesh(mesh_file);
  if (!mesh) return forward_error(mesh);
  PagePilot pilot;
  auto live = LiveStation::open({.verb = "fly", .name = "stand", .listen = "0", .pilot = &pilot});
  if (!live) return forward_error(live);
  Station& station = (*live)->station();
  StationView& view = (*live)->view();
  view.show_mesh(*mesh, kVoxel_m);
  view.flush();
  pilot.connect([&station](std::uint64_t sequence, bool accepted,
                           const std::string& reason) { station.answer(sequence, accepted, reason); },
                &view);
  FlightMissionOptions options;
  options.mission = "stand";
  start_in(WorldKind::kHouse, options.parameters.flight.run);
  LiveLines lines(open("/dev/null", O_RDONLY));
  options.live = &lines;
  options.page = &pilot;
  options.realtime = true;
  options.make_core = told_core;
  options.output = folder;
  options.existing = ExistingResult::kOverwrite;
  options.run.view = &view;
  fmt::print(stderr, "{}\n", (*live)->announcement());
  const std::jthread scan([&station](const std::stop_token& end) { change_pages(station.store(), end); });
  const auto flown = fly_mission(options);
  return flown ? Result<void>() : forward_error(flown);
}

}  // namespace
}  // namespace hm

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto flown = hm::fly(argv[1], argv[2]);
  if (!flown) fmt::print(stderr, "{}\n", hm::to_string(flown.error()));
  return flown ? 0 : 1;
}
