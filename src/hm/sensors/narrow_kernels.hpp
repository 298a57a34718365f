#pragma once
#include <cstdint>

/// The inner loops of NarrowCorrection.
namespace hm::detail {

/// How readings of one unit become the whole numbers that NarrowCorrection works with.
struct NarrowScale {
  std::uint16_t lowest = 0, highest = 0;  ///< units within the trained range
  std::uint16_t raise = 1;                ///< power of 2: units so that half of the range takes 15 bits
  std::uint16_t middle = 0;               ///< of the range, in raised units (modulo 2^16)
  std::int16_t stretch = 0;               ///< 2^-15: by how much more than itself that is s
  std::int16_t to_units = 0;              ///< 2^-15: from corrections to units times a power of 2 ...
  std::int16_t lower = 0;                 ///< 2^-15: ... and from those to units
};

/// The coefficients of a row, 2^-15 of a range.
struct NarrowRow {
  int width = 0, terms = 0;
  /// Of a spline; none: coefficients are [term][column].
  int spans = 0;
  const int* span_begin = nullptr;             ///< first pixel of each span of columns, and the width
  const std::int16_t* place = nullptr;         ///< of each column within its span
  const std::int16_t* coefficients = nullptr;  ///< of a spline: [span][term][power 3 .. 0]
  const std::int16_t* lowest_s = nullptr;      ///< of each pixel, not for a spline
  const std::int16_t* highest_s = nullptr;
};

/// One pixel after the other: what the vector code must do to the last bit.
void correct_row_plain(const NarrowRow& row, const NarrowScale& scale, const std::uint16_t* from,
                       std::uint16_t* to);
/// The same with vectors; everything is read and written for up to 31 pixels beyond the end of the row.
void correct_row_simd(const NarrowRow& row, const NarrowScale& scale, const std::uint16_t* from,
                      std::uint16_t* to);

}  // namespace hm::detail
