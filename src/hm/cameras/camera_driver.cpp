#include "hm/cameras/camera_driver.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "hm/cameras/calibrated_camera.hpp"
#include "hm/cameras/replay_camera.hpp"
#include "hm/cameras/v4l2_camera.hpp"
#include "hm/io/camera/calibration_file.hpp"

namespace hm {
namespace {

using Opened = Result<std::unique_ptr<CameraDriver>>;

/// A camera as asked for: driver, device, images.
struct CameraToOpen {
  const CameraRequest& request;
  std::string device;
  DepthFormat format = DepthFormat::kRegistered;
};

/// A kind of camera. Without a function to open it, its library was not there when the program was built.
struct DriverEntry {
  std::string_view name;
  std::string_view package;  ///< that it needs to be built
  Opened (*open)(const CameraToOpen&);
  std::vector<std::string> (*list)();
};

constexpr std::array kDrivers{
#ifdef HM_WITH_OPENNI2
    DriverEntry{
        "openni", "libopenni2-dev",
        [](const CameraToOpen& camera) { return open_openni(camera.device, camera.request, camera.format); },
        list_openni},
#else
    DriverEntry{"openni", "libopenni2-dev", nullptr, nullptr},
#endif
#ifdef HM_WITH_FREENECT
    DriverEntry{"freenect", "libfreenect-dev",
                [](const CameraToOpen& camera) {
                  return open_freenect(camera.device, camera.request, camera.format);
                },
                list_freenect},
#else
    DriverEntry{"freenect", "libfreenect-dev", nullptr, nullptr},
#endif
    DriverEntry{"v4l2", "",
                [](const CameraToOpen& camera) { return open_v4l2(camera.device, camera.request); },
                list_v4l2},
    DriverEntry{"replay", "",
                [](const CameraToOpen& camera) { return open_replay(camera.device, camera.request); },
                nullptr},
};

std::string how_to_get(const DriverEntry& driver) {
  return fmt::format("not in this program: install {} and build again (`./hm scan` does both)",
                     driver.package);
}

DepthFormat format_for(const RgbdCalibration& calibration) {
  if (calibration.disparity) return DepthFormat::kRawDisparity;
  return calibration.depth_camera ? DepthFormat::kUnregistered : DepthFormat::kRegistered;
}

/// Builds what the calibration makes of the driver's images.
Opened calibrated(Opened camera, const RgbdCalibration& calibration) {
  if (!camera) return camera;
  return calibrate_camera(std::move(*camera), calibration);
}

}  // namespace

std::string_view to_string(ExposureControl exposure) {
  constexpr std::array<std::string_view, 3> kNames{"unknown", "locked", "automatic"};
  return kNames[static_cast<std::size_t>(exposure)];
}

Result<std::unique_ptr<CameraDriver>> open_camera(const CameraRequest& request) {
  const std::size_t colon = request.camera.find(':');
  const std::string name = request.camera.substr(0, colon);
  CameraToOpen camera{request, colon == std::string::npos ? "" : request.camera.substr(colon + 1)};
  for (const DriverEntry& driver : kDrivers) {
    if (driver.name != name) continue;
    if (!driver.open) return fail(ErrorCode::kUsage, "--camera " + name, "{}", how_to_get(driver));
    // A replay is calibrated by its reader.
    if (request.calibration.empty() || name == "replay") return driver.open(camera);
    const auto calibration = read_calibration(request.calibration);
    if (!calibration) return forward_error(calibration);
    camera.format = format_for(*calibration);
    if (camera.format == DepthFormat::kRawDisparity && name != "freenect")
      return fail(ErrorCode::kUsage, "--calibration " + request.calibration.string(),
                  "is of raw disparity (depth_disparity), which only --camera freenect gives");
    return calibrated(driver.open(camera), *calibration);
  }
  return fail(ErrorCode::kUsage, "--camera " + request.camera,
              "there is openni, freenect, v4l2 (each also with :DEVICE) and replay:RECORDING");
}

std::vector<CameraListing> list_cameras() {
  std::vector<CameraListing> all;
  for (const DriverEntry& driver : kDrivers) {
    if (driver.name == "replay") continue;
    CameraListing listing{std::string(driver.name), driver.list != nullptr, {}, {}};
    if (driver.list) listing.devices = driver.list();
    if (!listing.is_built)
      listing.state = how_to_get(driver);
    else
      listing.state = listing.devices.empty() ? "built in; no device found" : "built in";
    all.push_back(std::move(listing));
  }
  return all;
}

}  // namespace hm
