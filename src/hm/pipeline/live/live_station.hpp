#pragma once
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
  std::filesystem::path report = {};  ///< of a finished result; empty: none
};

/// A station with the view of a run that feeds it.
class LiveStation {
 public:
  /// Waits for a file that is being made for a viewer.
  ~LiveStation();
  /// Error (kUsage): `listen` is no address, or it cannot be used.
  static Result<std::unique_ptr<LiveStation>> open(const LiveStationOptions& options);

  [[nodiscard]] StationView& view() { return *view_; }
  [[nodiscard]] Station& station() const { return *station_; }
  /// Where to look, for people; with a QR code where other machines reach it.
  [[nodiscard]] std::string announcement() const;

 private:
  LiveStation() = default;
  [[nodiscard]] std::vector<StationExport> exports(const LiveStationOptions& options);

  std::mutex export_mutex_;  // held while a file is made
  bool ended_ = false;
  std::unique_ptr<Station> station_;
  std::unique_ptr<StationView> view_;  // ends before the station
};

}  // namespace hm
