#include "hm/io/bytes/skipped_lines.hpp"

#include <fmt/format.h>

namespace hm {

std::string to_string(const SkippedLines& skipped) {
  const auto reason = [&] {
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
    return fmt::format("{} {}{} of {} left out: {} ({}{})", skipped.count, skipped.unit,
                       skipped.count == 1 ? "" : "s", skipped.file, reason,
                       skipped.count == 1 ? "" : "first: ", skipped.place);
  if (skipped.first_line == 0)
    return fmt::format("{} pose{} not usable: {} (first: {})", skipped.count,
                       skipped.count == 1 ? " is" : "s are", reason, skipped.file);
  return fmt::format("{} {}{} of {} left out: {} (first: {}:{})", skipped.count, skipped.unit,
                     skipped.count == 1 ? "" : "s", skipped.file, reason, skipped.file, skipped.first_line);
}

}  // namespace hm
