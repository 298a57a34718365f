#include "hm/depth_camera/frame_calibration.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/rgbd/recording_listing.hpp"

namespace hm::detail {
namespace {

std::string describe(const RgbdCalibration& calibration, const std::string& source) {
  std::string words = fmt::format("{}: ", source);
  if (calibration.disparity) words += "raw disparity turned into depth, ";
  words += "rectified";
  if (calibration.depth_correction)
    words += fmt::format(", depth corrected ({})",
                         kDepthFitModeNames[static_cast<std::size_t>(calibration.depth_correction->mode)]);
  if (calibration.registers_depth()) words += ", depth registered to the colour camera";
  return words;
}

void move_poses(RecordingListing& listing, const SE3& T_given_camera) {
  for (ListedFrame& frame : listing.frames)
    if (frame.T_world_camera) frame.T_world_camera = *frame.T_world_camera * T_given_camera;
  for (Trajectory* poses : {&listing.info.trajectory, &listing.info.truth})
    for (StampedPose& pose : *poses) pose.T_world_base = pose.T_world_base * T_given_camera;
}

}  // namespace

Result<std::optional<FoundCalibration>> find_calibration(const std::filesystem::path& folder,
                                                         RecordingOptions& options) {
  FoundCalibration found;
  if (!options.calibration.empty()) {
    if (options.camera)
      return fail(ErrorCode::kUsage, options.calibration, "intrinsics and a calibration are both given");
    found.path = options.calibration;
  } else if (const auto beside = find_beside(folder, kCalibrationFileName); beside && !options.camera) {
    found.path = *beside;
  } else {
    return std::nullopt;
  }
  auto calibration = read_calibration(found.path);
  if (!calibration) return forward_error(calibration);
  found.calibration = std::move(*calibration);
  options.camera =
      found.calibration.depth_camera ? found.calibration.depth_camera : found.calibration.color_camera;
  return found;
}

Result<FrameCalibration> apply_calibration(const FoundCalibration& found, RecordingListing& listing) {
  RecordingInfo& info = listing.info;
  auto frames = FrameCalibration::make(found.calibration, info.camera.width, info.camera.height);
  if (!frames) {
    frames.error().where = found.path;
    return frames;
  }
  info.camera = frames->camera();
  info.camera_source = found.path.filename();
  info.calibration = describe(found.calibration, info.camera_source);
  if (found.calibration.registers_depth() && found.calibration.poses_of == PosesOf::kDepthCamera)
    move_poses(listing, found.calibration.T_color_depth->inverse());
  return frames;
}

}  // namespace hm::detail
