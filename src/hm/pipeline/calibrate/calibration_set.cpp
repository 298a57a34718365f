#include "hm/pipeline/calibrate/calibration_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "hm/calibration/camera_fit.hpp"
#include "hm/core/parallel.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/file_name.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/camera/camera_file.hpp"
#include "hm/io/image/image_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// Search result of one image.
struct Looked {
  std::string unreadable;  ///< why, or empty
  int width = 0, height = 0;
  BoardDetection detection;
};

Looked look(const fs::path& path, const BoardParams& board) {
  Looked looked;
  const auto image = read_color_image(path);
  if (!image) {
    looked.unreadable = image.error().message;
    return looked;
  }
  looked.width = image->width(), looked.height = image->height();
  looked.detection = find_board(*image, board);
  return looked;
}

void sort_in(FoundBoards& found, const std::string& name, Looked looked) {
  ++found.images;
  if (!looked.unreadable.empty()) {
    found.unreadable.push_back(name + ": " + looked.unreadable);
    return;
  }
  if (found.width == 0) found.width = looked.width, found.height = looked.height;
  if (looked.width != found.width || looked.height != found.height) {
    found.unreadable.push_back(fmt::format("{}: is {} x {}, the first is {} x {}", name, looked.width,
                                           looked.height, found.width, found.height));
    return;
  }
  if (looked.detection.search != BoardSearch::kFound) {
    found.without_board.push_back(name);
    return;
  }
  found.names.push_back(name);
  found.views.push_back(std::move(looked.detection.view));
}

/// The checkerboard of a common size that most of some images show; nothing when none of them shows one.
/// Larger boards first: a part of one may look like a smaller one.
std::optional<BoardParams> guess_board(const std::vector<fs::path>& images, const BoardParams& wanted,
                                       const RunContext& run) {
  constexpr std::array<std::array<int, 2>, 14> kCommonCorners{{{13, 9},
                                                               {12, 9},
                                                               {11, 8},
                                                               {10, 7},
                                                               {9, 7},
                                                               {9, 6},
                                                               {8, 6},
                                                               {8, 5},
                                                               {7, 7},
                                                               {7, 6},
                                                               {7, 5},
                                                               {6, 5},
                                                               {6, 4},
                                                               {5, 4}}};
  constexpr std::size_t kImages = 4;
  const ParallelLoop loop(run.threads);
  std::optional<BoardParams> best;
  std::size_t most = 0;
  const std::size_t searched = std::min(kImages, images.size());
  for (const auto& [x, y] : kCommonCorners) {
    if (run.stop.stop_requested() || most == searched) break;
    BoardParams board = wanted;
    board.kind = BoardKind::kCheckerboard, board.corners_x = x, board.corners_y = y;
    std::array<bool, kImages> found{};
    loop.for_ranges(searched, 1, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i)
        found[i] = look(images[i * images.size() / searched], board).detection.search == BoardSearch::kFound;
    });
    const auto count = static_cast<std::size_t>(std::ranges::count(found, true));
    if (count > most) most = count, best = board;
  }
  return best;
}

Error no_board(const std::vector<fs::path>& images, const BoardParams& board, const FoundBoards& found,
               const RunContext& run) {
  std::string message = fmt::format(
      "no {} of {} x {} inner corners in {} images ({} unreadable); corners are counted between squares",
      kBoardKindNames[static_cast<std::size_t>(board.kind)], board.corners_x, board.corners_y, found.images,
      found.unreadable.size());
  if (found.unreadable.size() < found.images)
    if (const auto guess = guess_board(images, board, run))
      message +=
          fmt::format("; a checkerboard of {0} x {1} is there: try --board checkerboard --corners {0}x{1}",
                      guess->corners_x, guess->corners_y);
  return {ErrorCode::kInvalidValue, message, images.empty() ? "" : images.front().parent_path().string()};
}

}  // namespace

Result<std::vector<fs::path>> list_images(const fs::path& folder) {
  std::error_code code;
  if (!fs::is_directory(folder, code)) return fail(ErrorCode::kNotFound, folder, "there is no such folder");
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder, code)) {
    const std::string extension = lower_extension(entry.path());
    if (extension == ".png" || extension == ".jpg" || extension == ".jpeg") images.push_back(entry.path());
  }
  if (images.empty()) return fail(ErrorCode::kNotFound, folder, "no image (.png, .jpg) in this folder");
  std::ranges::sort(images);
  return images;
}

Result<FoundBoards> find_boards(const std::vector<fs::path>& images, const BoardParams& board,
                                const RunContext& run) {
  if (auto checked = check_params(board); !checked) return forward_error(checked);
  FoundBoards found;
  const ParallelLoop loop(run.threads);
  const auto chunk = static_cast<std::size_t>(run.threads) * 2;
  for (std::size_t begin = 0; begin < images.size(); begin += chunk) {
    if (run.stop.stop_requested()) return fail(ErrorCode::kCancelled, "", "stopped while looking for boards");
    std::vector<Looked> looked(std::min(chunk, images.size() - begin));
    loop.for_ranges(looked.size(), 1, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) looked[i] = look(images[begin + i], board);
    });
    for (std::size_t i = 0; i < looked.size(); ++i)
      sort_in(found, images[begin + i].filename().string(), std::move(looked[i]));
    if (run.progress)
      run.progress({"looking for boards", begin + looked.size(), images.size(),
                    fmt::format("{} found", found.views.size())});
  }
  if (found.views.empty()) return tl::make_unexpected(no_board(images, board, found, run));
  return found;
}

Result<bool> read_board_of(const fs::path& folder, BoardParams& board) {
  std::error_code code;
  for (const fs::path& place : {folder, folder / ".."}) {
    const fs::path path = place / "board.toml";
    if (!fs::is_regular_file(path, code)) continue;
    ParamList list;
    list.add("board", board);
    if (auto read = list.read_toml_file(path); !read) return forward_error(read);
    if (auto checked = list.check(); !checked) return forward_error(checked);
    return true;
  }
  return false;
}

Result<RgbdCalibration> read_start(const fs::path& path) {
  if (path.empty()) return RgbdCalibration{};
  std::error_code code;
  return read_calibration(fs::is_directory(path, code) ? path / kCalibrationFileName : path);
}

Result<std::vector<fs::path>> write_calibration_output(const CalibrationOutput& output) {
  if (const auto made = make_folder(output.folder); !made) return forward_error(made);
  std::vector<fs::path> written;
  const auto text = [&](const std::string& name, const std::string& content) -> Result<void> {
    auto result = as_run_failure(write_file_text(output.folder / name, content));
    if (result) written.push_back(output.folder / name);
    return result;
  };
  const auto& calibration = output.calibration;
  if (calibration.depth_camera || calibration.color_camera) {
    const fs::path path = output.folder / kCalibrationFileName;
    if (auto result = as_run_failure(write_calibration(path, calibration)); !result)
      return forward_error(result);
    written.push_back(path);
    if (calibration.depth_correction) written.push_back(output.folder / "calibration.hmdc");
  }
  if (calibration.color_camera)
    if (auto result = text("color_camera_info.yaml", camera_info_yaml(*calibration.color_camera, "color"));
        !result)
      return forward_error(result);
  if (calibration.depth_camera)
    if (auto result = text("depth_camera_info.yaml", camera_info_yaml(*calibration.depth_camera, "depth"));
        !result)
      return forward_error(result);
  if (auto result = text("report.json", to_json_text(output.json) + "\n"); !result)
    return forward_error(result);
  if (auto result = text("report.html", output.html); !result) return forward_error(result);
  return written;
}

void visit(const FoundBoards& found, SummaryTree& v) {
  v({"pictures"}, found.images);
  v({"boards"}, found.views.size());
  v.json("unreadable", JsonValue::array_of(found.unreadable));
  v.json("without_board", JsonValue::array_of(found.without_board));
}

std::vector<std::string> warnings_of(const FoundBoards& found) {
  std::vector<std::string> warnings;
  if (!found.unreadable.empty())
    warnings.push_back(fmt::format("{} of {} left out: {}", found.unreadable.size(),
                                   counted(found.images, "image"), fmt::join(found.unreadable, "; ")));
  if (!found.without_board.empty())
    warnings.push_back(fmt::format("no board found in {} of {}: {}", found.without_board.size(),
                                   counted(found.images, "image"), fmt::join(found.without_board, ", ")));
  return warnings;
}

void visit(const PinholeCamera& c, SummaryTree& v) {
  v({"width"}, c.width);
  v({"height"}, c.height);
  for (const auto& [key, value] : {std::pair{"fx_px", c.fx}, std::pair{"fy_px", c.fy},
                                   std::pair{"cx_px", c.cx}, std::pair{"cy_px", c.cy}})
    v({key, {}, "{:.2f} px"}, value);
  const LensDistortion& d = c.distortion;
  for (const auto& [key, value] : {std::pair{"k1", d.k1}, std::pair{"k2", d.k2}, std::pair{"p1", d.p1},
                                   std::pair{"p2", d.p2}, std::pair{"k3", d.k3}})
    v({key, {}, "{:.5f}"}, value);
}

std::vector<std::vector<std::string>> camera_table(const PinholeCamera& c, std::span<const double> sigma) {
  const std::array<double, 9> values{
      c.fx,           c.fy, c.cx, c.cy, c.distortion.k1, c.distortion.k2, c.distortion.p1, c.distortion.p2,
      c.distortion.k3};
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < values.size(); ++i)
    rows.push_back({std::string(kCameraFitNames[i]) + (i < 4 ? " (px)" : ""),
                    fmt::format("{:.{}f}", values[i], i < 4 ? 2 : 5),
                    i < sigma.size() ? fmt::format("{:.{}f}", sigma[i], i < 4 ? 2 : 5) : ""});
  return rows;
}

}  // namespace hm
