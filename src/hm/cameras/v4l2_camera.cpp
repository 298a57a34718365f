// hm: compiled alone, for the macros of V4L2
#include "hm/cameras/v4l2_camera.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <utility>

#include "hm/cameras/frame_pairing.hpp"
#include "hm/cameras/video_stream.hpp"
#include "hm/cameras/yuv.hpp"
#include "hm/io/image/image_file.hpp"

namespace hm {
namespace {

using Kind = CameraEvent::Kind;

constexpr std::array<std::uint32_t, 1> kDepthFormats{V4L2_PIX_FMT_Z16};
constexpr std::array<std::uint32_t, 2> kColorFormats{V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
constexpr double kRate_hz = 30;
/// Automatic exposure has settled after so many images.
constexpr std::size_t kSettled = 30;

class V4l2Camera : public CameraDriver {
 public:
  V4l2Camera(VideoStream depth, VideoStream color, const CameraRequest& request,
             CameraDescription description)
      : depth_(std::move(depth)),
        color_(std::move(color)),
        description_(std::move(description)),
        frames_(kRate_hz, request.after) {
    release_exposure();
  }

  [[nodiscard]] CameraDescription describe() const override { return description_; }

  CameraEvent next(std::chrono::milliseconds timeout) override {
    return frames_.next(timeout, [this](std::chrono::milliseconds wait) -> std::optional<CameraEvent> {
      const VideoInput input = wait_for_input(depth_.device(), color_.device(), wait);
      if (input.first)
        if (auto event = take(depth_)) return event;
      return input.second ? take(color_) : std::nullopt;
    });
  }

 private:
  /// Takes an image of one stream; an event where that does not work.
  std::optional<CameraEvent> take(VideoStream& stream) {
    const auto picture = stream.take();
    if (!picture) return CameraEvent{Kind::kFailed, {}, to_string(picture.error())};
    if (!*picture) return std::nullopt;
    return &stream == &depth_ ? take_depth(**picture) : take_color(**picture);
  }

  std::optional<CameraEvent> take_depth(const VideoStream::Picture& picture) {
    const VideoFormat& format = depth_.format();
    const std::size_t row_bytes = 2 * static_cast<std::size_t>(format.width);
    const std::size_t least = format.row_bytes * static_cast<std::size_t>(format.height - 1) + row_bytes;
    if (picture.is_damaged || picture.bytes.size() < least)
      return CameraEvent{Kind::kIncomplete,
                         {},
                         fmt::format("a depth image of {} bytes instead of {}", picture.bytes.size(), least)};
    DepthImage depth{Image<std::uint16_t>(format.width, format.height), description_.depth_unit_m};
    for (int y = 0; y < format.height; ++y)
      std::memcpy(depth.units.row(y).data(),
                  picture.bytes.data() + static_cast<std::size_t>(y) * format.row_bytes, row_bytes);
    frames_.pairing.add_depth(frames_.clock.to_time(picture.stamp), std::move(depth));
    return std::nullopt;
  }

  /// A colour image that cannot be used leaves its depth image without one, which is counted.
  std::optional<CameraEvent> take_color(const VideoStream::Picture& picture) {
    const VideoFormat& format = color_.format();
    const Time stamp = frames_.clock.to_time(picture.stamp);
    if (++color_images_ == kSettled) lock_exposure();
    const std::size_t least = format.row_bytes * static_cast<std::size_t>(format.height - 1) +
                              2 * static_cast<std::size_t>(format.width);
    if (picture.is_damaged) return std::nullopt;
    if (format.pixel_format == V4L2_PIX_FMT_MJPEG) {
      auto image = decode_color_image(
          {reinterpret_cast<const std::uint8_t*>(picture.bytes.data()), picture.bytes.size()},
          color_.device().name());
      if (image) frames_.pairing.add_color(stamp, std::move(*image));
    } else if (picture.bytes.size() >= least) {
      frames_.pairing.add_color(stamp,
                                yuyv_to_rgb(picture.bytes, format.width, format.height, format.row_bytes));
    }
    return std::nullopt;
  }

  /// Lets exposure and white balance adapt: what an earlier scan has locked stays locked in the device.
  void release_exposure() {
    if (!color_.set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY))
      color_.set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_AUTO);
    color_.set_control(V4L2_CID_AUTO_WHITE_BALANCE, 1);
  }

  /// Keeps the exposure and the white balance that the camera has found.
  void lock_exposure() {
    const auto exposure = color_.control(V4L2_CID_EXPOSURE_ABSOLUTE);
    const bool is_locked = color_.set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL);
    if (is_locked && exposure) color_.set_control(V4L2_CID_EXPOSURE_ABSOLUTE, *exposure);
    color_.set_control(V4L2_CID_AUTO_WHITE_BALANCE, 0);
    description_.exposure = is_locked ? ExposureControl::kLocked : ExposureControl::kAutomatic;
  }

  VideoStream depth_, color_;
  CameraDescription description_;
  DeviceFrames frames_;
  std::size_t color_images_ = 0;
};

CameraDescription describe_streams(const VideoStream& depth, const CameraRequest& request) {
  CameraDescription description;
  description.name = fmt::format("v4l2 {} ({})", depth.card(), depth.device().name());
  if (request.intrinsics) {
    description.camera = *request.intrinsics;
    description.intrinsics_source = "given";
  }
  description.camera.width = depth.format().width;
  description.camera.height = depth.format().height;
  description.depth_unit_m = request.depth_units_per_m ? 1 / *request.depth_units_per_m : 1e-3;
  description.rate_hz = kRate_hz;
  description.exposure = ExposureControl::kAutomatic;
  if (request.calibration.empty())
    description.notes.emplace_back("depth is taken as registered to colour: V4L2 does not say whether it is");
  return description;
}

/// Properties of a device, to find the two of a camera.
struct VideoNode {
  std::string path, bus;
  bool gives_depth = false, gives_color = false;
};

std::vector<VideoNode> video_nodes() {
  std::vector<VideoNode> nodes;
  for (const std::string& path : video_device_paths()) {
    auto device = open_video_device(path);
    v4l2_capability capability{};
    if (!device || (*device)->control(VIDIOC_QUERYCAP, &capability) != 0) continue;
    VideoNode node{path, reinterpret_cast<const char*>(capability.bus_info), false, false};
    for (std::uint32_t i = 0;; ++i) {
      v4l2_fmtdesc description{};
      description.index = i;
      description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      if ((*device)->control(VIDIOC_ENUM_FMT, &description) != 0) break;
      node.gives_depth |= description.pixelformat == V4L2_PIX_FMT_Z16;
      node.gives_color |= std::find(kColorFormats.begin(), kColorFormats.end(), description.pixelformat) !=
                          kColorFormats.end();
    }
    nodes.push_back(std::move(node));
  }
  return nodes;
}

}  // namespace

Result<std::unique_ptr<CameraDriver>> open_v4l2(VideoDevices devices, const CameraRequest& request) {
  if (!request.intrinsics && request.calibration.empty())
    return fail(ErrorCode::kUsage, "--camera v4l2",
                "V4L2 does not give the camera's intrinsics: give --calibration, or --intrinsics of images "
                "that are registered");
  VideoFormat wanted{0, 640, 480, 0, 0};
  if (request.intrinsics)
    wanted.width = request.intrinsics->width, wanted.height = request.intrinsics->height;
  auto depth = VideoStream::start(std::move(devices.depth), kDepthFormats, wanted, kRate_hz);
  if (!depth) return forward_error(depth);
  auto color = VideoStream::start(std::move(devices.color), kColorFormats, wanted, kRate_hz);
  if (!color) return forward_error(color);
  if (color->format().width != depth->format().width || color->format().height != depth->format().height)
    return fail(ErrorCode::kUnsupported, color->device().name(),
                "gives colour images of {} x {}, depth images are {} x {}", color->format().width,
                color->format().height, depth->format().width, depth->format().height);
  CameraDescription description = describe_streams(*depth, request);
  if (request.intrinsics &&
      (description.camera.width != wanted.width || description.camera.height != wanted.height))
    return fail(ErrorCode::kUnsupported, depth->device().name(),
                "gives depth images of {} x {}; the intrinsics are of {} x {}", description.camera.width,
                description.camera.height, wanted.width, wanted.height);
  return std::make_unique<V4l2Camera>(std::move(*depth), std::move(*color), request, std::move(description));
}

Result<std::unique_ptr<CameraDriver>> open_v4l2(const std::string& device, const CameraRequest& request) {
  std::string paths = device;
  if (paths.empty()) {
    const auto found = list_v4l2();
    if (found.empty())
      return fail(ErrorCode::kNotFound, "--camera v4l2",
                  "no depth camera found: no device of /dev/video* gives Z16 images beside one with colour");
    paths = found.front();
  }
  const std::size_t comma = paths.find(',');
  if (comma == std::string::npos)
    return fail(ErrorCode::kUsage, "--camera v4l2", "names two devices: v4l2:DEPTH,COLOR");
  auto depth = open_video_device(paths.substr(0, comma));
  if (!depth) return forward_error(depth);
  auto color = open_video_device(paths.substr(comma + 1));
  if (!color) return forward_error(color);
  return open_v4l2(VideoDevices{std::move(*depth), std::move(*color)}, request);
}

std::vector<std::string> list_v4l2() {
  const std::vector<VideoNode> nodes = video_nodes();
  std::vector<std::string> found;
  for (const VideoNode& depth : nodes) {
    const auto color = std::find_if(nodes.begin(), nodes.end(), [&](const VideoNode& node) {
      return node.gives_color && !node.gives_depth && node.bus == depth.bus;
    });
    if (depth.gives_depth && color != nodes.end()) found.push_back(depth.path + "," + color->path);
  }
  return found;
}

}  // namespace hm
