#pragma once
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "hm/pipeline/flight/flight_run.hpp"
#include "hm/pipeline/flight/page/straight_way.hpp"
#include "hm/pipeline/live/live_view.hpp"
#include "hm/station/station.hpp"

namespace hm {

/// Flies the vehicle as the pilot at the page asks (docs/file_formats.md, /pilot): orders become
/// FlightCommand of a pilot of its own, which takes control over with its first one; whoever has the
/// station's lease has asked for that. Orders come on the server's thread, step() is the flight's.
class PagePilot : public PilotHandler {
 public:
  /// Its identity among pilots.
  static constexpr std::uint8_t kPilot = 3;
  using Answer = std::function<void(std::uint64_t sequence, bool accepted, const std::string& reason)>;

  /// Before the flight. `answer` is called on the flight's thread; `view` is shown plans and may be null.
  void connect(Answer answer, LiveView* view) {
    answer_ = std::move(answer);
    view_ = view;
  }

  void take(const PilotOrder& order) override;
  void hold(const std::string& reason) override;

  /// Gives control up for good: the flight ends. Called on the flight's thread.
  void end();

  /// Called after each step of the flight; the next command, if there is one and somebody else sends none in
  /// this step (`may_send`). `map` is in `odom`.
  std::optional<FlightCommand> step(const FlightMoment& moment, const MultiVolumeGrid& map,
                                    bool may_send = true);

 private:
  struct Waiting {
    FlightCommand command;
    std::optional<std::uint64_t> sequence;  ///< of the order that it answers
  };
  void obey(const PilotOrder& order, const FlightMoment& moment, const MultiVolumeGrid& map);
  void go_to(const PilotOrder& order, bool flies, const FlightMoment& moment, const MultiVolumeGrid& map);
  void fly_velocity(const PilotOrder& order, const FlightMoment& moment);
  void note_answer(const FlightMoment& moment);
  Waiting& add(CommandKind kind, std::optional<std::uint64_t> sequence = std::nullopt);

  Answer answer_ = [](std::uint64_t, bool, const std::string&) {};
  LiveView* view_ = nullptr;
  std::mutex mutex_;  // guards the next two
  std::deque<PilotOrder> orders_;
  std::optional<std::string> hold_reason_;
  // Of the flight's thread.
  std::deque<Waiting> waiting_;
  std::optional<Waiting> sent_;
  Time last_stamp_{INT64_MIN};
  std::optional<Time> life_at_, sent_at_;
  bool in_control_ = false, ended_ = false;
};

}  // namespace hm
