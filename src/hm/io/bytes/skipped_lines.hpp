#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace hm {

/// Skipped lines of a recording's text files, messages or parts of its bags, or images, counted by reason.
struct SkippedLines {
  enum class Reason { kStampNotIncreasing, kNotFinite, kNotRigid, kMalformed, kCutOff, kDamaged };
  Reason reason = Reason::kStampNotIncreasing;
  std::string file;  ///< name inside the recording
  std::size_t count = 0;
  std::size_t first_line = 0;      ///< counted from 1
  std::string_view unit = "line";  ///< what is counted: "line", "message", "part"
  std::string place = {};          ///< description of the first, where it has no line number
  std::string why = {};            ///< what is wrong, where more is known than the reason
};
std::string to_string(const SkippedLines& skipped);

}  // namespace hm
