#pragma once
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

inline constexpr double kGlyphHeight =
    6;  ///< units from the base line (y = 6) to the top of a capital (y = 0)
inline constexpr double kGlyphGap = 1.7;  ///< units between neighbouring characters

/// Strokes of a character in glyph units (x right, y down), and the advance to the next one.
struct StrokeGlyph {
  std::vector<std::vector<Vec2>> strokes;
  double advance = 0;
};
/// Glyph of a printable ASCII character; anything else is an empty box.
StrokeGlyph stroke_glyph(char character);

}  // namespace hm
