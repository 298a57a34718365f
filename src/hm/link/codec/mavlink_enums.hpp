#pragma once
#include <cstdint>

/// Values of MAVLink's enumerations that we send or understand (common.xml). Messages hold plain integers,
/// since others may send more than these.
namespace hm {

enum MavType : std::uint8_t {
  kMavTypeQuadrotor = 2,
  kMavTypeGroundStation = 6,
  kMavTypeOnboardController = 18
};
enum MavAutopilot : std::uint8_t {
  kMavAutopilotGeneric = 0,
  kMavAutopilotArdupilot = 3,
  kMavAutopilotInvalid = 8,  ///< not an autopilot: a ground station, a computer on board
  kMavAutopilotPx4 = 12,
};
enum MavModeFlag : std::uint8_t {
  kMavModeCustom = 1,
  kMavModeAuto = 4,
  kMavModeGuided = 8,
  kMavModeStabilize = 16,
  kMavModeManualInput = 64,
  kMavModeArmed = 128,
};
enum MavState : std::uint8_t {
  kMavStateBoot = 1,
  kMavStateStandby = 3,
  kMavStateActive = 4,
  kMavStateCritical = 5,
  kMavStateEmergency = 6,
};
enum MavSensor : std::uint32_t {
  kMavSensorGyro = 1U << 0U,
  kMavSensorAccelerometer = 1U << 1U,
  kMavSensorVisionPosition = 1U << 7U,
  kMavSensorLaserPosition = 1U << 8U,
  kMavSensorMotors = 1U << 15U,
  kMavSensorBattery = 1U << 25U,
};
enum MavFrame : std::uint8_t {
  kMavFrameLocalNed = 1,
  kMavFrameBodyNed = 8,
  kMavFrameBodyFrd = 12,
  kMavFrameLocalFrd = 20,  ///< x forward at the start, y right, z down: no compass needed
};
enum MavEstimator : std::uint8_t {
  kMavEstimatorVision = 2,
  kMavEstimatorLidar = 7,  ///< PX4 refuses it
};
/// Values of a set-point that are ignored.
enum MavTargetMask : std::uint16_t {
  kMavIgnorePosition = 7,
  kMavIgnoreVelocity = 56,
  kMavIgnoreAcceleration = 448,
  kMavIgnoreYaw = 1024,
  kMavIgnoreYawRate = 2048,
};
enum MavAttitudeMask : std::uint8_t { kMavIgnoreRates = 7, kMavIgnoreThrust = 64, kMavIgnoreAttitude = 128 };
enum MavCommand : std::uint16_t {
  kMavCommandLoiter = 17,  ///< without an end: hold
  kMavCommandReturn = 20,
  kMavCommandLand = 21,
  kMavCommandTakeoff = 22,
  kMavCommandSetMode = 176,
  kMavCommandReposition = 192,  ///< param4: yaw, rad, NaN: as it is
  kMavCommandArmDisarm = 400,   ///< param1 1 arms; param2 kMavDisarmByForce disarms in flight
  kMavCommandSetMessageInterval = 511,
  kMavCommandRequestMessage = 512,
};
inline constexpr float kMavDisarmByForce = 21196;
enum MavResult : std::uint8_t {
  kMavAccepted = 0,
  kMavTemporarilyRejected = 1,
  kMavDenied = 2,
  kMavUnsupported = 3,
  kMavFailed = 4,
  kMavInProgress = 5,
  kMavCancelled = 6,
  kMavCommandIntOnly = 8,
  kMavUnsupportedFrame = 9,
};
/// Severity of a text; smaller is worse.
enum MavSeverity : std::uint8_t { kMavCritical = 2, kMavError = 3, kMavWarning = 4, kMavInfo = 6 };
enum MavLandedState : std::uint8_t { kMavOnGround = 1, kMavInAir = 2, kMavTakingOff = 3, kMavLanding = 4 };
enum MavParamType : std::uint8_t { kMavParamInt32 = 6, kMavParamFloat = 9 };
enum MavCapability : std::uint64_t {
  kMavCanParamFloat = 1U << 1U,
  kMavCanCommandInt = 1U << 3U,
  kMavCanSetAttitude = 1U << 6U,
  kMavCanSetPosition = 1U << 7U,
  kMavCanMavlink2 = 1U << 13U,
};

}  // namespace hm
