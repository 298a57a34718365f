#pragma once
#include <memory>
#include <vector>

#include "hm/sim/motion/walk.hpp"
#include "hm/sim/sensor/renderer.hpp"

namespace hm {

/// People who walk along the path of a camera, 4 to 12 seconds ahead of it, now slower and now faster than
/// it. They do not move their limbs. Who would stand where the camera is (within kLeast_m) is not there.
/// Const members may be called from several threads.
class MovingPeople {
 public:
  static constexpr double kLeast_m = 0.6;

  /// Keeps a reference: the walk must outlive the people. The seed decides on how they look and walk.
  MovingPeople(const Walk& walk, int count, std::uint64_t seed);

  [[nodiscard]] std::size_t count() const { return people_.size(); }
  /// Where a person stands at a time of the walk; x forward, z up, the origin on the floor.
  [[nodiscard]] SE3 T_world_person(std::size_t person, double walk_s) const;
  /// Draws them into a view that was rendered with these poses (one for every row), all at the same time.
  void draw(const PinholeCamera& camera, std::span<const SE3> T_world_camera, double walk_s,
            RenderedView& view) const;

 private:
  struct Person {
    std::unique_ptr<World> body;
    Renderer renderer;
    double ahead_s = 0;                               ///< on average
    double reach_s = 0, period_s = 0, phase_rad = 0;  ///< of the change of this time
  };
  const Walk& walk_;
  std::vector<Person> people_;
};

}  // namespace hm
