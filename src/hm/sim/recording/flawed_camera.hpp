#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "hm/sim/recording/flaws.hpp"
#include "hm/sim/recording/moving_people.hpp"
#include "hm/sim/sensor/renderer.hpp"

namespace hm {

/// Depth and colour camera with the flaws of a real one, carried along a walk. Times are seconds after the
/// first frame. Const members may be called from several threads.
class FlawedCamera {
 public:
  struct Setup {
    const World& world;
    const Renderer& renderer;
    const Walk& walk;
    double duration_scale_ratio = 1;  ///< of the walk
    PinholeCamera stated_camera;
    FlawSizes sizes;
    std::uint64_t seed = 1;
  };
  /// Keeps references: world, renderer and walk must outlive it.
  explicit FlawedCamera(const Setup& setup);

  [[nodiscard]] SE3 T_world_camera(double elapsed_s) const;
  /// View of the depth camera from its pose at this time, and of a colour camera at its place.
  [[nodiscard]] RenderedView view(const SE3& T_world_camera, double elapsed_s,
                                  const ParallelLoop& loop) const;
  /// Colour image of the frame whose depth image is taken at this time.
  [[nodiscard]] Image<Rgb8> color(double elapsed_s, const ParallelLoop& loop) const;
  /// Factors of red, green and blue of this colour image.
  [[nodiscard]] Eigen::Vector3f gains(double elapsed_s) const;

 private:
  [[nodiscard]] RenderedView seen(const PinholeCamera& camera, std::span<const SE3> T_world_camera,
                                  double elapsed_s, const ParallelLoop& loop) const;
  [[nodiscard]] std::vector<SE3> row_poses(const PinholeCamera& camera, double middle_s) const;
  [[nodiscard]] int exposures(double middle_s) const;

  Setup setup_;
  PinholeCamera depth_camera_, color_camera_;
  SE3 T_depth_color_;
  std::optional<MovingPeople> people_;
};

}  // namespace hm
