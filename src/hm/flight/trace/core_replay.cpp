#include "hm/flight/trace/core_replay.hpp"

#include "hm/flight/trace/core_recorder.hpp"

#include <array>
#include <bit>

#include "hm/flight/trace/core_recorder.hpp"

namespace hm {
namespace {

using Kind = CoreTraceRecord::Kind;

std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }

Vec3f vector_at(const CoreTraceRecord& record, std::size_t first) {
  return {record.input[first], record.input[first + 1], record.input[first + 2]};
}

FilterMatrix<float, 3> matrix_at(const CoreTraceRecord& record, std::size_t first) {
  FilterMatrix<float, 3> matrix;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) matrix(row, column) = record.input[first++];
  return matrix;
}

PoseReading<float> pose_of(const CoreTraceRecord& record) {
  PoseReading<float> pose{record.stamp, vector_at(record, 0), {}};
  if ((record.flags & 1U) != 0) pose.covariance = matrix_at(record, 3);
  return pose;
}

BasicHeightReading<float> height_of(const CoreTraceRecord& record) {
  BasicHeightReading<float> height{record.stamp, record.input[0], {}};
  if ((record.flags & 1U) != 0) height.std_m = record.input[1];
  return height;
}

FlightCommand command_of(const CoreTraceRecord& record) {
  FlightCommand command;
  command.stamp = record.stamp;
  command.pilot = record.state;
  command.kind = static_cast<CommandKind>(record.flags & 0x7fU);
  command.mode = static_cast<FlightPhase>(record.phase);
  command.dead_man = (record.flags & 0x80U) != 0;
  command.position_m = vector_at(record, 0);
  command.velocity_m_s = vector_at(record, 3);
  command.acceleration_m_s2 = vector_at(record, 6);
  command.yaw_rad = record.input[9];
  command.roll_rad = record.input[10];
  command.pitch_rad = record.input[11];
  command.yaw_rate_rad_s = record.input[12];
  command.thrust_ratio = record.output[0];
  return command;
}

/// Outputs of a step, in the order in which they are compared.
constexpr std::size_t kOutputWords = 3 + 4 + 9;
std::array<std::uint32_t, kOutputWords> output_words(const CoreTraceRecord& record) {
  std::array<std::uint32_t, kOutputWords> words{
      static_cast<std::uint32_t>(record.state) | static_cast<std::uint32_t>(record.phase) << 8U,
      bits_of(record.input[11]), bits_of(record.input[12])};
  std::size_t next = 3;
  for (const float value : record.output) words[next++] = bits_of(value);
  for (const float value : record.estimate) words[next++] = bits_of(value);
  return words;
}

struct Field {
  std::string_view name;
  std::size_t first;
};
constexpr std::array<Field, 7> kFields{{{"state and phase", 0},
                                        {"motors, refusal, safety action and reason", 1},
                                        {"active fail-safes", 2},
                                        {"rotor speed", 3},
                                        {"position", 7},
                                        {"velocity", 10},
                                        {"angle", 13}}};

}  // namespace

const AutopilotInputs* CoreInputReader::add(const CoreTraceRecord& record) {
  if (complete_) {
    inputs_ = {};
    R_world_imu_.reset();
  }
  complete_ = record.kind == Kind::kStep;
  if (record.kind == Kind::kPose) inputs_.pose = pose_of(record);
  if (record.kind == Kind::kHeight) inputs_.height = height_of(record);
  if (record.kind == Kind::kCommand) inputs_.command = command_of(record);
  if (record.kind == Kind::kOrientation) R_world_imu_ = matrix_at(record, 0);
  if (!complete_) return nullptr;
  const auto has = [&](unsigned bit) { return (record.flags >> bit & 1U) != 0; };
  inputs_.now = record.stamp;
  if (has(0)) {
    const std::uint64_t stamp = bits_of(record.input[9]) | std::uint64_t{bits_of(record.input[10])} << 32U;
    inputs_.imu = InertialReading<float>{
        {static_cast<std::int64_t>(stamp)}, vector_at(record, 0), vector_at(record, 3), R_world_imu_};
  }
  inputs_.motors_on = has(1);
  inputs_.rc_enabled = has(2);
  inputs_.computer_alive = has(3);
  if (has(4)) inputs_.battery_ratio = record.input[6];
  if (has(5)) inputs_.clearance_m = record.input[7];
  if (has(6)) inputs_.obstacle_m = record.input[8];
  return &inputs_;
}

std::optional<CoreOutputs> read_core_outputs(const CoreTraceRecord& record) {
  if (record.kind != Kind::kOutputs) return {};
  CoreOutputs result;
  AutopilotOutputs& out = result.outputs;
  out.stamp = record.stamp;
  out.state = static_cast<AutopilotState>(record.state);
  out.phase = static_cast<FlightPhase>(record.phase);
  out.rotor_speed_rad_s = record.output;
  out.rpyt = {record.input[0], record.input[1], record.input[2], record.input[3]};
  if ((record.flags & 1U) != 0) out.tilt_mismatch_rad = record.input[4];
  out.invalid_inputs = bits_of(record.input[5]);
  const std::uint32_t word = bits_of(record.input[11]);
  out.motors = static_cast<MotorDemand>(word & 0xffU);
  out.refusal = static_cast<Refusal>(word >> 8U & 0xffU);
  out.safety.action = static_cast<SafetyAction>(word >> 16U & 0xffU);
  out.safety.reason = static_cast<FailSafe>(word >> 24U);
  out.safety.active = bits_of(record.input[12]);
  result.planar_ready = (record.flags & 2U) != 0;
  result.height_ready = (record.flags & 4U) != 0;
  result.position_m = {record.estimate[0], record.estimate[1], record.estimate[2]};
  result.velocity_m_s = {record.estimate[3], record.estimate[4], record.estimate[5]};
  result.roll_pitch_yaw_rad = {record.estimate[6], record.estimate[7], record.estimate[8]};
  return result;
}

std::optional<CoreDifference> find_core_difference(const CoreTraceRecord& recorded,
                                                   const CoreTraceRecord& replayed) {
  const auto expected = output_words(recorded), actual = output_words(replayed);
  for (std::size_t i = 0; i < kOutputWords; ++i) {
    if (expected[i] == actual[i]) continue;
    std::size_t field = kFields.size() - 1;
    while (kFields[field].first > i) --field;
    return CoreDifference{recorded.sequence,   0,
                          kFields[field].name, static_cast<unsigned>(i - kFields[field].first),
                          expected[i],         actual[i]};
  }
  return {};
}

const AutopilotInputs* CoreReplay::read(const CoreTraceRecord& record) {
  missing_.reset();
  if (record.sequence != sequence_ + 1) missing_ = sequence_ + 1;
  sequence_ = record.sequence;
  inputs_ = reader_.add(record);
  if (inputs_ != nullptr) ++steps_;
  return inputs_;
}

std::optional<CoreDifference> CoreReplay::compare(const CoreTraceRecord& record) {
  if (missing_) return CoreDifference{record.sequence, steps_, "sequence", 0, record.sequence, *missing_};
  if (inputs_ == nullptr) return {};
  CoreTraceRecord replayed = core_step_record(*inputs_, record.sequence);
  note_core_outputs(autopilot_.outputs(), autopilot_.estimate(), replayed);
  std::optional<CoreDifference> difference = find_core_difference(record, replayed);
  if (difference) difference->step = steps_;
  return difference;
}

std::optional<CoreDifference> CoreReplay::add(const CoreTraceRecord& record) {
  if (const AutopilotInputs* inputs = read(record)) autopilot_.step(*inputs);
  return compare(record);
}

}  // namespace hm
