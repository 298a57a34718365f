#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

#include "hm/flight/autopilot.hpp"
#include "hm/flight/trace/core_trace.hpp"

namespace hm {

/// Collects the records of a step (core_recorder.hpp) and gives its inputs, every bit of them.
class CoreInputReader {
 public:
  /// Takes the next record. The inputs of a step when the record completes it, valid until the next call;
  /// otherwise null.
  const AutopilotInputs* add(const CoreTraceRecord& record);

 private:
  AutopilotInputs inputs_;
  std::optional<FilterMatrix<float, 3>> R_world_imu_;
  bool complete_ = true;
};

/// Outputs of a board's step (record kOutputs): position, velocity and angles of the estimate, and which of
/// them are known.
struct CoreOutputs {
  AutopilotOutputs outputs;
  Vec3f position_m = Vec3f::Zero(), velocity_m_s = Vec3f::Zero(), roll_pitch_yaw_rad = Vec3f::Zero();
  bool planar_ready = false, height_ready = false;
};
/// Nothing if the record is of another kind.
[[nodiscard]] std::optional<CoreOutputs> read_core_outputs(const CoreTraceRecord& record);

/// Where a step differs from what was recorded.
struct CoreDifference {
  std::uint32_t sequence = 0;                ///< of the record
  std::uint32_t step = 0;                    ///< counted from 1
  std::string_view field;                    ///< "rotor speed", "position", ...
  unsigned index = 0;                        ///< element of the field
  std::uint32_t recorded = 0, replayed = 0;  ///< bits
};

/// The first difference between two records kStep or kOutputs in what the step gave.
[[nodiscard]] std::optional<CoreDifference> find_core_difference(const CoreTraceRecord& recorded,
                                                                 const CoreTraceRecord& replayed);

/// Repeats a flight: gives an autopilot the inputs of a trace, and compares what it does with what was
/// recorded, bit by bit. The autopilot must be new and have the parameters of the flight. The same code runs
/// on a host and in the firmware.
class CoreReplay {
 public:
  explicit CoreReplay(Autopilot& autopilot) : autopilot_(autopilot) {}
  /// Takes the next record; returns the difference if it is a step with one, or if records are missing before
  /// it.
  std::optional<CoreDifference> add(const CoreTraceRecord& record);
  [[nodiscard]] std::uint32_t steps() const { return steps_; }

  /// The same with the step in the caller's hands, who measures it: inputs when the record completes a step,
  /// which the caller gives to the autopilot before calling `compare`.
  const AutopilotInputs* read(const CoreTraceRecord& record);
  [[nodiscard]] std::optional<CoreDifference> compare(const CoreTraceRecord& record);

 private:
  Autopilot& autopilot_;
  CoreInputReader reader_;
  const AutopilotInputs* inputs_ = nullptr;
  std::uint32_t steps_ = 0, sequence_ = 0;
  std::optional<std::uint32_t> missing_;  // number of the record that did not come
};

}  // namespace hm
