// A driver for OpenNI 2 whose one device plays a recording: depth in millimetres and colour, registered, at
// the recording's pace. $HM_OPENNI_RECORDING names it; with $HM_OPENNI_FRAMES the device is unplugged after
// so many.
#define XN_NEW(type, argument) new type(argument)
#define XN_DELETE(pointer) delete pointer
#include <Driver/OniDriverAPI.h>
#include <OniProperties.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <thread>

#include "hm/core/check.hpp"
#include "hm/io/rgbd/recording.hpp"

namespace {

using Clock = std::chrono::steady_clock;

/// The recording, and how much of it is played.
struct Played {
  Played() {
    const char* path = std::getenv("HM_OPENNI_RECORDING");
    auto opened = hm::open_recording(path ? path : "");
    if (opened) recording = std::move(*opened);
    if (const char* text = std::getenv("HM_OPENNI_FRAMES"))
      frames = std::strtoul(text, nullptr, 10), is_unplugged = true;
    else if (recording)
      frames = recording->info().frame_count;
  }
  std::unique_ptr<hm::Recording> recording;
  std::size_t frames = 0;
  bool is_unplugged = false;
};

class ReplayDriver;

class ReplayStream : public oni::driver::StreamBase {
 public:
  ReplayStream(ReplayDriver& driver, OniSensorType type) : driver_(driver), type_(type) {}
  ~ReplayStream() override { stop(); }
  ReplayStream(const ReplayStream&) = delete;
  ReplayStream& operator=(const ReplayStream&) = delete;

  OniStatus start() override {
    thread_ = std::jthread([this](const std::stop_token& stop) { play(stop); });
    return ONI_STATUS_OK;
  }
  void stop() override { thread_ = {}; }
  OniBool isPropertySupported(int) override { return TRUE; }
  OniStatus setProperty(int, const void*, int) override { return ONI_STATUS_OK; }
  OniStatus getProperty(int id, void* data, int* size) override;

 private:
  void play(const std::stop_token& stop);
  void give(const hm::RgbdFrame& frame, int number);

  ReplayDriver& driver_;
  OniSensorType type_;
  std::jthread thread_;
};

OniVideoMode mode_of(const hm::PinholeCamera& camera, OniSensorType type) {
  return {type == ONI_SENSOR_DEPTH ? ONI_PIXEL_FORMAT_DEPTH_1_MM : ONI_PIXEL_FORMAT_RGB888, camera.width,
          camera.height, 30};
}

class ReplayDevice : public oni::driver::DeviceBase {
 public:
  ReplayDevice(ReplayDriver& driver, const hm::PinholeCamera& camera) : driver_(driver) {
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      const OniSensorType type = i == 0 ? ONI_SENSOR_DEPTH : ONI_SENSOR_COLOR;
      modes_[i] = mode_of(camera, type);
      sensors_[i] = {type, 1, &modes_[i]};
    }
  }
  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override {
    *sensors = sensors_.data();
    *count = static_cast<int>(sensors_.size());
    return ONI_STATUS_OK;
  }
  oni::driver::StreamBase* createStream(OniSensorType type) override {
    return new ReplayStream(driver_, type);
  }
  void destroyStream(oni::driver::StreamBase* stream) override { delete stream; }
  OniBool isPropertySupported(int id) override { return id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION; }
  OniStatus setProperty(int, const void*, int) override { return ONI_STATUS_OK; }
  OniBool isImageRegistrationModeSupported(OniImageRegistrationMode) override { return TRUE; }

 private:
  ReplayDriver& driver_;
  std::array<OniSensorInfo, 2> sensors_{};
  std::array<OniVideoMode, 2> modes_{};
};

class ReplayDriver : public oni::driver::DriverBase {
 public:
  explicit ReplayDriver(OniDriverServices* services) : DriverBase(services) {
    std::strcpy(info_.uri, "replay");
    std::strcpy(info_.vendor, "housemartin");
    std::strcpy(info_.name, "replay of a recording");
  }
  OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                       oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
    DriverBase::initialize(connected, disconnected, changed, cookie);
    if (played.recording) deviceConnected(&info_);
    return ONI_STATUS_OK;
  }
  oni::driver::DeviceBase* deviceOpen(const char*, const char*) override {
    begun = Clock::now() + std::chrono::milliseconds(100);
    return new ReplayDevice(*this, played.recording->camera());
  }
  void deviceClose(oni::driver::DeviceBase* device) override { delete device; }
  void shutdown() override {}
  void unplug() {
    if (!is_gone.exchange(true)) deviceDisconnected(&info_);
  }

  Played played;
  std::atomic<bool> is_gone = false;
  Clock::time_point begun;  ///< when the first frame of the open device is due

 private:
  OniDeviceInfo info_{};
};

OniStatus ReplayStream::getProperty(int id, void* data, int* size) {
  const hm::PinholeCamera camera = driver_.played.recording->camera();
  const auto give_value = [&](const auto& value) {
    if (*size < static_cast<int>(sizeof value)) return ONI_STATUS_BAD_PARAMETER;
    std::memcpy(data, &value, sizeof value);
    *size = static_cast<int>(sizeof value);
    return ONI_STATUS_OK;
  };
  switch (id) {
    case ONI_STREAM_PROPERTY_VIDEO_MODE:
      return give_value(mode_of(camera, type_));
    case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
      return give_value(static_cast<float>(2 * std::atan(0.5 * camera.width / camera.fx)));
    case ONI_STREAM_PROPERTY_VERTICAL_FOV:
      return give_value(static_cast<float>(2 * std::atan(0.5 * camera.height / camera.fy)));
    case ONI_STREAM_PROPERTY_STRIDE:
      return give_value(camera.width * (type_ == ONI_SENSOR_DEPTH ? 2 : 3));
    default:
      return ONI_STATUS_NOT_SUPPORTED;
  }
}

void ReplayStream::play(const std::stop_token& stop) {
  const Played& played = driver_.played;
  const auto& stamps = played.recording->info().stamps;
  for (std::size_t i = 0; i < std::min(played.frames, stamps.size()); ++i) {
    const std::chrono::nanoseconds since_first{(stamps[i] - stamps.front()).ns};
    std::this_thread::sleep_until(driver_.begun + since_first);
    if (stop.stop_requested()) return;
    if (const auto frame = played.recording->read(i)) give(*frame, static_cast<int>(i));
  }
  if (played.is_unplugged) driver_.unplug();
}

void ReplayStream::give(const hm::RgbdFrame& from, int number) {
  OniFrame* frame = getServices().acquireFrame();
  if (!frame) return;
  const bool is_depth = type_ == ONI_SENSOR_DEPTH;
  const hm::Time first = driver_.played.recording->info().stamps.front();
  frame->frameIndex = number;
  frame->sensorType = type_;
  frame->timestamp =
      static_cast<std::uint64_t>(((is_depth ? from.stamp : from.color_stamp) - first).ns / 1'000) + 1'000'000;
  frame->width = from.depth.width();
  frame->height = from.depth.height();
  frame->videoMode = mode_of(driver_.played.recording->camera(), type_);
  frame->croppingEnabled = FALSE;
  frame->stride = from.depth.width() * (is_depth ? 2 : 3);
  const std::size_t bytes = static_cast<std::size_t>(frame->stride) * static_cast<std::size_t>(frame->height);
  HM_CHECK(static_cast<std::size_t>(frame->dataSize) >= bytes, "{} of {} bytes", frame->dataSize, bytes);
  frame->dataSize = static_cast<int>(bytes);
  if (is_depth)
    std::ranges::transform(
        from.depth.units.pixels(), static_cast<std::uint16_t*>(frame->data),
        [&](auto units) { return static_cast<std::uint16_t>(std::lround(units * from.depth.unit_m * 1e3)); });
  else
    std::memcpy(frame->data, from.color.data(), bytes);
  raiseNewFrame(frame);
  getServices().releaseFrame(frame);
}

}  // namespace

ONI_EXPORT_DRIVER(ReplayDriver)
