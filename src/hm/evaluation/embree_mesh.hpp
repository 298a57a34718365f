#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/triangle_mesh.hpp"

struct RTCSceneTy;  // Embree's own types, named here so that only .cpp files include Embree
struct RTCDeviceTy;

namespace hm {

/// Embree's error of a number (RTCError) as an Error with a remedy. Only RTC_ERROR_OUT_OF_MEMORY is one of
/// memory (kOutOfMemory); others (kInternal), such as the unknown one of a thread that the system refuses,
/// say `reason`: Embree's words, "" if it gave none.
Error embree_error(int code, const char* reason, std::size_t triangles);

/// Mesh with Embree's bounding volume hierarchy over its valid triangles; internal to this room. The order of
/// triangles in the hierarchy may differ between machines; searches must not depend on it.
class EmbreeMesh {
 public:
  /// Triangles with missing, non-finite or implausible (beyond 1e9 m) vertices are skipped; error when none
  /// remains.
  static Result<std::unique_ptr<EmbreeMesh>> build(const TriangleMesh& mesh);
  ~EmbreeMesh();
  EmbreeMesh(const EmbreeMesh&) = delete;
  EmbreeMesh& operator=(const EmbreeMesh&) = delete;

  [[nodiscard]] RTCSceneTy* scene() const { return scene_; }
  /// Corners of the i-th valid triangle (Embree's primID).
  [[nodiscard]] std::array<Vec3, 3> corners(std::uint32_t index) const;
  /// Index of the i-th valid triangle in the original mesh.
  [[nodiscard]] std::uint32_t original_index(std::uint32_t index) const { return original_[index]; }
  [[nodiscard]] std::size_t size() const { return triangles_.size(); }

 private:
  EmbreeMesh() = default;
  std::vector<Eigen::Vector3f> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::uint32_t> original_;
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* scene_ = nullptr;
};

}  // namespace hm
