#pragma once

namespace hm {

/// sRGB transfer function (IEC 61966-2-1) and its inverse, values 0 to 1. Colours in images and meshes are
/// sRGB; glTF vertex colours are linear.
double srgb_to_linear(double srgb);
double linear_to_srgb(double linear);

}  // namespace hm
