#include "hm/pipeline/laser/laser_choices.hpp"

namespace hm {
namespace {

std::string prediction_text(const LaserRecording& recording, const LaserParameters& params) {
  const LaserRunParams& run = params.run;
  if (recording.odometry.empty() || !run.use_odometry)
    return run.search_motion
               ? "no odometry: predicted with the velocity of the last scans; scans far apart in time, or "
                 "not matched, are sought among the last keyframes"
               : "no odometry: predicted with the velocity of the last scans";
  if (!run.degraded_odometry) return "predicted with the recording's odometry";
  const WheelNoiseParams& noise = params.wheel_noise;
  return fmt::format(
      "predicted with a stand-in for wheel odometry: the recording's true poses ({}), their motion from one "
      "to the "
      "next with noise of {:g} % along and {:g} % across it, {:g} % of a turn, {:g} rad/m of heading, "
      "systematic "
      "errors of {:g} % and {:g} rad/m (seed {})",
      recording.truth_source, 100 * noise.along_ratio, 100 * noise.across_ratio, 100 * noise.angle_ratio,
      noise.angle_rad_per_m, 100 * noise.scale_sigma_ratio, noise.drift_sigma_rad_per_m, noise.seed);
}

std::string map_frame_text(const LaserPipeline& pipeline, const LaserRunOptions& options) {
  switch (pipeline.map_frame().source()) {
    case MapFrameSource::kLoops:
      return "drift corrected by places seen again; odom itself stays as it is";
    case MapFrameSource::kSavedMap:
      return "located in the map " + options.saved_map.string();
    case MapFrameSource::kOdometry:
      break;
  }
  return "drift is not corrected";
}

void describe_matching(const LaserChoiceInput& input, std::vector<std::string>& choices) {
  const LaserRecording& recording = input.recording;
  const LaserParameters& params = input.options.parameters.laser;
  choices.push_back(fmt::format("poses by scan matching of {}", recording.lasers.front().name));
  if (!scans_horizontally(laser_platform(recording).rigs.front()))
    choices.emplace_back("its scan plane is not horizontal: poses in the plane may be wrong");
  if (recording.lasers.size() > 1)
    choices.push_back(fmt::format("{} more lasers are not used", recording.lasers.size() - 1));
  choices.emplace_back(!recording.imu.empty() && params.run.use_imu
                           ? "attitude, yaw between scans and fusion from the IMU"
                           : "no IMU: the vehicle is taken as level");
  choices.push_back(prediction_text(recording, params));
  if (!recording.rig || !recording.rig->down) choices.emplace_back("no mirror: the height stays as it is");
  choices.push_back(map_frame_text(input.pipeline, input.options));
}

}  // namespace

LaserPlatform laser_platform(const LaserRecording& recording) {
  LaserPlatform platform;
  for (const LaserStream& stream : recording.lasers) {
    LaserRig rig;
    if (platform.rigs.empty() && recording.rig) rig = *recording.rig;
    rig.T_base_laser = stream.T_base_laser;
    platform.rigs.push_back(rig);
  }
  platform.has_imu = !recording.imu.empty();
  platform.has_odometry = !recording.odometry.empty();
  return platform;
}

std::vector<std::string> laser_choices(const LaserChoiceInput& input) {
  const LaserRecording& recording = input.recording;
  std::vector<std::string> choices;
  if (input.pipeline.matches_scans())
    describe_matching(input, choices);
  else
    choices.push_back(fmt::format("poses from the recording's odometry{}",
                                  scans_horizontally(laser_platform(recording).rigs.front())
                                      ? ""
                                      : ", as no laser scans horizontally: the scans only build the map"));
  if (!recording.ranges.empty()) choices.emplace_back("readings of the distance sensor are not used");
  choices.insert(choices.end(), recording.notes.begin(), recording.notes.end());
  return choices;
}

}  // namespace hm
