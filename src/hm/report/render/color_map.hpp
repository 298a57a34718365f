#pragma once
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Perceptually uniform sequential colour map, from dark blue-violet (0) over green to light yellow (1),
/// uniform in OKLab (Ottosson 2020). Values are clamped.
Vec3 sequential_color(double value);
/// Diverging colour map from blue (-1) over light grey (0) to red (+1), uniform in OKLab. Values are clamped.
Vec3 diverging_color(double value);
/// Converts components 0..1 (clamped, rounded).
Rgb8 to_rgb8(const Vec3& color);
/// Converts OKLab to sRGB components 0..1, clamped to the gamut.
Vec3 oklab_to_srgb(const Vec3& lab);

}  // namespace hm
