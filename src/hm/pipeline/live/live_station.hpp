#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "hm/pipeline/live/station_view.hpp"
#include "hm/station/station.hpp"

namespace hm {

/// A station to open for a run.
struct LiveStationOptions {
  std::string verb, name;
  std::string listen = {};  ///< "", "PORT", "ADDRESS" or "ADDRESS:PORT"; without an address only this machine
  std::string program_version = {};
  PilotHandler* pilot = nullptr;
  std::function<void(const ReplayRequest&)> replay = {};
  std::filesystem::path report = {};          ///< of a finished result; empty: none
  std::filesystem::path report_to_come = {};  ///< that the run writes; empty: none
};

/// Where to look, for people: the address last, after a QR code where other machines reach it, and after what
/// to do where the program was built without its page.
[[nodiscard]] std::string live_announcement(const std::string& url, bool is_public, bool has_page);

/// A station with the view of a run that feeds it.
class LiveStation {
 public:
  /// Waits for a file that is being made for a viewer.
  ~LiveStation();
  /// Error (kUsage): `listen` is no address, or it cannot be used.
  static Result<std::unique_ptr<LiveStation>> open(const LiveStationOptions& options);

  [[nodiscard]] StationView& view() { return *view_; }
  [[nodiscard]] Station& station() const { return *station_; }
  /// The live_announcement() of this station.
  [[nodiscard]] std::string announcement() const;
  /// The run has ended: the report is offered that it has written since the station was opened.
  void offer_report();
  /// Report of a run for `/api/report`. Errors: kNotFound before that; it cannot be read.
  [[nodiscard]] Result<std::vector<std::byte>> report_of_run() const;

 private:
  LiveStation() = default;
  [[nodiscard]] std::vector<StationExport> exports(const LiveStationOptions& options);

  std::mutex export_mutex_;  // held while a file is made
  bool ended_ = false;
  std::filesystem::path report_to_come_;
  std::filesystem::file_time_type opened_at_ = std::filesystem::file_time_type::clock::now();
  std::atomic<bool> is_report_written_ = false;
  std::unique_ptr<Station> station_;
  std::unique_ptr<StationView> view_;  // ends before the station
};

}  // namespace hm
