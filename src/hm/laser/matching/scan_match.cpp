// The words of a match.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "hm/laser/matching/pl_icp.hpp"

namespace hm {

std::string_view to_string(MatchStatus status) {
  switch (status) {
    case MatchStatus::kMatched:
      return "matched";
    case MatchStatus::kTooFewPoints:
      return "too few points";
    case MatchStatus::kTooFewPairs:
      return "too few pairs";
    case MatchStatus::kNoInformation:
      return "no information";
    case MatchStatus::kCorrectionTooLarge:
      return "correction too large";
    case MatchStatus::kInvalidGuess:
      return "invalid guess";
  }
  return "";
}

std::string FreeDirections::to_string() const {
  if (count == 0) return "none";
  std::string text;
  for (int k = 0; k < count; ++k) {
    const Vec3& direction = directions[static_cast<std::size_t>(k)];
    if (k > 0) text += ", ";
    if (std::abs(direction.z()) < 0.2) {
      double degrees = std::atan2(direction.y(), direction.x()) * 180 / std::numbers::pi;
      degrees = std::fmod(degrees + 360.0, 180.0);  // either way along a line
      text += fmt::format("along {:.0f} deg", degrees);
    } else {
      const double turn = direction.z() / arm_m;
      text += fmt::format("around ({:.2f}, {:.2f}) m", at_m.x() - direction.y() / turn,
                          at_m.y() + direction.x() / turn);
    }
  }
  return text;
}

}  // namespace hm
