#include "hm/evaluation/embree_mesh.hpp"

#include <embree3/rtcore.h>

#include <array>
#include <cmath>
#include <cstdio>

namespace hm {
namespace {

bool is_sound(const Eigen::Vector3f& v) {
  constexpr float kLimit = 1e9F;
  return std::abs(v.x()) < kLimit && std::abs(v.y()) < kLimit && std::abs(v.z()) < kLimit;  // false for NaN
}

/// What Embree says about its first error. Of fixed size: memory may have run out.
using EmbreeReason = std::array<char, 256>;

void keep_reason(void* reason, RTCError, const char* text) {
  auto& kept = *static_cast<EmbreeReason*>(reason);
  if (kept[0] == '\0') std::snprintf(kept.data(), kept.size(), "%s", text != nullptr ? text : "");
}

}  // namespace

Error embree_error(int code, const char* reason, std::size_t triangles) {
  if (code == RTC_ERROR_OUT_OF_MEMORY)
    return {ErrorCode::kOutOfMemory,
            fmt::format("out of memory: no search tree over {} triangles; a simplified mesh (hm convert, "
                        "mesh.simplify_keep_ratio) or fewer threads (--threads) need less",
                        triangles),
            {}};
  return {ErrorCode::kInternal,
          fmt::format("no search tree over {} triangles: Embree's error {}: {}", triangles, code,
                      *reason != '\0' ? reason : "no reason given; the system may have refused a thread"),
          {}};
}

Result<std::unique_ptr<EmbreeMesh>> EmbreeMesh::build(const TriangleMesh& mesh) {
  std::unique_ptr<EmbreeMesh> out(new EmbreeMesh());
  out->vertices_ = mesh.vertices;
  for (auto& v : out->vertices_)
    if (!is_sound(v)) v.setZero();
  out->vertices_.emplace_back(0.F, 0.F, 0.F);  // Embree loads 16 bytes at the last vertex
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    bool sound = true;
    for (const std::uint32_t index : t)
      sound = sound && index < mesh.vertices.size() && is_sound(mesh.vertices[index]);
    if (!sound) continue;
    out->triangles_.push_back(t);
    out->original_.push_back(static_cast<std::uint32_t>(i));
  }
  if (out->triangles_.empty())
    return fail(ErrorCode::kInvalidValue, {}, "the mesh has no usable triangle ({} vertices, {} triangles)",
                mesh.vertices.size(), mesh.triangles.size());
  out->device_ = rtcNewDevice(nullptr);  // "threads=n" would cap TBB for the whole process
  if (out->device_ == nullptr)
    return tl::make_unexpected(embree_error(rtcGetDeviceError(nullptr), "", out->triangles_.size()));
  EmbreeReason reason{};
  rtcSetDeviceErrorFunction(out->device_, keep_reason, &reason);
  out->scene_ = rtcNewScene(out->device_);
  rtcSetSceneFlags(out->scene_, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(out->device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, out->vertices_.data(), 0,
                             sizeof(Eigen::Vector3f), out->vertices_.size() - 1);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, out->triangles_.data(), 0,
                             sizeof(out->triangles_[0]), out->triangles_.size());
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(out->scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(out->scene_);
  rtcSetDeviceErrorFunction(out->device_, nullptr, nullptr);
  if (const RTCError code = rtcGetDeviceError(out->device_); code != RTC_ERROR_NONE)
    return tl::make_unexpected(embree_error(code, reason.data(), out->triangles_.size()));
  return out;
}

EmbreeMesh::~EmbreeMesh() {
  if (scene_ != nullptr) rtcReleaseScene(scene_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

std::array<Vec3, 3> EmbreeMesh::corners(std::uint32_t index) const {
  const auto& t = triangles_[index];
  return {vertices_[t[0]].cast<double>(), vertices_[t[1]].cast<double>(), vertices_[t[2]].cast<double>()};
}

}  // namespace hm
