#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/result.hpp"
#include "hm/station/live_store.hpp"

namespace hm {

/// Command of a pilot at the page; already checked for lease, order and age.
struct PilotOrder {
  std::uint64_t sequence = 0;
  std::string kind;                ///< "take_off", "velocity", ... (docs/file_formats.md, /pilot)
  std::array<double, 3> vector{};  ///< position (m, `map`) or velocity (m/s, level frame)
  double yaw = 0;                  ///< rad, or rad/s
};

/// Who flies for the station; called on the server's thread, must return at once.
class PilotHandler {
 public:
  virtual ~PilotHandler() = default;
  virtual void take(const PilotOrder& order) = 0;
  /// No fresh input for 0.3 s, or the pilot's connection ended: the vehicle has to hold.
  virtual void hold(const std::string& reason) = 0;
};

/// How a viewer steers a replay.
struct ReplayRequest {
  std::optional<bool> paused;
  std::optional<double> speed, seek_s;
};

/// A file that `/api` offers: made when asked for, on a thread of its own.
struct StationExport {
  std::string name;  ///< "mesh.ply"
  std::string content_type;
  std::function<Result<std::vector<std::byte>>()> make;
};

struct StationOptions {
  std::string address =
      "127.0.0.1";          ///< numeric, or localhost; another than loopback needs (and makes) a token
  std::uint16_t port = 0;   ///< 0: 8710, or the next free one
  bool port_given = false;  ///< then a taken port is an error, and 0 any free one
  JsonValue source;         ///< of hello: {verb, name}
  std::string program_version;
  std::vector<StationExport> exports;
  PilotHandler* pilot = nullptr;                     ///< null: nothing to fly; must outlive the station
  std::function<void(const ReplayRequest&)> replay;  ///< on the server's thread; empty: no replay
};

/// The server of the live view: page, `/live`, `/pilot`, `/foxglove`, `/api`, on a thread of its own.
class Station {
 public:
  /// Errors: kUsage, the address is none or not this machine's; kInternal, the port is taken. Both name it.
  static Result<std::unique_ptr<Station>> start(StationOptions options);
  /// Ends all connections; waits for a file of `/api` that is being made.
  ~Station();

  [[nodiscard]] LiveStore& store();
  /// The address to open, with the token if there is one.
  [[nodiscard]] std::string url() const;
  /// Whether other machines reach it.
  [[nodiscard]] bool is_public() const;
  /// Answers an order; `sequence` as in the order. Any thread.
  void answer(std::uint64_t sequence, bool accepted, const std::string& reason);
  [[nodiscard]] std::size_t viewers() const;

 private:
  struct Impl;
  explicit Station(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
