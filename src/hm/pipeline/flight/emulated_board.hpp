#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "hm/core/result.hpp"
#include "hm/flight/trace/core_recorder.hpp"
#include "hm/flight/trace/core_replay.hpp"
#include "hm/link/transport/file_descriptor.hpp"
#include "hm/pipeline/flight/flight_core.hpp"

namespace hm {

struct EmulatedBoardSetup {
  std::filesystem::path image;               ///< flight.elf, the firmware (firmware/README.md)
  std::string emulator = "qemu-system-arm";  ///< program of the emulator
  Duration answer_limit{10'000'000'000};     ///< a board that takes longer for a step has failed
};

/// The firmware on an emulated board (QEMU's netduinoplus2), in lock-step over its serial port: each step
/// sends the records of the inputs (core_recorder.hpp) and waits for the record of the outputs. The board
/// gives the same bits as the host's core. It flies with the default parameters. Ends with this object.
class EmulatedBoard : public FlightCore {
 public:
  /// Starts the emulator and waits until the firmware runs. Errors: kNotFound when the image or the emulator
  /// is missing (with the package that has it), kInternal when the firmware does not start.
  static Result<std::unique_ptr<EmulatedBoard>> start(const EmulatedBoardSetup& setup);
  ~EmulatedBoard() override { stop(); }
  EmulatedBoard(const EmulatedBoard&) = delete;
  EmulatedBoard& operator=(const EmulatedBoard&) = delete;

  /// One step of the board. When it has failed, and from then on: motors off, state kError.
  AutopilotOutputs step(const AutopilotInputs& inputs) override;
  /// Position, velocity and angles after the last step; the rest is not sent.
  [[nodiscard]] BasicVehicleState<float> estimate() const override { return estimate_; }
  /// Ends the emulator.
  void stop();
  /// Why the board has failed; nothing while it works.
  [[nodiscard]] std::optional<Error> failure() const override { return failure_; }

 private:
  explicit EmulatedBoard(EmulatedBoardSetup setup) : setup_(std::move(setup)) {}
  Result<void> launch();
  Result<void> wait_ready();
  Result<void> send(const AutopilotInputs& inputs);
  Result<CoreOutputs> receive();
  Result<std::size_t> read_some(std::span<std::uint8_t> bytes);
  [[nodiscard]] tl::unexpected<Error> failed(std::string_view what);

  EmulatedBoardSetup setup_;
  int process_ = -1;
  FileDescriptor port_, messages_;  // serial port; what the emulator says
  CoreRecorder recorder_;
  CoreTraceParser parser_;
  std::uint32_t steps_ = 0;
  BasicVehicleState<float> estimate_;
  std::optional<Error> failure_;
};

}  // namespace hm
