#include <cmath>

#include "hm/io/bytes/input_file.hpp"
#include "hm/io/camera/camera_file.hpp"
#include "hm/io/camera/foreign_camera.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/io/rgbd/recording_listing.hpp"

namespace hm::detail {

std::optional<std::filesystem::path> find_beside(const std::filesystem::path& folder, const char* name) {
  if (is_file(folder / name)) return folder / name;
  const std::filesystem::path plain = folder.has_filename() ? folder : folder.parent_path();
  if (!plain.filename().string().starts_with("seq-")) return std::nullopt;
  const std::filesystem::path above = plain / ".." / name;
  if (is_file(above)) return above;
  return std::nullopt;
}

namespace {

Result<void> checked_option(const PinholeCamera& camera) {
  PinholeCamera sized = camera;
  if (sized.width == 0 && sized.height == 0) sized.width = sized.height = 1;
  auto checked = check_camera(sized);
  if (!checked) checked.error().where = "the given camera";
  return checked;
}

/// Camera that another program left in the folder; unless one is needed, a file that cannot be used is
/// ignored.
Result<std::optional<ForeignCamera>> foreign_camera(RecordingInfo& info, bool is_needed) {
  auto found = find_foreign_camera(info.path);
  if (found || is_needed) return found;
  add_note(info, to_string(found.error()) + " (ignored, the camera is known otherwise)");
  return std::nullopt;
}

/// Sets the camera of `info`: given, from a file, or known.
Result<void> choose_intrinsics(RecordingInfo& info, const RecordingOptions& options, const KnownCamera& known,
                               const std::optional<CameraFile>& file,
                               const std::optional<ForeignCamera>& foreign) {
  if (options.camera) {
    if (auto checked = checked_option(*options.camera); !checked) return checked;
    info.camera = *options.camera;
    info.camera_source = "given";
  } else if (file) {
    info.camera = file->camera;
    info.camera_source = "camera.txt";
  } else if (const auto matrix = find_beside(info.path, "camera-intrinsics.txt")) {
    const auto camera = read_intrinsics_matrix(*matrix);
    if (!camera) return forward_error(camera);
    info.camera = *camera;
    info.camera_source = "camera-intrinsics.txt";
  } else if (foreign) {
    info.camera = foreign->camera;
    info.camera_source = foreign->path.filename().string();
  } else if (known.camera) {
    info.camera = *known.camera;
    info.camera_source = known.source;
    if (!known.note.empty()) add_note(info, known.note);
    if (!known.assumption.empty()) add_assumption(info, known.assumption);
  } else {
    return fail(
        ErrorCode::kNotFound, info.path,
        "the camera's intrinsics are not known: no camera.txt, no camera-intrinsics.txt, no file of Open3D, "
        "ScanNet or Replica, and the name tells none of the known cameras; give them with --intrinsics FX FY "
        "CX CY, or write a camera.txt (fx, fy, cx, cy, one `key value` a line)");
  }
  return {};
}

/// Warning where nothing states the units of depth.
std::string assumed_scale(double units_per_m) {
  const bool as_tum = units_per_m == kTumUnits_per_m;
  const double other = as_tum ? 1000 : kTumUnits_per_m;
  return fmt::format(
      "depth is taken as {0} units per metre, as {1}: nothing here says so; {2} {3} "
      "(--depth-units-per-m {3}, or `depth_scale {3}` in camera.txt)",
      units_per_m, as_tum ? "TUM's recordings have it" : "most cameras write it",
      as_tum ? "many cameras have" : "TUM's recordings have", other);
}

}  // namespace

Result<double> choose_camera(RecordingInfo& info, const RecordingOptions& options, const KnownCamera& known) {
  std::optional<CameraFile> file;
  if (const auto path = find_beside(info.path, "camera.txt")) {
    auto read = read_camera_file(*path);
    if (read) {
      file = std::move(*read);
      for (const std::string& key : file->unknown_keys)
        add_note(info, fmt::format("camera.txt: `{}` is not known and was ignored", key));
    } else if (!options.camera) {
      return forward_error(read);
    } else {
      add_note(info, to_string(read.error()) + " (ignored, the camera is given)");
    }
  }
  const auto foreign = foreign_camera(info, !options.camera && !file);
  if (!foreign) return forward_error(foreign);
  if (auto chosen = choose_intrinsics(info, options, known, file, *foreign); !chosen)
    return forward_error(chosen);
  std::optional<double> stated = options.depth_units_per_m;
  if (!stated && file) stated = file->depth_units_per_m;
  if (!stated && *foreign) stated = (*foreign)->depth_units_per_m;
  const double units_per_m = stated.value_or(known.depth_units_per_m);
  const bool is_known = info.camera_source == known.source;  // with the camera its units are known
  if (!stated && !is_known && !known.is_scale_certain) add_assumption(info, assumed_scale(units_per_m));
  if (options.depth_units_per_m)  // files are checked when they are read
    if (auto checked = check_given_depth_scale(units_per_m); !checked) return forward_error(checked);
  info.depth_unit_m = 1.0 / units_per_m;
  return file && file->rate_hz ? *file->rate_hz : 30.0;
}

namespace {

/// Error where intrinsics that were given without a size are for larger or smaller images.
Result<void> check_principal_point(const PinholeCamera& camera) {
  const auto is_central = [](double principal_px, int size_px) {
    return principal_px > 0.25 * size_px && principal_px < 0.75 * size_px;
  };
  if (is_central(camera.cx, camera.width) && is_central(camera.cy, camera.height)) return {};
  return fail(ErrorCode::kInvalidValue, "--intrinsics",
              "cx {} and cy {} are not near the middle of the depth images of {} x {}: name the size of the "
              "images that the intrinsics are for with --size",
              camera.cx, camera.cy, camera.width, camera.height);
}

}  // namespace

Result<void> fit_camera_to_images(RecordingListing& listing) {
  constexpr std::size_t kTries = 10;
  RecordingInfo& info = listing.info;
  PinholeCamera& camera = info.camera;
  std::optional<ImageSize> size;
  for (std::size_t i = 0; i < listing.frames.size() && i < kTries && !size; ++i)
    if (const auto read = read_image_size(listing.frames[i].depth)) size = *read;
  if (!size) {
    if (camera.width > 0) return {};
    return fail(ErrorCode::kUnreadable, info.path, "none of the first depth images can be read ({}, ...)",
                listing.frames.empty() ? "" : listing.frames[0].depth.filename().string());
  }
  if (camera.width == 0 || camera.height == 0) {
    camera.width = size->width;
    camera.height = size->height;
    if (info.camera_source == "given")
      if (auto fits = check_principal_point(camera); !fits) return fits;
  }
  if (camera.width == size->width && camera.height == size->height) {
    auto checked = check_camera(camera);  // first check with the size, if the file does not contain it
    if (!checked) checked.error().where = fmt::format("{} ({})", info.path.string(), info.camera_source);
    return checked;
  }
  if (static_cast<std::int64_t>(camera.width) * size->height !=
      static_cast<std::int64_t>(camera.height) * size->width)
    return fail(
        ErrorCode::kInvalidValue, info.path,
        "the camera ({}) is {} x {}, the depth images are {} x {}: the intrinsics belong to another camera{}",
        info.camera_source, camera.width, camera.height, size->width, size->height,
        info.camera_source == "given"
            ? fmt::format(" (--size {} {}, if they are those of the depth images)", size->width, size->height)
            : "");
  add_note(info, fmt::format("intrinsics for {} x {} ({}) scaled to the depth images' {} x {}", camera.width,
                             camera.height, info.camera_source, size->width, size->height));
  const double ratio = static_cast<double>(size->width) / camera.width;
  camera = camera.scaled(ratio);
  camera.width = size->width;
  camera.height = size->height;
  return {};
}

void note_stretched_color(RecordingListing& listing) {
  constexpr double kSame_ratio = 0.02;
  const PinholeCamera& camera = listing.info.camera;
  for (const ListedFrame& frame : listing.frames) {
    if (frame.color.empty()) continue;
    const auto color = read_image_size(frame.color);
    if (!color) return;  // reading the frame says why
    const double ratio = static_cast<double>(color->width) * camera.height /
                         (static_cast<double>(color->height) * camera.width);
    if (std::abs(ratio - 1) > kSame_ratio)
      add_assumption(
          listing.info,
          fmt::format("colour images are {} x {}, depth images {} x {}: colour is stretched to the "
                      "shape of depth, as if both saw the same; a calibration.toml with both cameras "
                      "registers it",
                      color->width, color->height, camera.width, camera.height));
    return;
  }
}

}  // namespace hm::detail
