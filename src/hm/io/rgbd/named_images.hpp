#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "hm/io/lists/pose_list.hpp"
#include "hm/io/lists/stamped_list.hpp"

namespace hm::detail {

/// True for a folder with depth images named by stamps or numbers, in depth/ or as Replica's results/depth*,
/// and without a list of them.
bool has_named_images(const std::filesystem::path& folder);

/// Images of a recording without lists, and a description of how their names were interpreted.
struct NamedImages {
  AssociationList lists;
  bool has_stamps = true;  ///< false: names are frame numbers
  std::string note;
};
/// Lists depth/ and one of rgb/, color/, colour/, image/, images/ by file names, or results/depth* and
/// results/frame* (Replica): seconds ("1305031102.175304"), integer nano-, micro- or milliseconds (19, 16 or
/// 13 digits), else frame numbers at this rate. Other names are counted as malformed. Error: no usable name
/// of a depth image.
Result<NamedImages> list_named_images(const std::filesystem::path& folder, double rate_hz);

/// Poses beside named images.
struct NamedPoses {
  PoseList list;
  std::string source;  ///< "pose/", "traj.txt"
};
/// Reads the poses of named images, whose stamps these are, where other programs leave them: a 4x4 matrix
/// (T_world_camera) for each image in pose/ or poses/, named as the images (ScanNet); traj.txt
/// (read_trajectory_of; Replica). Files of matrices that are no poses are counted, and tracking counts as
/// lost then. Nothing: neither is there. Error: traj.txt cannot be used.
Result<std::optional<NamedPoses>> find_named_poses(const std::filesystem::path& folder,
                                                   std::span<const Time> stamps, double rate_hz);

}  // namespace hm::detail
