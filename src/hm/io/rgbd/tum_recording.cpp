#include <algorithm>
#include <array>
#include <cctype>
#include <span>
#include <utility>

#include "hm/io/bytes/input_file.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/camera/camera_file.hpp"
#include "hm/io/lists/pose_list.hpp"
#include "hm/io/lists/stamped_list.hpp"
#include "hm/io/rgbd/carried_imu_file.hpp"
#include "hm/io/rgbd/named_images.hpp"
#include "hm/io/rgbd/recording_listing.hpp"

/// TUM RGB-D and ICL-NUIM: images and poses listed in text files.
namespace hm::detail {
namespace {

namespace fs = std::filesystem;

fs::path associations_of(const fs::path& folder) {
  for (const char* name : {"associations.txt", "associated.txt", "associate.txt"})
    if (is_file(folder / name)) return folder / name;
  return {};
}

/// True when the first stamp of an association file is an integer: a frame number, not a time.
bool counts_frames(const fs::path& associations) {
  const auto file = TextFile::read(associations);
  if (!file) return false;
  const auto lines = file->lines();
  if (lines.empty()) return false;
  const std::string_view stamp = words(lines[0].text)[0];
  return stamp.size() <= 9 && stamp.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Pose file of an ICL-NUIM folder: groundtruth.txt, or as published, NAME.gt.freiburg.
fs::path icl_poses(const fs::path& folder) {
  if (is_file(folder / "groundtruth.txt")) return folder / "groundtruth.txt";
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().string().ends_with(".gt.freiburg")) return entry.path();
  return {};
}

/// Named as the recordings are: `icl_of_kt3`, `living_room_traj0_frei_png`, `office_kt1`.
bool has_icl_name(const fs::path& folder) {
  const std::string name = fs::weakly_canonical(folder).filename().string();
  constexpr std::array kParts{"icl", "traj", "kt0", "kt1", "kt2", "kt3"};
  return std::ranges::any_of(kParts, [&](const char* part) { return name.find(part) != std::string::npos; });
}

/// Poses of a file; none, and the reason in `info`, where it cannot be read.
PoseList read_poses(const fs::path& path, const StampRule& rule, RecordingInfo& info) {
  auto list = read_pose_list(path, rule);
  if (!list) {
    info.poses_unreadable = to_string(list.error());
    return {};
  }
  info.trajectory_source = path.filename().string();
  add_skipped(info, list->skipped);
  if (list->poses.empty()) add_note(info, path.filename().string() + " holds no pose");
  return std::move(*list);
}

/// Reads the device's own poses, the truth, or neither.
PoseList choose_poses(const fs::path& device, const fs::path& truth, const StampRule& rule,
                      RecordingInfo& info) {
  PoseList given;
  if (is_file(truth)) given = read_poses(truth, rule, info);
  if (is_file(device)) {
    info.truth = std::exchange(given.poses, {});
    info.trajectory_source.clear();
    given = read_poses(device, rule, info);
  }
  if (info.trajectory_source.empty() && info.poses_unreadable.empty())
    add_note(info, "no poses: there is no groundtruth.txt, poses.txt, pose/ or traj.txt that can be used");
  info.trajectory = given.poses;
  return given;
}

std::vector<Time> stamps_of(const ImageList& list) {
  std::vector<Time> stamps;
  for (const StampedImage& picture : list.images) stamps.push_back(picture.stamp);
  return stamps;
}

/// Those of the folder's lists, else those that other programs leave beside named images.
PoseList poses_in(const fs::path& folder, bool is_named, std::span<const Time> stamps, double rate_hz,
                  RecordingInfo& info) {
  const fs::path device = folder / "poses.txt", truth = folder / "groundtruth.txt";
  if (!is_file(device) && !is_file(truth) && is_named) {
    auto named = find_named_poses(folder, stamps, rate_hz);
    if (!named) info.poses_unreadable = to_string(named.error());
    if (named && *named) {
      add_skipped(info, (*named)->list.skipped);
      info.trajectory = (*named)->list.poses;
      info.trajectory_source = (*named)->source;
      return std::move((*named)->list);
    }
  }
  return choose_poses(device, truth, {}, info);
}

/// Builds one frame per depth image; colour is paired by stamp, poses are interpolated at the depth's stamp.
void pair_up(RecordingListing& listing, const AssociationList& lists, const PoseList& poses,
             const RecordingOptions& options) {
  RecordingInfo& info = listing.info;
  info.stamps = stamps_of(lists.depth);
  info.color_count = lists.color.images.size();
  const auto partner =
      associate(info.stamps, stamps_of(lists.color), Duration::from_seconds(options.max_stamp_difference_s));
  const Duration max_gap = Duration::from_seconds(options.max_pose_gap_s);
  for (std::size_t i = 0; i < info.stamps.size(); ++i) {
    ListedFrame frame;
    frame.depth = info.path / lists.depth.images[i].path;
    frame.stamp = frame.color_stamp = info.stamps[i];
    if (partner[i]) {
      frame.color = info.path / lists.color.images[*partner[i]].path;
      frame.color_stamp = lists.color.images[*partner[i]].stamp;
    }
    frame.T_world_camera = pose_between(poses, frame.stamp, max_gap);
    listing.frames.push_back(std::move(frame));
  }
  add_skipped(info, lists.depth.skipped);
  add_skipped(info, lists.color.skipped);
}

Result<AssociationList> read_tum_lists(const fs::path& folder, bool is_named, double rate_hz,
                                       RecordingInfo& info) {
  if (is_named) {
    auto named = list_named_images(folder, rate_hz);
    if (!named) return forward_error(named);
    info.has_own_stamps = named->has_stamps;
    add_note(info, named->note);
    return std::move(named->lists);
  }
  if (!is_file(folder / "depth.txt")) {
    const fs::path associations = associations_of(folder);
    if (associations.empty())
      return fail(ErrorCode::kNotFound, folder,
                  "a TUM RGB-D recording needs a depth.txt or an associations.txt");
    return read_associations(associations);
  }
  AssociationList lists;
  auto depth = read_image_list(folder / "depth.txt");
  if (!depth) return forward_error(depth);
  lists.depth = std::move(*depth);
  if (!is_file(folder / "rgb.txt")) {
    add_note(info, "no colour: there is no rgb.txt");
    return lists;
  }
  auto color = read_image_list(folder / "rgb.txt");
  if (!color) return forward_error(color);
  lists.color = std::move(*color);
  return lists;
}

/// Camera by the folder's name, or by the bag's name in the comments of its lists.
KnownCamera tum_camera(const fs::path& folder, bool is_named) {
  std::vector<std::string> names{fs::weakly_canonical(folder).filename().string()};
  for (const char* list : {"depth.txt", "rgb.txt", "groundtruth.txt"})
    if (const auto file = TextFile::read(folder / list))
      for (const std::string_view comment : file->comments())
        for (std::string_view word : words(comment)) {
          while (word.starts_with('\'')) word.remove_prefix(1);
          names.emplace_back(word.substr(0, word.find('\'')));
        }
  for (const std::string& name : names)
    for (const auto& [owner, camera] :
         {std::pair{"TUM", known_tum_camera(name)}, std::pair{"Bonn", known_bonn_camera(name)}})
      if (camera)
        return {camera,
                fmt::format("{}'s camera of `{}`", owner, name),
                kTumUnits_per_m,
                fmt::format("no camera.txt: the published intrinsics of {}'s recording `{}` are used", owner,
                            name),
                {},
                true};
  // Other tools that name their images by stamps or numbers write millimetres.
  return {std::nullopt, {}, is_named ? 1000.0 : kTumUnits_per_m};
}

/// Reads the optional IMU measurements; read errors are reported as notes.
void add_imu(RecordingInfo& info) {
  auto imu = read_carried_imu(info.path);
  if (!imu)
    add_note(info, "the inertial readings are not used: " + to_string(imu.error()));
  else if (*imu)
    info.imu = std::make_shared<const CarriedImu>(std::move(**imu));
}

}  // namespace

bool looks_like_tum(const fs::path& folder) {
  if (is_file(folder / "depth.txt")) return true;
  const fs::path associations = associations_of(folder);
  if (associations.empty())
    return has_named_images(folder) &&
           (fs::is_directory(folder / "depth") || !looks_like_seven_scenes(folder));
  return !counts_frames(associations);
}

bool looks_like_icl_nuim(const fs::path& folder) {
  const fs::path associations = associations_of(folder);
  return !associations.empty() && !is_file(folder / "depth.txt") && counts_frames(associations);
}

Result<RecordingListing> list_tum(const fs::path& folder, const RecordingOptions& options) {
  RecordingListing listing;
  listing.info.kind = RecordingKind::kTumRgbd;
  listing.info.path = folder;
  const bool is_named = has_named_images(folder);
  auto rate = choose_camera(listing.info, options, tum_camera(folder, is_named));
  if (!rate) return forward_error(rate);
  const auto lists = read_tum_lists(folder, is_named, *rate, listing.info);
  if (!lists) return forward_error(lists);
  const PoseList poses = poses_in(folder, is_named, stamps_of(lists->depth), *rate, listing.info);
  if (is_file(folder / "truth_mesh.ply")) listing.info.truth_mesh = folder / "truth_mesh.ply";
  add_imu(listing.info);
  pair_up(listing, *lists, poses, options);
  return listing;
}

Result<RecordingListing> list_icl_nuim(const fs::path& folder, const RecordingOptions& options) {
  RecordingListing listing;
  listing.info.kind = RecordingKind::kIclNuim;
  listing.info.path = folder;
  listing.info.has_own_stamps = false;
  const fs::path truth = icl_poses(folder);
  KnownCamera known{PinholeCamera{640, 480, 481.2, -480.0, 319.5, 239.5, {}}, "the ICL-NUIM camera",
                    kTumUnits_per_m};
  known.is_scale_certain = truth.string().ends_with(".gt.freiburg") || has_icl_name(folder);
  if (!known.is_scale_certain)
    known.assumption =
        "taken for a recording of ICL-NUIM, as its associations.txt counts frames: camera 481.2 -480 "
        "319.5 239.5, 5000 units per metre; another camera needs a camera.txt (or --intrinsics and "
        "--depth-units-per-m)";
  const auto rate = choose_camera(listing.info, options, known);
  if (!rate) return forward_error(rate);
  const fs::path associations = associations_of(folder);
  if (associations.empty())
    return fail(ErrorCode::kNotFound, folder, "an ICL-NUIM recording needs an associations.txt");
  const StampRule by_number{*rate};
  const auto lists = read_associations(associations, by_number);
  if (!lists) return forward_error(lists);
  const PoseList poses = choose_poses({}, truth, by_number, listing.info);
  pair_up(listing, *lists, poses, options);
  return listing;
}

}  // namespace hm::detail
