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
  int stride = 0;  ///< from one term to the next, whole vectors of 32

  const std::int16_t* coefficients = nullptr;  ///< [term][column]

  /// Of a spline: between these coefficients and others, right after them.
  bool is_spline = false;
  std::int16_t weight = 0;  ///< of the others, 2^-15

  /// Of pixels: between what s is held.
  const std::int16_t* lowest_s = nullptr;
  const std::int16_t* highest_s = nullptr;
};

/// One pixel after the other: what the vector code must do to the last bit.
void correct_row_plain(const NarrowRow& row, const NarrowScale& scale, const std::uint16_t* from,
                       std::uint16_t* to);
/// The same with vectors; `from` is read and `to` written for up to 31 pixels beyond the end of the row.
void correct_row_simd(const NarrowRow& row, const NarrowScale& scale, const std::uint16_t* from,
                      std::uint16_t* to);

}  // namespace hm::detail
