#include "hm/io/bytes/skipped_lines.hpp"

#include <fmt/format.h>

#include "hm/core/text/counted.hpp"

namespace hm {

std::string to_string(const SkippedLines& skipped) {
  const auto reason = [&]() -> std::string_view {
    if (!skipped.why.empty()) return skipped.why;
    switch (skipped.reason) {
      case SkippedLines::Reason::kStampNotIncreasing:
        return "stamps that run backwards or repeat";
      case SkippedLines::Reason::kNotFinite:
        return "NaN or infinity";
      case SkippedLines::Reason::kNotRigid:
        return "not a rotation";
      case SkippedLines::Reason::kMalformed:
        return "malformed";
      case SkippedLines::Reason::kCutOff:
        return "cut off";
      case SkippedLines::Reason::kDamaged:
        return "cut off or damaged";
    }
    return "";
  }();
  if (!skipped.place.empty())
    return fmt::format("{} of {} left out: {} ({}{})", counted(skipped.count, skipped.unit), skipped.file,
                       reason, skipped.count == 1 ? "" : "first: ", skipped.place);
  if (skipped.first_line == 0)
    return fmt::format("{} not usable: {} (first: {})", counted(skipped.count, "pose"), reason, skipped.file);
  return fmt::format("{} of {} left out: {} (first: {}:{})", counted(skipped.count, skipped.unit),
                     skipped.file, reason, skipped.file, skipped.first_line);
}

}  // namespace hm
