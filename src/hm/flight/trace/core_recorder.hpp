#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "hm/flight/autopilot.hpp"
#include "hm/flight/trace/core_trace.hpp"

namespace hm {

/// The record kStep of these inputs, without what the step gives.
[[nodiscard]] CoreTraceRecord core_step_record(const AutopilotInputs& inputs, std::uint32_t sequence);
/// Adds to a record kStep or kOutputs what the step gave.
void note_core_outputs(const AutopilotOutputs& outputs, const BasicVehicleState<float>& estimate,
                       CoreTraceRecord& record);
/// The record kOutputs: all that a step gave, position, velocity and angles of the estimate.
[[nodiscard]] CoreTraceRecord core_outputs_record(const AutopilotOutputs& outputs,
                                                  const BasicVehicleState<float>& estimate,
                                                  std::uint32_t sequence);

/// Turns the inputs of each step into records of core.trace, numbered from 1 on. Every bit of every input is
/// kept, so that CoreReplay (core_replay.hpp) repeats the flight.
class CoreRecorder {
 public:
  /// At most: pose, height, command, orientation, step.
  static constexpr std::size_t kMaxRecords = 5;

  /// Records of a step in the order of the file, the step last and without what it gives. They are valid
  /// until the next call.
  std::span<CoreTraceRecord> inputs(const AutopilotInputs& inputs);
  /// The same for a step that was made with these inputs, with what it gave.
  std::span<const CoreTraceRecord> step(const AutopilotInputs& inputs, const AutopilotOutputs& outputs,
                                        const BasicVehicleState<float>& estimate);

 private:
  std::uint32_t sequence_ = 0;
  std::array<CoreTraceRecord, kMaxRecords> records_;
};

}  // namespace hm
