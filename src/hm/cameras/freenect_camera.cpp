// hm: compiled alone, for the macros of libfreenect
#include <fmt/format.h>
#include <libfreenect.h>
#include <sys/time.h>

#include <array>
#include <cstring>
#include <utility>

#include "hm/cameras/camera_driver.hpp"
#include "hm/cameras/frame_pairing.hpp"

// Stand-ins of the library that replay files do not have it.
#pragma weak freenect_set_flag

namespace hm {
namespace {

using Kind = CameraEvent::Kind;

constexpr int kWidth = 640, kHeight = 480;
constexpr double kRate_hz = 30;
/// Automatic exposure has settled after so many images.
constexpr std::size_t kSettled = 30;

/// Device stamps: 32 bits of a counter of 60 MHz, which begins anew every 72 s.
class FreenectClock {
 public:
  Duration since_start(std::uint32_t stamp) {
    if (!last_) last_ = stamp;
    // Depth and colour are not quite in order: the difference has a sign.
    ticks_ += static_cast<std::int32_t>(stamp - std::exchange(*last_, stamp));
    return {ticks_ * 50 / 3};
  }

 private:
  std::optional<std::uint32_t> last_;
  std::int64_t ticks_ = 0;
};

/// Context and device; closed in the reverse order.
struct FreenectDevice {
  freenect_context* context = nullptr;
  freenect_device* device = nullptr;
  FreenectDevice() = default;
  FreenectDevice(const FreenectDevice&) = delete;
  FreenectDevice& operator=(const FreenectDevice&) = delete;
  ~FreenectDevice() {
    if (device) {
      freenect_stop_depth(device);
      freenect_stop_video(device);
      freenect_close_device(device);
    }
    if (context) freenect_shutdown(context);
  }
};

class FreenectCamera : public CameraDriver {
 public:
  FreenectCamera(std::unique_ptr<FreenectDevice> device, const CameraRequest& request,
                 CameraDescription description)
      : device_(std::move(device)), description_(std::move(description)), frames_(kRate_hz, request.after) {
    freenect_set_user(device_->device, this);
    freenect_set_depth_callback(device_->device, [](freenect_device* from, void* data, std::uint32_t stamp) {
      of(from).take_depth(data, stamp);
    });
    freenect_set_video_callback(device_->device, [](freenect_device* from, void* data, std::uint32_t stamp) {
      of(from).take_color(data, stamp);
    });
  }

  Result<void> start() {
    if (freenect_start_depth(device_->device) < 0 || freenect_start_video(device_->device) < 0)
      return fail(ErrorCode::kUnreadable, "freenect", "the streams do not start");
    set_automatic(FREENECT_ON);  // an earlier scan may have locked it
    return {};
  }

  [[nodiscard]] CameraDescription describe() const override { return description_; }

  CameraEvent next(std::chrono::milliseconds timeout) override {
    return frames_.next(timeout, [this](std::chrono::milliseconds wait) -> std::optional<CameraEvent> {
      timeval time{wait.count() / 1'000, wait.count() % 1'000 * 1'000};
      const int status = freenect_process_events_timeout(device_->context, &time);
      if (status >= 0) return std::nullopt;
      return CameraEvent{Kind::kFailed,
                         {},
                         fmt::format("the camera gives no more images: unplugged? (USB status {})", status)};
    });
  }

 private:
  static FreenectCamera& of(freenect_device* device) {
    return *static_cast<FreenectCamera*>(freenect_get_user(device));
  }

  void take_depth(const void* data, std::uint32_t stamp) {
    DepthImage depth{Image<std::uint16_t>(kWidth, kHeight), description_.depth_unit_m};
    std::memcpy(depth.units.data(), data, depth.units.pixels().size_bytes());
    frames_.pairing.add_depth(frames_.clock.to_time(clock_.since_start(stamp)), std::move(depth));
  }

  void take_color(const void* data, std::uint32_t stamp) {
    Image<Rgb8> color(kWidth, kHeight);
    std::memcpy(color.data(), data, color.pixels().size_bytes());
    frames_.pairing.add_color(frames_.clock.to_time(clock_.since_start(stamp)), std::move(color));
    if (++color_images_ == kSettled && set_automatic(FREENECT_OFF))
      description_.exposure = ExposureControl::kLocked;
  }

  /// Lets exposure and white balance adapt, or keeps what the camera has found. False: the exposure cannot be
  /// set.
  bool set_automatic(freenect_flag_value on) {
    if (!freenect_set_flag) return false;
    freenect_set_flag(device_->device, FREENECT_AUTO_WHITE_BALANCE, on);
    return freenect_set_flag(device_->device, FREENECT_AUTO_EXPOSURE, on) >= 0;
  }

  std::unique_ptr<FreenectDevice> device_;
  CameraDescription description_;
  FreenectClock clock_;
  DeviceFrames frames_;
  std::size_t color_images_ = 0;
};

Result<void> set_modes(freenect_device* device, DepthFormat format) {
  freenect_frame_mode video = freenect_find_video_mode(FREENECT_RESOLUTION_MEDIUM, FREENECT_VIDEO_RGB);
  constexpr std::array kFormats{FREENECT_DEPTH_REGISTERED, FREENECT_DEPTH_MM, FREENECT_DEPTH_11BIT};
  freenect_frame_mode depth =
      freenect_find_depth_mode(FREENECT_RESOLUTION_MEDIUM, kFormats[static_cast<std::size_t>(format)]);
  for (const freenect_frame_mode& mode : {video, depth})
    if (mode.is_valid == 0 || mode.width != kWidth || mode.height != kHeight)
      return fail(ErrorCode::kUnsupported, "freenect", "the device has no images of {} x {}", kWidth,
                  kHeight);
  if (freenect_set_video_mode(device, video) < 0 || freenect_set_depth_mode(device, depth) < 0)
    return fail(ErrorCode::kUnreadable, "freenect", "the device refuses images of {} x {}", kWidth, kHeight);
  if (freenect_set_flag)
    for (const freenect_flag mirror : {FREENECT_MIRROR_DEPTH, FREENECT_MIRROR_VIDEO})
      freenect_set_flag(device, mirror, FREENECT_OFF);
  return {};
}

/// Registered depth has the view of the colour camera, whose intrinsics libfreenect does not give: those that
/// ROS takes for a first Kinect without calibration.
CameraDescription describe_device(int index, const CameraRequest& request) {
  CameraDescription description;
  description.name = fmt::format("freenect Kinect ({})", index);
  description.camera =
      request.intrinsics.value_or(PinholeCamera{kWidth, kHeight, 525, 525, 319.5, 239.5, {}});
  description.intrinsics_source = request.intrinsics ? "given" : "usual values of a Kinect";
  if (request.depth_units_per_m) description.depth_unit_m = 1 / *request.depth_units_per_m;
  description.rate_hz = kRate_hz;
  description.exposure = ExposureControl::kAutomatic;
  description.is_kinect = true;
  if (!request.intrinsics && request.calibration.empty())
    description.notes.emplace_back(
        "the intrinsics are the usual ones of a Kinect; `hm calibrate` measures those of this one");
  return description;
}

}  // namespace

Result<std::unique_ptr<CameraDriver>> open_freenect(const std::string& device, const CameraRequest& request,
                                                    DepthFormat format) {
  int index = 0;
  if (!device.empty()) {
    if (device.size() > 2 || device.find_first_not_of("0123456789") != std::string::npos)
      return fail(ErrorCode::kUsage, "--camera freenect:" + device,
                  "a Kinect is named by its number: freenect:0");
    index = std::stoi(device);
  }
  if (request.intrinsics && (request.intrinsics->width != kWidth || request.intrinsics->height != kHeight))
    return fail(ErrorCode::kUnsupported, "freenect", "the images are {} x {}; the intrinsics are of {} x {}",
                kWidth, kHeight, request.intrinsics->width, request.intrinsics->height);
  auto opened = std::make_unique<FreenectDevice>();
  if (freenect_init(&opened->context, nullptr) < 0)
    return fail(ErrorCode::kInternal, "freenect", "USB cannot be used");
  freenect_set_log_level(opened->context, FREENECT_LOG_FATAL);
  if (freenect_num_devices(opened->context) <= index)
    return fail(ErrorCode::kNotFound, "--camera freenect", "no Kinect is plugged in{}",
                index > 0 ? fmt::format(" as number {}", index) : "");
  freenect_select_subdevices(opened->context, FREENECT_DEVICE_CAMERA);
  if (freenect_open_device(opened->context, &opened->device, index) < 0)
    return fail(ErrorCode::kUnreadable, "--camera freenect",
                "the Kinect cannot be opened: does it have power, and may you use it (udev rules)?");
  if (const auto set = set_modes(opened->device, format); !set) return forward_error(set);
  auto camera = std::make_unique<FreenectCamera>(std::move(opened), request, describe_device(index, request));
  if (const auto started = camera->start(); !started) return forward_error(started);
  return camera;
}

std::vector<std::string> list_freenect() {
  FreenectDevice library;
  std::vector<std::string> devices;
  if (freenect_init(&library.context, nullptr) < 0) return devices;
  freenect_set_log_level(library.context, FREENECT_LOG_FATAL);
  for (int i = 0; i < freenect_num_devices(library.context); ++i) devices.push_back(std::to_string(i));
  return devices;
}

}  // namespace hm
