#include "flags/recording_flags.hpp"

#include "hm/io/camera/camera_file.hpp"
#include "program.hpp"

void RecordingFlags::add_to(Command command) {
  command.add_option("--kind", kind, "kind of recording: tum, 7scenes, icl (default: guessed)")
      .one_of({"tum", "7scenes", "icl"})
      .group("Recording");
  add_images_to(command, "Recording", "folder");
}

void RecordingFlags::add_camera_to(Command command) { add_images_to(command, "Camera", "camera"); }

void RecordingFlags::add_images_to(Command command, const std::string& group, const std::string& source) {
  command
      .add_option("--calibration", calibration,
                  "calibration.toml to apply to every image (default: " +
                      (source == "folder" ? std::string("the one in the folder)") : std::string("none)")))
      .group(group);
  command.add_option("--intrinsics", intrinsics, "fx fy cx cy in pixels (default: from the " + source + ")")
      .expected(4)
      .group(group);
  command
      .add_option("--size", size_px,
                  "width and height of the images, with --intrinsics (default: " +
                      std::string(source == "folder" ? "those of the depth images)" : "640 480)"))
      .expected(2)
      .group(group);
  command
      .add_option("--depth-units-per-m", depth_units_per_m,
                  "value in the depth images for one metre (default: from the " + source + ")")
      .above_zero()
      .group(group);
}

void RecordingFlags::add_force_to(Command command) {
  command.add_flag("--force", force, "run even though the recording looks unusable").group("Recording");
}

hm::Result<hm::RecordingOptions> RecordingFlags::options() const {
  hm::RecordingOptions options;
  if (kind == "tum") options.kind = hm::RecordingKind::kTumRgbd;
  if (kind == "7scenes") options.kind = hm::RecordingKind::kSevenScenes;
  if (kind == "icl") options.kind = hm::RecordingKind::kIclNuim;
  options.calibration = calibration;
  if (depth_units_per_m > 0) {
    if (const auto checked = hm::check_given_depth_scale(depth_units_per_m); !checked)
      return hm::forward_error(checked);
    options.depth_units_per_m = depth_units_per_m;
  }
  if (intrinsics.size() == 4) {
    hm::PinholeCamera camera;
    if (size_px.size() == 2) camera.width = size_px[0], camera.height = size_px[1];
    camera.fx = intrinsics[0], camera.fy = intrinsics[1], camera.cx = intrinsics[2],
    camera.cy = intrinsics[3];
    const auto checked = size_px.empty() ? hm::check_intrinsics(camera, {}) : hm::check_camera(camera);
    if (!checked) return hm::fail(hm::ErrorCode::kUsage, "--intrinsics", "{}", checked.error().message);
    options.camera = camera;
  } else if (!size_px.empty()) {
    return hm::fail(hm::ErrorCode::kUsage, "--size", "needs --intrinsics");
  }
  return options;
}
