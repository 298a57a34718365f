#include "hm/io/rgbd/recording.hpp"

#include <algorithm>

#include "hm/depth_camera/frame_calibration.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/io/laser/laser_guess.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rgbd/recording_listing.hpp"

namespace hm {
namespace {

/// Resamples colour to the size of depth: the pixel that covers the centre of each depth pixel.
Image<Rgb8> resampled(const Image<Rgb8>& image, int width, int height) {
  if (image.width() == width && image.height() == height) return image;
  Image<Rgb8> result(width, height);
  const auto source = [](int i, int from, int to) {
    return static_cast<int>((2 * static_cast<std::int64_t>(i) + 1) * from /
                            (2 * static_cast<std::int64_t>(to)));
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      result(x, y) = image(source(x, image.width(), width), source(y, image.height(), height));
  return result;
}

/// Recording with one image file per frame and stream.
class ImageRecording final : public Recording {
 public:
  ImageRecording(detail::RecordingListing listing, std::optional<FrameCalibration> calibration)
      : info_(std::move(listing.info)),
        frames_(std::move(listing.frames)),
        calibration_(std::move(calibration)) {}
  [[nodiscard]] const RecordingInfo& info() const override { return info_; }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override;
  [[nodiscard]] Result<RgbdFrame> read_depth(std::size_t index) const override;

 private:
  [[nodiscard]] Result<Image<std::uint16_t>> read_depth_file(const std::filesystem::path& path) const;
  [[nodiscard]] Result<Image<Rgb8>> read_color_file(const std::filesystem::path& path) const;

  RecordingInfo info_;
  std::vector<detail::ListedFrame> frames_;
  std::optional<FrameCalibration> calibration_;  ///< of a calibration, or of a camera with distortion
};

Result<Image<std::uint16_t>> ImageRecording::read_depth_file(const std::filesystem::path& path) const {
  auto depth = read_depth_image(path);
  if (!depth) return depth;
  if (depth->width() != info_.camera.width || depth->height() != info_.camera.height)
    return fail(ErrorCode::kCorrupted, path, "is {} x {}, the recording's camera {} x {}", depth->width(),
                depth->height(), info_.camera.width, info_.camera.height);
  return depth;
}

Result<Image<Rgb8>> ImageRecording::read_color_file(const std::filesystem::path& path) const {
  auto color = read_color_image(path);
  if (!color) return color;
  if (color->width() != info_.camera.width || color->height() != info_.camera.height)
    color = resampled(*color, info_.camera.width, info_.camera.height);
  if (calibration_) return calibration_->calibrate(std::move(*color));
  return color;
}

Result<RgbdFrame> ImageRecording::read_depth(std::size_t index) const {
  HM_CHECK(index < frames_.size(), "frame {} of {}", index, frames_.size());
  const detail::ListedFrame& listed = frames_[index];
  RgbdFrame frame;
  frame.index = index;
  frame.stamp = listed.stamp;
  frame.color_stamp = listed.color_stamp;
  frame.T_world_camera = listed.T_world_camera;
  auto depth = read_depth_file(listed.depth);
  if (!depth) return forward_error(depth);
  frame.depth = {std::move(*depth), info_.depth_unit_m};
  if (calibration_) frame.depth = calibration_->calibrate(std::move(frame.depth));
  return frame;
}

Result<RgbdFrame> ImageRecording::read(std::size_t index) const {
  auto frame = read_depth(index);
  if (!frame || frames_[index].color.empty()) return frame;
  auto color = read_color_file(frames_[index].color);
  if (!color) return forward_error(color);
  frame->color = std::move(*color);
  return frame;
}

/// Error for a path without depth images.
tl::unexpected<Error> not_depth_images(const std::filesystem::path& path) {
  std::error_code ignored;
  if (is_laser_recording(path))
    return fail(ErrorCode::kUnsupported, path,
                "this is a laser recording, not depth images: `hm laser` makes a map of it");
  if (const std::string several = detail::several_laser_files(detail::laser_files_in(path)); !several.empty())
    return fail(ErrorCode::kUsage, path, "{}", several);
  const std::string hint = detail::hint_of_place(path);
  if (!std::filesystem::is_directory(path, ignored))
    return fail(ErrorCode::kUnsupported, path, "{}",
                hint.empty() ? "a recording is a folder; this is a file" : hint);
  if (!hint.empty()) return fail(ErrorCode::kNotFound, path, "no recording in this folder; {}", hint);
  return fail(
      ErrorCode::kNotFound, path,
      "no recording found; looked for depth.txt or associations.txt (TUM RGB-D, ICL-NUIM), for "
      "frame-XXXXXX.depth.png or .pgm, here or in seq-XX (7-Scenes), and for depth/ or results/depth* with "
      "images named by stamp or number");
}

Result<detail::RecordingListing> list_recording(const std::filesystem::path& path,
                                                const RecordingOptions& options) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    return fail(ErrorCode::kNotFound, path, "there is no such folder");
  if (!std::filesystem::is_directory(path, ignored)) return not_depth_images(path);
  const auto is_kind = [&](RecordingKind kind, bool (*looks_like)(const std::filesystem::path&)) {
    return options.kind ? *options.kind == kind : looks_like(path);
  };
  if (is_kind(RecordingKind::kTumRgbd, detail::looks_like_tum)) return detail::list_tum(path, options);
  if (is_kind(RecordingKind::kIclNuim, detail::looks_like_icl_nuim))
    return detail::list_icl_nuim(path, options);
  if (is_kind(RecordingKind::kSevenScenes, detail::looks_like_seven_scenes))
    return detail::list_seven_scenes(path, options);
  return not_depth_images(path);
}

void count_frames(detail::RecordingListing& listing) {
  RecordingInfo& info = listing.info;
  info.frame_count = listing.frames.size();
  const auto check_there = [&](const std::filesystem::path& path) {
    std::error_code ignored;
    if (path.empty() || std::filesystem::exists(path, ignored)) return;
    if (info.missing_images++ == 0) info.first_missing_image = path.lexically_relative(info.path).string();
  };
  for (const detail::ListedFrame& frame : listing.frames) {
    if (!frame.color.empty()) ++info.paired_count;
    if (frame.T_world_camera) ++info.posed_count;
    info.frame_poses.push_back(frame.T_world_camera);
    check_there(frame.depth);
    check_there(frame.color);
  }
}

}  // namespace

std::string_view to_string(RecordingKind kind) {
  switch (kind) {
    case RecordingKind::kTumRgbd:
      return "TUM RGB-D";
    case RecordingKind::kSevenScenes:
      return "7-Scenes";
    case RecordingKind::kIclNuim:
      return "ICL-NUIM";
  }
  return "unknown";
}

void detail::add_note(RecordingInfo& info, std::string_view note) {
  if (!info.notes.empty()) info.notes += '\n';
  info.notes += note;
}

void detail::add_assumption(RecordingInfo& info, const std::string& assumption) {
  info.assumptions.push_back(assumption);
  add_note(info, assumption);
}

void detail::add_skipped(RecordingInfo& info, const std::vector<SkippedLines>& skipped) {
  for (const SkippedLines& lines : skipped) {
    info.skipped.push_back(lines);
    add_note(info, to_string(lines));
  }
}

Result<std::unique_ptr<Recording>> open_recording(const std::filesystem::path& path,
                                                  const RecordingOptions& options) {
  RecordingOptions with_camera = options;
  const auto found = detail::find_calibration(path, with_camera);
  if (!found) return forward_error(found);
  auto listing = list_recording(path, with_camera);
  if (!listing) return forward_error(listing);
  if (listing->frames.empty()) return fail(ErrorCode::kNotFound, path, "the recording holds no depth image");
  if (*found) listing->info.camera_source = (*found)->path.filename().string();
  if (auto fits = detail::fit_camera_to_images(*listing); !fits) return forward_error(fits);
  if (!*found) detail::note_stretched_color(*listing);
  std::optional<FrameCalibration> calibration;
  if (*found) {
    auto applied = detail::apply_calibration(**found, *listing);
    if (!applied) return forward_error(applied);
    calibration = std::move(*applied);
  } else if (!listing->info.camera.distortion.is_zero()) {
    RgbdCalibration lens;
    lens.color_camera = listing->info.camera;
    auto rectified = FrameCalibration::make(lens, lens.color_camera->width, lens.color_camera->height);
    if (!rectified) return forward_error(rectified);
    calibration = std::move(*rectified);
  }
  count_frames(*listing);
  return std::make_unique<ImageRecording>(std::move(*listing), std::move(calibration));
}

}  // namespace hm
