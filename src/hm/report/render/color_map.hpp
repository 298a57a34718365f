#pragma once
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// A colour as linear steps of perceived lightness and hue, from dark blue-violet (0) over green to light
/// yellow (1): even in OKLab (Ottosson 2020), so that equal steps look equal. Values are clamped.
Vec3 sequential_color(double value);
/// Blue (-1) over light grey (0) to red (+1), even in OKLab. Values are clamped.
Vec3 diverging_color(double value);
/// From components 0..1 (clamped, rounded).
Rgb8 to_rgb8(const Vec3& color);
/// OKLab to sRGB components 0..1, clamped into the gamut.
Vec3 oklab_to_srgb(const Vec3& lab);

}  // namespace hm
