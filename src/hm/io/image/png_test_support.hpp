#pragma once
#include <png.h>

#include <cstdint>
#include <span>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/io/testing/testing_recordings.hpp"

namespace hm {

using testing_recordings::random_color, testing_recordings::same_pixels;

inline Image<std::uint16_t> random_depth(int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  Image<std::uint16_t> image(width, height);
  for (std::uint16_t& p : image.pixels()) p = static_cast<std::uint16_t>(rng.below(65536));
  return image;
}

/// The checksum of a PNG's chunk, of its type and data, bit by bit (the specification's annex D).
inline std::uint32_t png_checksum(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (0xEDB88320U & (0U - (crc & 1U)));
  }
  return ~crc;
}

/// A PNG of any kind by libpng's own writer; `rows` as that kind stores them, each by the best of `filters`.
inline std::vector<std::uint8_t> png_of_kind(int width, int bit_depth, int color_type, int interlace,
                                             std::vector<std::vector<std::uint8_t>> rows,
                                             int filters = PNG_ALL_FILTERS) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  std::vector<std::uint8_t> bytes;
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, std::size_t n) {
        auto* out = static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(p));
        out->insert(out->end(), data, data + n);
      },
      nullptr);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, filters);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(rows.size()), bit_depth,
               color_type, interlace, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_color palette[4] = {{10, 20, 30}, {40, 50, 60}, {70, 80, 90}, {255, 0, 1}};
  if (color_type == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, palette, 4);
  png_write_info(png, info);
  std::vector<png_bytep> pointers;
  for (auto& row : rows) pointers.push_back(row.data());
  png_write_image(png, pointers.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

}  // namespace hm
