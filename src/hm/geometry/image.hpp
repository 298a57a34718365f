#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hm/core/check.hpp"

namespace hm {

/// RGB colour, 8 bits per channel.
struct Rgb8 {
  std::uint8_t r = 0, g = 0, b = 0;
  bool operator==(const Rgb8&) const = default;
};

/// Dense image, row-major without padding; pixel centres at integer coordinates, (0, 0) at the top left. At
/// least 16 bytes after the last pixel may be read (not written), so that vector code can load past the end.
template <class T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, T fill = T{}) : width_(width), height_(height) {
    HM_CHECK(width >= 0 && height >= 0, "{} x {}", width, height);
    pixels_.assign(size() + kSlack, fill);
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }
  [[nodiscard]] bool empty() const { return size() == 0; }
  [[nodiscard]] bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  T& operator()(int x, int y) { return pixels_[index(x, y)]; }
  const T& operator()(int x, int y) const { return pixels_[index(x, y)]; }

  [[nodiscard]] T* data() { return pixels_.data(); }
  [[nodiscard]] const T* data() const { return pixels_.data(); }
  [[nodiscard]] std::span<T> pixels() { return {pixels_.data(), size()}; }
  [[nodiscard]] std::span<const T> pixels() const { return {pixels_.data(), size()}; }
  [[nodiscard]] std::span<T> row(int y) {
    return pixels().subspan(index(0, y), static_cast<std::size_t>(width_));
  }
  [[nodiscard]] std::span<const T> row(int y) const {
    return pixels().subspan(index(0, y), static_cast<std::size_t>(width_));
  }

 private:
  static constexpr std::size_t kSlack = (16 + sizeof(T) - 1) / sizeof(T);
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  int width_ = 0;
  int height_ = 0;
  std::vector<T> pixels_;
};

}  // namespace hm
