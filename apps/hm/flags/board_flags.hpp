#pragma once
#include <filesystem>
#include <string>

#include "command_line.hpp"
#include "hm/calibration/board.hpp"
#include "hm/core/result.hpp"

/// Options of verbs that look for a calibration board. What is not given comes from the board.toml of the
/// images.
struct BoardFlags {
  std::string kind, corners;
  double square_m = 0;

  void add_to(Command command);
  /// The folder's board, changed by the flags.
  [[nodiscard]] hm::Result<void> apply(const std::filesystem::path& folder, hm::BoardParams& board) const;
};
