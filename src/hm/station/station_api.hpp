#pragma once
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hm/station/station.hpp"
#include "hm/station/web/web_types.hpp"

namespace hm {

/// Makes the files that `/api` offers, one after the other, on a thread of its own.
class ExportMaker {
 public:
  /// More that wait are refused.
  static constexpr std::size_t kMaxWaiting = 8;

  explicit ExportMaker(std::vector<StationExport> exports);
  /// Waits for the one that is being made; what is still asked for is dropped.
  ~ExportMaker();
  ExportMaker(const ExportMaker&) = delete;
  ExportMaker& operator=(const ExportMaker&) = delete;

  /// Answers later, from the maker's thread, or now if there is no such file or there are too many requests
  /// (false).
  bool make(const std::string& name, WebHandler::Answer answer);
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  struct Request {
    const StationExport* file = nullptr;
    WebHandler::Answer answer;
  };
  void run();

  const std::vector<StationExport> exports_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Request> requests_;
  bool end_ = false;
  std::thread thread_;
};

/// Who watches, and what was refused.
struct StationClients {
  std::size_t viewers = 0;
  RefusalCounts refused;
};

/// `/api/status`: hello, telemetry, number of viewers, what was refused, and the memory in use now.
WebResponse status_response(const LiveStore& store, const std::string& hello, const StationClients& clients);
/// `/api/statistics`: the newest statistics and the parameters, as one object.
WebResponse statistics_response(const LiveStore& store);

}  // namespace hm
