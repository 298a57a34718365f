#pragma once
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// State of the exposure of the colour camera. One that changes by itself changes the features' looks.
enum class ExposureControl { kUnknown, kLocked, kAutomatic };
std::string_view to_string(ExposureControl exposure);

/// Streams and properties of a camera.
struct CameraDescription {
  std::string name;      ///< driver and device: "openni PrimeSense Sensor (1d27/0609@1/5)"
  PinholeCamera camera;  ///< of depth and colour, without lens distortion
  std::string intrinsics_source;
  double depth_unit_m = 1e-3;
  double rate_hz = 30;  ///< nominal
  ExposureControl exposure = ExposureControl::kUnknown;
  bool is_kinect = false;  ///< a Kinect or another PrimeSense device: a rolling shutter of known timing
  std::vector<std::string> notes;  ///< what the user should know, as sentences
};

/// Answer of a camera that was asked for its next frame.
struct CameraEvent {
  enum class Kind {
    kFrame,
    kTimeout,     ///< none came in time
    kIncomplete,  ///< an image that cannot be used, with the reason
    kEnd,         ///< no more frames will come, as it should be (a replay)
    kFailed,      ///< no more frames will come: unplugged, or an error, with the reason
  };
  Kind kind = Kind::kTimeout;
  RgbdFrame frame;  ///< without colour: no colour image belongs to this depth image
  std::string reason;
};

/// A depth camera that is open. Used by one thread at a time; closed when destroyed.
class CameraDriver {
 public:
  virtual ~CameraDriver() = default;
  [[nodiscard]] virtual CameraDescription describe() const = 0;
  /// Next pair of a depth image and its colour image, registered to each other. Stamps are the device's,
  /// shifted to the clock of this computer. Waits no longer than `timeout`, about.
  virtual CameraEvent next(std::chrono::milliseconds timeout) = 0;
};

/// Which camera to open, and what the user knows better than the camera.
struct CameraRequest {
  std::string camera;  ///< "openni", "freenect", "v4l2", each also with ":DEVICE", or "replay:RECORDING"
  /// Applied to every image (calibration_file.hpp); empty: images are registered by the camera.
  std::filesystem::path calibration = {};
  std::optional<PinholeCamera> intrinsics =
      {};  ///< instead of the camera's own; also asks for its image size
  std::optional<double> depth_units_per_m = {};  ///< instead of the camera's own
  double replay_speed = 1;                       ///< times the pace of the recording
  /// A replay fails after this time of the recording, as if it were unplugged (to try what is left then).
  std::optional<double> replay_unplug_s = {};
  std::optional<Time> after = {};  ///< stamps are later than this: of the recording that is continued
};

/// Opens a camera. Errors: kUsage for an unknown camera, one that was not built in (with the packages to
/// install), or a calibration of disparity for one that gives none; kNotFound where none is plugged in, and
/// what the driver reports.
Result<std::unique_ptr<CameraDriver>> open_camera(const CameraRequest& request);

/// Kind of camera, for a list.
struct CameraListing {
  std::string driver;                ///< "openni"
  bool is_built = false;             ///< else `state` says how to get it
  std::vector<std::string> devices;  ///< that are plugged in, as open_camera() takes them
  std::string state;                 ///< in words: "built in, no device found"
};
std::vector<CameraListing> list_cameras();

/// Depth images that a calibration expects: registered to the colour camera by the device; of the depth
/// camera, as distances or as raw disparity.
enum class DepthFormat { kRegistered, kUnregistered, kRawDisparity };

/// The drivers; `device` is what stands behind the colon. Those of libraries exist where these were found.
Result<std::unique_ptr<CameraDriver>> open_openni(const std::string& device, const CameraRequest& request,
                                                  DepthFormat format);
std::vector<std::string> list_openni();
Result<std::unique_ptr<CameraDriver>> open_freenect(const std::string& device, const CameraRequest& request,
                                                    DepthFormat format);
std::vector<std::string> list_freenect();

}  // namespace hm
