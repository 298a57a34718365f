#include "hm/io/bytes/foreign_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "hm/io/bytes/file_name.hpp"
#include "hm/io/bytes/input_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFolderLayout =
    "a folder with depth/ (16 bit PNG) and rgb/ (PNG or JPEG), named by stamp or frame number, and a "
    "camera.txt (fx, fy, cx, cy, width, height, depth_scale: units per metre) is read";

/// Format recognised by file extensions.
struct KnownFile {
  std::array<std::string_view, 7> extensions;
  std::string_view what;  ///< description, and how to convert it
};

constexpr std::array kKnownFiles{
    KnownFile{{".mp4", ".mov", ".mkv", ".avi", ".webm", ".m4v"},
              "a video: it has no depth, without which nothing can be measured in metres"},
    KnownFile{{".db3", ".mcap"},
              "part of a ROS 2 bag; `rosbags-convert` (pip install rosbags) makes a ROS 1 .bag of it, of "
              "which laser scans are read"},
    KnownFile{{".zip", ".7z", ".rar"}, "an archive: unpack it, and give the folder"},
    KnownFile{{".tar", ".tgz", ".gz", ".bz2", ".xz", ".zst", ".tbz2"},
              "an archive: unpack it, and give the folder"},
    KnownFile{{".r3d"}, "a recording of Record3D: export it as a folder of RGB-D images"},
    KnownFile{{".sens"}, "a ScanNet recording: export its frames (reader of the ScanNet toolkit)"},
    KnownFile{{".klg", ".oni", ".svo", ".svo2", ".xrf"},
              "a recording in the format of one camera's tools: export its frames with them"},
    KnownFile{{".las", ".laz", ".pcd", ".e57", ".pts", ".xyz"},
              "a point cloud: surfaces are made of depth images, not of points"},
};

/// Folder layout recognised by its files.
struct KnownFolder {
  std::array<std::string_view, 3> names;  ///< all must exist; empty ones are ignored
  std::string_view what;
};

constexpr std::array kKnownFolders{
    KnownFolder{{"rgb.mp4", "odometry.csv", "camera_matrix.csv"},
                "a recording of Stray Scanner; its depth/ can be read, its video cannot: make images of it "
                "(`ffmpeg -i rgb.mp4 -start_number 0 rgb/%06d.png`), then"},
    KnownFolder{{"keyframes", "mesh_info.json", ""}, "a raw export of Polycam;"},
    KnownFolder{{"EXR_RGBD", "", ""}, "an export of Record3D with EXR images; exported as PNG,"},
    KnownFolder{{"rgbd", "metadata.json", ""}, "an export of Record3D;"},
    KnownFolder{{"info.json", "frame_00000.json", ""}, "an export of 3D Scanner App;"},
    KnownFolder{{"transforms.json", "", ""}, "a recording for neural rendering (transforms.json);"},
};

std::optional<std::string> describe_file(const fs::path& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".db") {
    std::string bytes(15, '\0');
    auto file = InputFile::open(path);
    if (file && file->size() >= bytes.size() && file->read(bytes.data(), bytes.size()) &&
        bytes == "SQLite format 3")
      return fmt::format(
          "a database, perhaps of RTAB-Map: `rtabmap-export --images --poses {}` writes its "
          "images and poses; {}",
          path.filename().string(), kFolderLayout);
    return std::nullopt;
  }
  if (extension.empty()) return std::nullopt;
  for (const KnownFile& known : kKnownFiles)
    if (std::ranges::find(known.extensions, extension) != known.extensions.end())
      return std::string(known.what);
  return std::nullopt;
}

std::optional<std::string> describe_folder(const fs::path& folder) {
  std::error_code ignored;
  for (const KnownFolder& known : kKnownFolders) {
    const bool has_all = std::ranges::all_of(known.names, [&](std::string_view name) {
      return name.empty() || fs::exists(folder / name, ignored);
    });
    if (has_all) return fmt::format("{} {}", known.what, kFolderLayout);
  }
  std::error_code code;
  for (auto at = fs::directory_iterator(folder, code); !code && at != end(at); at.increment(code)) {
    const std::string extension = lower_extension(at->path());
    if (extension == ".db3" || extension == ".mcap")
      return "a ROS 2 bag; `rosbags-convert` (pip install rosbags) makes a ROS 1 .bag of it, of which laser "
             "scans are read";
    if (extension == ".r3d" || extension == ".db" || extension == ".sens") return describe_file(at->path());
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> describe_foreign_format(const fs::path& path) {
  std::error_code ignored;
  if (path.empty()) return std::nullopt;
  const bool is_folder = fs::is_directory(path, ignored);
  return is_folder ? describe_folder(path) : describe_file(path);
}

}  // namespace hm
