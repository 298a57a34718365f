#pragma once
#include <filesystem>

#include "hm/core/result.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/io/bytes/skipped_lines.hpp"

namespace hm {

/// Reads a text file of 16 numbers, the 4x4 matrix of a pose row by row. Errors: kCorrupted (file:line) where
/// it holds something else, kInvalidValue where the matrix is not finite or not rigid.
Result<SE3> read_pose_matrix(const std::filesystem::path& path);

/// Error of read_pose_matrix() as the reason for which a recording's pose was skipped.
SkippedLines::Reason skip_reason(const Error& error);

}  // namespace hm
