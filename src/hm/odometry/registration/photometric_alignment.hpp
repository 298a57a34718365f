#pragma once
#include <vector>

#include "hm/odometry/feature/image_pyramid.hpp"
#include "hm/odometry/registration/surface_grid.hpp"

namespace hm {

/// What a frame offers for being aligned to: bright and dark pixels with depth on the coarse levels of its
/// pyramid, with the derivative of their brightness by the camera's motion.
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
  /// At most `max_pixels` per level, evenly taken from those with enough gradient. Levels 2 and coarser; of
  /// small pictures finer ones too.
  PhotometricReference(const ImagePyramid& pyramid, const DepthGrid& grid, const PinholeCamera& camera,
                       std::size_t max_pixels);
  PhotometricReference() = default;
  [[nodiscard]] std::size_t memory_bytes() const;
  [[nodiscard]] const std::vector<Level>& levels() const { return levels_; }  ///< the coarsest first

 private:
  std::vector<Level> levels_;
};

struct PhotometricResult {
  SE3 T_ref_cur;
  double residual = 255;     ///< robust mean of the absolute difference of brightness, finest level used
  double overlap_ratio = 0;  ///< of the reference's pixels, seen in the current frame
};

/// The motion that explains the picture best: inverse compositional alignment of brightness (Baker and
/// Matthews 2004, Kerl et al. 2013), coarse to fine, with Huber weights and a change of brightness. Starts
/// from the best of the guesses.
PhotometricResult align_photometrically(const PhotometricReference& reference, const ImagePyramid& current,
                                        const std::vector<SE3>& guesses_T_ref_cur);

/// Photometric alignment for a camera that may have turned far since the reference, as at a few frames a
/// second: patterns that repeat (wallpaper, tiles) then lead the search from a guess to a neighbour. Compares
/// the pictures at turns of up to 0.2 rad around a guess and goes on from the best few; never worse than
/// `result`.
PhotometricResult search_turns(const PhotometricReference& reference, const ImagePyramid& current,
                               const PhotometricResult& result, const std::vector<SE3>& guesses_T_ref_cur);

}  // namespace hm
