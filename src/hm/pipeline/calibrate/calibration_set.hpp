#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hm/calibration/board.hpp"
#include "hm/core/json_value.hpp"
#include "hm/core/run_context.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// The camera that images belong to.
enum class CalibratedCamera { kColor, kDepth };
inline constexpr std::string_view kCalibratedCameraNames[] = {"color", "depth"};

/// Boards found in the images of a folder. What could not be used is named with the reason.
struct FoundBoards {
  std::vector<std::string> names;  ///< of the images with a board, as `views`
  std::vector<BoardView> views;
  int width = 0, height = 0;               ///< of the images
  std::size_t images = 0;                  ///< that were looked at
  std::vector<std::string> unreadable;     ///< "12.png: ends at byte 100"
  std::vector<std::string> without_board;  ///< names
};

/// Colour images (.png, .jpg) in a folder, by name. An error when there is no such folder, or no image in
/// it.
Result<std::vector<std::filesystem::path>> list_images(const std::filesystem::path& folder);
/// Looks for the board in every image. Errors: not one board found (with the counts), stopped.
Result<FoundBoards> find_boards(const std::vector<std::filesystem::path>& images, const BoardParams& board,
                                const RunContext& run);

/// The board of a folder: its board.toml, if there is one, or that of the folder above; nothing otherwise.
Result<bool> read_board_of(const std::filesystem::path& folder, BoardParams& board);

/// A calibration to start from; nothing for an empty path.
Result<RgbdCalibration> read_start(const std::filesystem::path& path);

/// Writes into a folder: the calibration with its cameras in the forms of others, report.json, report.html.
struct CalibrationOutput {
  std::filesystem::path folder;
  RgbdCalibration calibration;
  JsonValue json;
  std::string html;
};
Result<std::vector<std::filesystem::path>> write_calibration_output(const CalibrationOutput& output);

/// {"pictures", "boards", "unreadable", "without_board"}.
void visit(const FoundBoards& found, SummaryTree& v);
/// One sentence each for images that were left out.
std::vector<std::string> warnings_of(const FoundBoards& found);
void visit(const PinholeCamera& camera, SummaryTree& v);
std::vector<std::vector<std::string>> camera_table(const PinholeCamera& camera,
                                                   std::span<const double> sigma);

}  // namespace hm
