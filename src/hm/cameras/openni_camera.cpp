// hm: compiled alone, for the macros of OpenNI
#include <OpenNI.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>

#include "hm/cameras/camera_driver.hpp"
#include "hm/cameras/frame_pairing.hpp"

namespace hm {
namespace {

using Kind = CameraEvent::Kind;

constexpr int kRate_hz = 30;
/// Automatic exposure has settled after so many images.
constexpr std::size_t kSettled = 30;

/// Starts the library; once is enough. It is not shut down: that unloads its drivers, and some have threads
/// that run on after their streams were stopped.
bool start_library() {
  static const bool is_ready = openni::OpenNI::initialize() == openni::STATUS_OK;
  return is_ready;
}

/// The library's account of its last error, in one line.
std::string last_error() {
  std::string text = openni::OpenNI::getExtendedError();
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::replace(text.begin(), text.end(), '\t', ' ');
  while (text.ends_with(' ')) text.pop_back();
  while (text.starts_with(' ')) text.erase(text.begin());
  return text;
}

/// Notices that a device is gone, on a thread of the library.
class Unplugged : public openni::OpenNI::DeviceDisconnectedListener {
 public:
  explicit Unplugged(std::string uri) : uri_(std::move(uri)) {
    openni::OpenNI::addDeviceDisconnectedListener(this);
  }
  ~Unplugged() override { openni::OpenNI::removeDeviceDisconnectedListener(this); }
  Unplugged(const Unplugged&) = delete;
  Unplugged& operator=(const Unplugged&) = delete;
  void onDeviceDisconnected(const openni::DeviceInfo* info) override {
    if (uri_ == info->getUri()) is_gone = true;
  }
  std::atomic<bool> is_gone = false;

 private:
  std::string uri_;
};

/// A stream is destroyed so long after it was stopped. Some drivers, OpenNI's own dummy device too, do not
/// wait for their threads, which sleep until the next image and then touch the stream once more.
constexpr std::chrono::milliseconds kLastImage{150};

/// Device and streams; closed in the reverse order.
struct OpenNiDevice {
  openni::Device device;
  openni::VideoStream depth, color;
  std::unique_ptr<Unplugged> unplugged;
  OpenNiDevice() = default;
  OpenNiDevice(const OpenNiDevice&) = delete;
  OpenNiDevice& operator=(const OpenNiDevice&) = delete;
  ~OpenNiDevice() {
    unplugged.reset();
    for (openni::VideoStream* stream : {&depth, &color})
      if (stream->isValid()) stream->stop();
    if (depth.isValid() || color.isValid()) std::this_thread::sleep_for(kLastImage);
    for (openni::VideoStream* stream : {&depth, &color})
      if (stream->isValid()) stream->destroy();
    if (device.isValid()) device.close();
  }
};

class OpenNiCamera : public CameraDriver {
 public:
  OpenNiCamera(std::unique_ptr<OpenNiDevice> device, const CameraRequest& request,
               CameraDescription description)
      : device_(std::move(device)), description_(std::move(description)), frames_(kRate_hz, request.after) {
    set_automatic(true);  // an earlier scan may have locked it
  }

  [[nodiscard]] CameraDescription describe() const override { return description_; }

  CameraEvent next(std::chrono::milliseconds timeout) override {
    return frames_.next(timeout, [this](std::chrono::milliseconds wait) { return add_image(wait); });
  }

 private:
  std::optional<CameraEvent> add_image(std::chrono::milliseconds wait) {
    if (device_->unplugged->is_gone) return CameraEvent{Kind::kFailed, {}, "the camera was unplugged"};
    std::array<openni::VideoStream*, 2> streams{&device_->depth, &device_->color};
    int ready = 0;
    const auto status =
        openni::OpenNI::waitForAnyStream(streams.data(), 2, &ready, static_cast<int>(wait.count()));
    if (status == openni::STATUS_TIME_OUT) return std::nullopt;
    openni::VideoFrameRef image;
    if (status != openni::STATUS_OK ||
        streams[static_cast<std::size_t>(ready)]->readFrame(&image) != openni::STATUS_OK)
      return CameraEvent{Kind::kFailed, {}, "the camera gives no more images: " + last_error()};
    return take(image, ready == 0);
  }

  std::optional<CameraEvent> take(const openni::VideoFrameRef& image, bool is_depth) {
    const int width = image.getWidth(), height = image.getHeight();
    const std::size_t row_bytes =
        static_cast<std::size_t>(width) * (is_depth ? sizeof(std::uint16_t) : sizeof(Rgb8));
    const Time stamp = frames_.clock.to_time({static_cast<std::int64_t>(image.getTimestamp()) * 1'000});
    const bool is_whole =
        image.getStrideInBytes() >= 0 && static_cast<std::size_t>(image.getStrideInBytes()) >= row_bytes &&
        image.getDataSize() >= 0 &&
        static_cast<std::size_t>(image.getDataSize()) >= row_bytes * static_cast<std::size_t>(height);
    if (!is_whole) {
      if (!is_depth) return std::nullopt;  // its depth image stays without colour, which is counted
      return CameraEvent{
          Kind::kIncomplete, {}, fmt::format("a depth image of {} bytes", image.getDataSize())};
    }
    if (is_depth) {
      DepthImage depth{Image<std::uint16_t>(width, height), description_.depth_unit_m};
      copy_rows(image, row_bytes, depth.units);
      frames_.pairing.add_depth(stamp, std::move(depth));
      return std::nullopt;
    }
    Image<Rgb8> color(width, height);
    copy_rows(image, row_bytes, color);
    frames_.pairing.add_color(stamp, std::move(color));
    if (++color_images_ == kSettled && set_automatic(false)) description_.exposure = ExposureControl::kLocked;
    return std::nullopt;
  }

  template <class Pixel>
  static void copy_rows(const openni::VideoFrameRef& from, std::size_t row_bytes, Image<Pixel>& to) {
    const auto* bytes = static_cast<const std::byte*>(from.getData());
    for (int y = 0; y < to.height(); ++y)
      std::memcpy(to.row(y).data(), bytes + static_cast<std::ptrdiff_t>(y) * from.getStrideInBytes(),
                  row_bytes);
  }

  /// Lets exposure and white balance adapt, or keeps what the camera has found. False: the exposure cannot be
  /// set.
  bool set_automatic(bool on) {
    openni::CameraSettings* settings = device_->color.getCameraSettings();
    if (!settings || !settings->isValid()) return false;
    settings->setAutoWhiteBalanceEnabled(on);
    return settings->setAutoExposureEnabled(on) == openni::STATUS_OK;
  }

  std::unique_ptr<OpenNiDevice> device_;
  CameraDescription description_;
  DeviceFrames frames_;
  std::size_t color_images_ = 0;
};

/// Chooses the mode nearest to a size at 30 Hz, in one of these pixel formats, earlier ones first.
std::optional<openni::VideoMode> choose_mode(const openni::SensorInfo& sensor, int width,
                                             std::span<const openni::PixelFormat> formats) {
  std::optional<openni::VideoMode> best;
  long best_cost = 0;
  const auto& modes = sensor.getSupportedVideoModes();
  for (int i = 0; i < modes.getSize(); ++i) {
    const auto format = std::find(formats.begin(), formats.end(), modes[i].getPixelFormat());
    if (format == formats.end()) continue;
    const long cost = 100L * std::abs(modes[i].getResolutionX() - width) +
                      10L * std::abs(modes[i].getFps() - kRate_hz) + (format - formats.begin());
    if (!best || cost < best_cost) best = modes[i], best_cost = cost;
  }
  return best;
}

Result<void> start_stream(OpenNiDevice& opened, openni::SensorType type, openni::VideoStream& stream,
                          int width, std::span<const openni::PixelFormat> formats) {
  const bool is_depth = type == openni::SENSOR_DEPTH;
  const std::string where = fmt::format("OpenNI, {}", is_depth ? "depth" : "colour");
  const openni::SensorInfo* sensor = opened.device.getSensorInfo(type);
  if (!sensor) return fail(ErrorCode::kUnsupported, where, "the device has no such sensor");
  const auto mode = choose_mode(*sensor, width, formats);
  if (!mode)
    return fail(ErrorCode::kUnsupported, where, "the device gives no images of a format that is known");
  // A device with one mode need not have a way to set it.
  const auto is_usable = [&] {
    const auto now = stream.getVideoMode().getPixelFormat();
    return std::find(formats.begin(), formats.end(), now) != formats.end();
  };
  if (stream.create(opened.device, type) != openni::STATUS_OK ||
      (stream.setVideoMode(*mode) != openni::STATUS_OK && !is_usable()))
    return fail(ErrorCode::kUnreadable, where, "cannot be set up: {}", last_error());
  stream.setMirroringEnabled(false);  // some devices mirror unless they are told
  return {};
}

/// In thousandths: the field of view is a number of single precision.
double focal_px(int size_px, float field_of_view_rad) {
  return std::round(500 * size_px / std::tan(0.5 * static_cast<double>(field_of_view_rad))) / 1000;
}

/// The camera as the field of view has it, of the stream whose view the images have.
Result<PinholeCamera> camera_of(const openni::VideoStream& stream, const CameraRequest& request) {
  const openni::VideoMode mode = stream.getVideoMode();
  PinholeCamera camera;
  camera.width = mode.getResolutionX(), camera.height = mode.getResolutionY();
  if (request.intrinsics) {
    if (request.intrinsics->width != camera.width || request.intrinsics->height != camera.height)
      return fail(ErrorCode::kUnsupported, "OpenNI", "the images are {} x {}; the intrinsics are of {} x {}",
                  camera.width, camera.height, request.intrinsics->width, request.intrinsics->height);
    return *request.intrinsics;
  }
  const float horizontal = stream.getHorizontalFieldOfView(), vertical = stream.getVerticalFieldOfView();
  const bool is_known = horizontal > 0.1F && horizontal < 3 && vertical > 0.1F && vertical < 3;
  if (!is_known && request.calibration.empty())
    return fail(ErrorCode::kUsage, "OpenNI",
                "the device does not say its field of view: give --intrinsics, or --calibration");
  camera.fx = is_known ? focal_px(camera.width, horizontal) : camera.width;
  camera.fy = is_known ? focal_px(camera.height, vertical) : camera.width;
  camera.cx = 0.5 * (camera.width - 1), camera.cy = 0.5 * (camera.height - 1);
  return camera;
}

/// Asks the device for registered and synchronous images; the notes say what it cannot.
void register_images(OpenNiDevice& opened, DepthFormat format, CameraDescription& description) {
  openni::Device& device = opened.device;
  const auto registration = openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR;
  const bool wants_raw = format != DepthFormat::kRegistered;
  const bool is_registered = !wants_raw && device.isImageRegistrationModeSupported(registration) &&
                             device.setImageRegistrationMode(registration) == openni::STATUS_OK;
  if (wants_raw) device.setImageRegistrationMode(openni::IMAGE_REGISTRATION_OFF);
  if (!wants_raw && !is_registered)
    description.notes.emplace_back(
        "the device cannot register depth to colour: colours will be shifted unless a calibration is given");
  device.setDepthColorSyncEnabled(true);  // not every device can; images are paired by their stamps
}

CameraDescription describe_device(const OpenNiDevice& opened) {
  const openni::DeviceInfo& info = opened.device.getDeviceInfo();
  CameraDescription description;
  description.name = fmt::format("openni {} {} ({})", info.getVendor(), info.getName(), info.getUri());
  description.rate_hz = kRate_hz;
  description.exposure = ExposureControl::kAutomatic;
  description.is_kinect = true;
  const bool is_fine = opened.depth.getVideoMode().getPixelFormat() == openni::PIXEL_FORMAT_DEPTH_100_UM;
  description.depth_unit_m = is_fine ? 1e-4 : 1e-3;
  return description;
}

}  // namespace

Result<std::unique_ptr<CameraDriver>> open_openni(const std::string& device, const CameraRequest& request,
                                                  DepthFormat format) {
  auto opened = std::make_unique<OpenNiDevice>();
  if (!start_library()) return fail(ErrorCode::kInternal, "OpenNI", "does not start: {}", last_error());
  if (opened->device.open(device.empty() ? openni::ANY_DEVICE : device.c_str()) != openni::STATUS_OK)
    return fail(ErrorCode::kNotFound, "--camera openni", "no camera can be opened: {}", last_error());
  const int width = request.intrinsics ? request.intrinsics->width : 640;
  constexpr std::array kDepthFormats{openni::PIXEL_FORMAT_DEPTH_1_MM, openni::PIXEL_FORMAT_DEPTH_100_UM};
  constexpr std::array kColorFormats{openni::PIXEL_FORMAT_RGB888};
  OpenNiDevice& all = *opened;
  if (const auto made = start_stream(all, openni::SENSOR_DEPTH, all.depth, width, kDepthFormats); !made)
    return forward_error(made);
  if (const auto made = start_stream(all, openni::SENSOR_COLOR, all.color, width, kColorFormats); !made)
    return forward_error(made);
  CameraDescription description = describe_device(all);
  if (request.depth_units_per_m) description.depth_unit_m = 1 / *request.depth_units_per_m;
  register_images(all, format, description);
  auto camera = camera_of(all.color, request);
  if (!camera) return forward_error(camera);
  description.camera = *camera;
  description.intrinsics_source = request.intrinsics ? "given" : "field of view of the device";
  all.unplugged = std::make_unique<Unplugged>(all.device.getDeviceInfo().getUri());
  for (openni::VideoStream* stream : {&all.depth, &all.color})
    if (stream->start() != openni::STATUS_OK)
      return fail(ErrorCode::kUnreadable, "OpenNI", "a stream does not start: {}", last_error());
  return std::make_unique<OpenNiCamera>(std::move(opened), request, std::move(description));
}

std::vector<std::string> list_openni() {
  std::vector<std::string> devices;
  if (!start_library()) return devices;
  openni::Array<openni::DeviceInfo> found;
  openni::OpenNI::enumerateDevices(&found);
  for (int i = 0; i < found.getSize(); ++i) devices.emplace_back(found[i].getUri());
  return devices;
}

}  // namespace hm
