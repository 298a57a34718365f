#pragma once
#include <optional>
#include <span>
#include <vector>

#include "hm/geometry/level/up_direction.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

/// Surface patch. `normal`: unit, towards free space.
struct SurfacePatch {
  Vec3 centre, normal;
  double area = 0;  ///< square metres
};
/// Converts at most about `most` triangles of a mesh, evenly selected, to patches; skips degenerate ones.
std::vector<SurfacePatch> patches_of(const TriangleMesh& mesh, std::size_t most = 200'000);

/// At most 500 orientations of a path, evenly selected, as evidence of how the camera was held.
std::vector<Mat3> rotations_of(const Trajectory& T_world_camera);

/// Evidence that a direction is up, from find_scene_up(). Areas as shares of the whole surface.
struct UpEvidence {
  Vec3 up = Vec3::UnitZ();
  double sigma_rad = 0;                   ///< standard deviation of its tilt
  double facing_up = 0, facing_down = 0;  ///< within 6 degrees
  double vertical = 0;  ///< within 6 degrees of vertical, minus the share expected by chance
  double held = 0;      ///< log likelihood of the camera being held like this; 0: level, upright
  double score = 0;     ///< total log likelihood; comparable within one scene only
};

/// Candidates for up, best first, at least 3 degrees apart.
///
/// Candidates are the normals of much of the surface (both signs) and the directions perpendicular to two of
/// them; each is refined to be parallel to the normals of horizontal surfaces and perpendicular to those of
/// vertical ones: the smallest eigenvector of sum(area n n^T) over vertical minus horizontal surfaces,
/// reweighted with windows of 10, 5 and 3 degrees. The score combines the share of horizontal and vertical
/// surface (where walls stand at all angles, only the true direction makes all of them vertical), the share
/// facing up rather than down, and how the camera would have been held (roll and pitch in each frame;
/// landscape before portrait).
std::vector<UpEvidence> scene_up_candidates(std::span<const SurfacePatch> patches,
                                            std::span<const Mat3> R_world_camera);

/// Estimates up from the horizontal and vertical surfaces of a scene. `kUnknown` (with the cameras' mean
/// upward direction as a guess) if too little of the surface is horizontal or vertical, if there is only one
/// plane, or if another direction more than 3 degrees away is about as likely.
UpDirection find_scene_up(std::span<const SurfacePatch> patches, std::span<const Mat3> R_world_camera);

/// Refines gravity's direction by horizontal and vertical surfaces within three of its standard deviations
/// (weighted mean). Returns gravity if there are none, or several that contradict each other.
UpDirection refine_gravity(const UpDirection& gravity, std::span<const SurfacePatch> patches);

}  // namespace hm
