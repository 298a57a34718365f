#include "hm/flight/trace/core_recorder.hpp"

#include <bit>

namespace hm {
namespace {

using Kind = CoreTraceRecord::Kind;

float word(std::uint32_t bits) { return std::bit_cast<float>(bits); }

CoreTraceRecord start_record(Kind kind, Time stamp, std::uint32_t sequence) {
  CoreTraceRecord record;
  record.kind = kind;
  record.stamp = stamp;
  record.sequence = sequence;
  return record;
}

/// Copies a vector or a matrix (row by row) to the inputs from `first` on.
template <class Values>
void put(CoreTraceRecord& record, std::size_t first, const Values& values) {
  for (int row = 0; row < values.rows(); ++row)
    for (int column = 0; column < values.cols(); ++column) record.input[first++] = values(row, column);
}

CoreTraceRecord pose_record(const PoseReading<float>& pose, std::uint32_t sequence) {
  CoreTraceRecord record = start_record(Kind::kPose, pose.stamp, sequence);
  put(record, 0, pose.x_y_yaw);
  record.flags = pose.covariance ? 1 : 0;
  if (pose.covariance) put(record, 3, *pose.covariance);
  return record;
}

CoreTraceRecord height_record(const BasicHeightReading<float>& height, std::uint32_t sequence) {
  CoreTraceRecord record = start_record(Kind::kHeight, height.stamp, sequence);
  record.input[0] = height.height_m;
  record.flags = height.std_m ? 1 : 0;
  if (height.std_m) record.input[1] = *height.std_m;
  return record;
}

CoreTraceRecord command_record(const FlightCommand& command, std::uint32_t sequence) {
  CoreTraceRecord record = start_record(Kind::kCommand, command.stamp, sequence);
  record.state = command.pilot;
  record.phase = static_cast<std::uint8_t>(command.mode);
  record.flags =
      static_cast<std::uint8_t>(static_cast<unsigned>(command.kind) | (command.dead_man ? 0x80U : 0U));
  put(record, 0, command.position_m);
  put(record, 3, command.velocity_m_s);
  put(record, 6, command.acceleration_m_s2);
  record.input[9] = command.yaw_rad;
  record.input[10] = command.roll_rad;
  record.input[11] = command.pitch_rad;
  record.input[12] = command.yaw_rate_rad_s;
  record.output[0] = command.thrust_ratio;
  return record;
}

}  // namespace

CoreTraceRecord core_step_record(const AutopilotInputs& inputs, std::uint32_t sequence) {
  CoreTraceRecord record = start_record(Kind::kStep, inputs.now, sequence);
  const auto flag = [](bool set, unsigned bit) { return static_cast<unsigned>(set) << bit; };
  record.flags = static_cast<std::uint8_t>(
      flag(inputs.imu.has_value(), 0) | flag(inputs.motors_on, 1) | flag(inputs.rc_enabled, 2) |
      flag(inputs.computer_alive, 3) | flag(inputs.battery_ratio.has_value(), 4) |
      flag(inputs.clearance_m.has_value(), 5) | flag(inputs.obstacle_m.has_value(), 6));
  if (inputs.imu) {
    put(record, 0, inputs.imu->angular_velocity_rad_s);
    put(record, 3, inputs.imu->specific_force_m_s2);
    const auto stamp = static_cast<std::uint64_t>(inputs.imu->stamp.ns);
    record.input[9] = word(static_cast<std::uint32_t>(stamp));
    record.input[10] = word(static_cast<std::uint32_t>(stamp >> 32U));
  }
  record.input[6] = inputs.battery_ratio.value_or(0);
  record.input[7] = inputs.clearance_m.value_or(0);
  record.input[8] = inputs.obstacle_m.value_or(0);
  return record;
}

void note_core_outputs(const AutopilotOutputs& outputs, const BasicVehicleState<float>& estimate,
                       CoreTraceRecord& record) {
  record.state = static_cast<std::uint8_t>(outputs.state);
  record.phase = static_cast<std::uint8_t>(outputs.phase);
  record.input[11] =
      word(static_cast<std::uint32_t>(outputs.motors) | static_cast<std::uint32_t>(outputs.refusal) << 8U |
           static_cast<std::uint32_t>(outputs.safety.action) << 16U |
           static_cast<std::uint32_t>(outputs.safety.reason) << 24U);
  record.input[12] = word(outputs.safety.active);
  record.output = outputs.rotor_speed_rad_s;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    record.estimate[i] = estimate.position_m(axis);
    record.estimate[3 + i] = estimate.velocity_m_s(axis);
    record.estimate[6 + i] = estimate.roll_pitch_yaw_rad(axis);
  }
}

CoreTraceRecord core_outputs_record(const AutopilotOutputs& outputs, const BasicVehicleState<float>& estimate,
                                    std::uint32_t sequence) {
  CoreTraceRecord record = start_record(Kind::kOutputs, outputs.stamp, sequence);
  record.input[0] = outputs.rpyt.roll_rad;
  record.input[1] = outputs.rpyt.pitch_rad;
  record.input[2] = outputs.rpyt.yaw_rate_rad_s;
  record.input[3] = outputs.rpyt.thrust_ratio;
  record.input[4] = outputs.tilt_mismatch_rad.value_or(0);
  record.input[5] = word(outputs.invalid_inputs);
  record.flags = static_cast<std::uint8_t>((outputs.tilt_mismatch_rad ? 1 : 0) |
                                           (estimate.planar_ready ? 2 : 0) | (estimate.height_ready ? 4 : 0));
  note_core_outputs(outputs, estimate, record);
  return record;
}

std::span<CoreTraceRecord> CoreRecorder::inputs(const AutopilotInputs& inputs) {
  std::size_t count = 0;
  if (inputs.pose) records_[count++] = pose_record(*inputs.pose, ++sequence_);
  if (inputs.height) records_[count++] = height_record(*inputs.height, ++sequence_);
  if (inputs.command) records_[count++] = command_record(*inputs.command, ++sequence_);
  if (inputs.imu && inputs.imu->R_world_imu) {
    CoreTraceRecord& record = records_[count++];
    record = start_record(Kind::kOrientation, inputs.now, ++sequence_);
    put(record, 0, *inputs.imu->R_world_imu);
  }
  records_[count++] = core_step_record(inputs, ++sequence_);
  return std::span(records_).first(count);
}

std::span<const CoreTraceRecord> CoreRecorder::step(const AutopilotInputs& inputs,
                                                    const AutopilotOutputs& outputs,
                                                    const BasicVehicleState<float>& estimate) {
  const std::span<CoreTraceRecord> records = this->inputs(inputs);
  note_core_outputs(outputs, estimate, records.back());
  return records;
}

}  // namespace hm
