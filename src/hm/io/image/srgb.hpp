#pragma once

namespace hm {

/// The sRGB transfer curve (IEC 61966-2-1), both ways, 0 to 1: colours in pictures and meshes are sRGB, those
/// in glTF vertices are linear.
double srgb_to_linear(double srgb);
double linear_to_srgb(double linear);

}  // namespace hm
