#pragma once
#include <optional>
#include <span>
#include <vector>

#include "hm/geometry/level/up_direction.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

/// A piece of surface. `normal`: unit, towards free space.
struct SurfacePatch {
  Vec3 centre, normal;
  double area = 0;  ///< square metres
};
/// At most about `most` of a mesh's triangles, evenly picked; those that are broken are left out.
std::vector<SurfacePatch> patches_of(const TriangleMesh& mesh, std::size_t most = 200'000);

/// At most 500 of the orientations of a path, evenly picked: the hint of how the camera was held.
std::vector<Mat3> rotations_of(const Trajectory& T_world_camera);

/// Evidence that a direction is up, from find_scene_up(). Areas as shares of the whole surface.
struct UpEvidence {
  Vec3 up = Vec3::UnitZ();
  double sigma_rad = 0;                   ///< standard deviation of its tilt
  double facing_up = 0, facing_down = 0;  ///< within 6 degrees
  double vertical = 0;                    ///< within 6 degrees of vertical, beyond what chance gives
  double held = 0;   ///< logarithm of how likely a camera is held like this; 0: level, upright
  double score = 0;  ///< all of it, as a logarithm; compares candidates of one scene only
};

/// The candidates for up, best first, at least 3 degrees apart.
///
/// Candidates are the directions that much of the surface faces (both signs) and those at right angles to two
/// of them; each is refined to the direction that level surfaces are parallel and vertical ones perpendicular
/// to: the smallest eigenvector of sum(area n n^T) over vertical less level surfaces, reweighted with windows
/// of 10, 5 and 3 degrees. They are judged by how much of the surface is level or vertical (only the true one
/// has all walls upright, where walls stand at all angles), how much faces up rather than down, and how the
/// camera would have been held (roll and pitch in each frame; landscape before portrait).
std::vector<UpEvidence> scene_up_candidates(std::span<const SurfacePatch> patches,
                                            std::span<const Mat3> R_world_camera);

/// Up by the level and vertical surfaces of a scene; `kUnknown` (with the mean upward direction of the
/// cameras as a guess) where too little of the surface is level or vertical, where there is one plane only,
/// or where another direction more than 3 degrees away is about as likely.
UpDirection find_scene_up(std::span<const SurfacePatch> patches, std::span<const Mat3> R_world_camera);

/// Gravity's direction refined by level and vertical surfaces that stand within three of its standard
/// deviations: the weighted mean. Gravity alone where there are none, or several that contradict.
UpDirection refine_gravity(const UpDirection& gravity, std::span<const SurfacePatch> patches);

}  // namespace hm
