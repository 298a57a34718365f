#include "hm/io/pose/pose_matrix_file.hpp"

#include "hm/io/bytes/text_lines.hpp"

namespace hm {

Result<SE3> read_pose_matrix(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  Mat4 matrix;
  Eigen::Index count = 0;
  for (const TextLine& line : file->lines()) {
    for (const std::string_view word : words(line.text)) {
      const auto number = parse_number(word);
      if (!number) return fail(ErrorCode::kCorrupted, file->where(line), "`{}` is not a number", word);
      if (count == 16) return fail(ErrorCode::kCorrupted, file->where(line), "more than 16 numbers");
      matrix(count / 4, count % 4) = *number;
      ++count;
    }
  }
  if (count != 16) return fail(ErrorCode::kCorrupted, path, "expected 16 numbers, found {}", count);
  auto pose = SE3::from_matrix(matrix);
  if (!pose) pose.error().where = path.string();
  return pose;
}

SkippedLines::Reason skip_reason(const Error& error) {
  if (error.code != ErrorCode::kInvalidValue) return SkippedLines::Reason::kMalformed;
  return error.message.find("NaN") != std::string::npos ? SkippedLines::Reason::kNotFinite
                                                        : SkippedLines::Reason::kNotRigid;
}

}  // namespace hm
