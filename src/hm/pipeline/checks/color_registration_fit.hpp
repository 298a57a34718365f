#pragma once
#include <memory>
#include <optional>
#include <string>

#include "hm/depth_camera/color_registration.hpp"
#include "hm/io/rgbd/recording.hpp"

namespace hm {

/// A registration that images show, and how much better colour edges match the borders of what depth sees:
/// the colour gradient there, over the one without it.
struct FittedRegistration {
  ColorRegistration registration;
  double gain_ratio = 1;
};

/// Finds the registration that brings colour gradients to depth borders, from two dozen frames: a search over
/// scales, shifts and parallaxes, then steps of shrinking size. None where the gain is small or not had all
/// over the image, where the images are already registered, where two halves of the frames find different
/// ones (few borders, few edges), and for less than 1.5 s by its own stamps, in which the camera sees too
/// little.
std::optional<FittedRegistration> fit_color_registration(const Recording& recording);

/// The recording with registered colour images. In words: to_string().
std::unique_ptr<Recording> with_registered_color(std::unique_ptr<Recording> recording,
                                                 const ColorRegistration& registration);
std::string to_string(const FittedRegistration& fitted, const PinholeCamera& depth_camera);

}  // namespace hm
