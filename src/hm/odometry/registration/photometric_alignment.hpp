#pragma once
#include <optional>
#include <vector>

#include "hm/odometry/feature/image_pyramid.hpp"
#include "hm/odometry/registration/surface_grid.hpp"

namespace hm {

/// Reference frame for photometric alignment: pixels with gradient and depth on the coarse levels of its
/// pyramid, with the derivative of their intensity with respect to the camera's motion.
class PhotometricReference {
 public:
  struct Pixel {
    Eigen::Vector3f p_camera;
    float intensity;
    Eigen::Matrix<float, 6, 1> jacobian;  ///< d intensity / d (motion of the reference camera's points)
  };
  struct Level {
    int level = 0;
    PinholeCamera camera;
    std::vector<Pixel> pixels;
  };
  /// Selects at most `max_pixels` per level, evenly from those with sufficient gradient. Uses levels 2 and
  /// coarser; for small images finer ones too.
  PhotometricReference(const ImagePyramid& pyramid, const DepthGrid& grid, const PinholeCamera& camera,
                       std::size_t max_pixels);
  PhotometricReference() = default;
  [[nodiscard]] std::size_t memory_bytes() const;
  [[nodiscard]] const std::vector<Level>& levels() const { return levels_; }  ///< coarsest first

 private:
  std::vector<Level> levels_;
};

struct PhotometricResult {
  SE3 T_ref_cur;
  double residual = 255;     ///< robust mean absolute intensity difference, finest level used
  double overlap_ratio = 0;  ///< share of the reference's pixels visible in the current frame
};

/// Estimates T_ref_cur by inverse compositional photometric alignment (Baker and Matthews 2004, Kerl et al.
/// 2013), coarse to fine, with Huber weights and an affine brightness change. Starts from the best of the
/// guesses.
PhotometricResult align_photometrically(const PhotometricReference& reference, const ImagePyramid& current,
                                        const std::vector<SE3>& guesses_T_ref_cur);

/// Correlation (-1 to 1) of the reference's intensities with those that the current image has there at a
/// given motion, on a level where motion blur matters little; nothing where the reference shows too little
/// texture or the images share less than a quarter of it.
std::optional<double> picture_correlation(const PhotometricReference& reference, const ImagePyramid& current,
                                          const SE3& T_ref_cur);

/// The same as align_photometrically() for large rotations since the reference, as at a few frames per
/// second, where repeating patterns (wallpaper, tiles) cause wrong local minima. Compares the images at
/// rotations of up to 0.2 rad around a guess and refines the best few; never worse than `result`.
PhotometricResult search_turns(const PhotometricReference& reference, const ImagePyramid& current,
                               const PhotometricResult& result, const std::vector<SE3>& guesses_T_ref_cur);

}  // namespace hm
