#pragma once
#include <memory>
#include <string>

#include "hm/pipeline/live/live_station.hpp"
#include "program.hpp"

/// A run that is shown live, or not.
class Serving {
 public:
  Serving() = default;
  Serving(std::unique_ptr<hm::LiveStation> session, std::stop_token stop)
      : session_(std::move(session)), stop_(std::move(stop)) {}

  /// View for RunContext::view; null: no viewers.
  [[nodiscard]] hm::LiveView* view() const { return session_ ? &session_->view() : nullptr; }
  [[nodiscard]] hm::LiveStation* session() const { return session_.get(); }
  /// Tells viewers how the run ended. On a terminal the result stays open to them until Ctrl-C.
  void finish(bool worked, const std::string& reason = {});
  template <class Summary>
  void finish(const hm::Result<Summary>& summary) {
    finish(summary.has_value(), summary ? std::string() : hm::to_string(summary.error()));
  }

 private:
  std::unique_ptr<hm::LiveStation> session_;
  std::stop_token stop_;
};

/// The option --serve of verbs with a live view.
struct ServeFlags {
  bool is_wanted = false;
  std::string listen;

  void add_to(Command command);
  /// Opens the station, if it was asked for, prints its address, shows the parameters in effect, and sets
  /// `run.view`; after Session::interruptible_context(). Error (kUsage): the address cannot be used.
  [[nodiscard]] hm::Result<Serving> open(hm::LiveStationOptions options, const hm::ParamList& in_effect,
                                         hm::RunContext& run) const;
};
