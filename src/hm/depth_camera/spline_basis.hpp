#pragma once
#include <algorithm>
#include <array>

namespace hm::detail {

/// Weights of the four uniform cubic B-spline control points at t in [0, 1] of a span.
template <class T>
std::array<T, 4> spline_weights(T t) {
  const T u = 1 - t;
  return {u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * u * u * u - 6 * u * u + 4) / 6,
          t * t * t / 6};
}

struct SplinePlace {
  int span = 0;  ///< index of the first of the four control points
  double t = 0;  ///< within the span
};

/// Span and parameter of a pixel coordinate in an image dimension of `size_px` with `points` control points.
inline SplinePlace spline_place(double x_px, int size_px, int points) {
  const int spans = points - 3;
  const double place = std::clamp((x_px + 0.5) / size_px, 0.0, 1.0) * spans;
  const int span = std::clamp(static_cast<int>(place), 0, spans - 1);
  return {span, place - span};
}

}  // namespace hm::detail
