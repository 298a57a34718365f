#include "hm/evaluation/depth_agreement.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hm/core/check.hpp"
#include "hm/evaluation/embree_mesh.hpp"

namespace hm {
namespace {

/// Median (reordering the values) and mean, in the unit given.
std::pair<double, double> median_and_mean(std::span<float> values) {
  if (values.empty()) return {0, 0};
  double sum = 0;
  for (const float v : values) sum += static_cast<double>(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  double median = static_cast<double>(*middle);
  if (values.size() % 2 == 0)
    median = 0.5 * (median + static_cast<double>(*std::max_element(values.begin(), middle)));
  return {median, sum / static_cast<double>(values.size())};
}

}  // namespace

struct DepthCaster::Impl {
  std::unique_ptr<EmbreeMesh> mesh;
};

DepthCaster::DepthCaster(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DepthCaster::~DepthCaster() = default;
DepthCaster::DepthCaster(DepthCaster&&) noexcept = default;
DepthCaster& DepthCaster::operator=(DepthCaster&&) noexcept = default;

Result<DepthCaster> DepthCaster::build(const TriangleMesh& mesh) {
  auto built = EmbreeMesh::build(mesh);
  if (!built) return forward_error(built);
  return DepthCaster(std::make_unique<Impl>(Impl{std::move(*built)}));
}

Image<float> DepthCaster::render(const PinholeCamera& camera, const SE3& T_world_camera,
                                 const ParallelLoop& loop) const {
  Image<float> depth(camera.width, camera.height, 0.F);
  const Eigen::Vector3f origin = T_world_camera.translation().cast<float>();
  loop.for_ranges(static_cast<std::size_t>(camera.height), 8, [&](std::size_t begin, std::size_t end) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < camera.width; ++x) {
        // A direction of depth 1, so that the ray's length is the depth.
        const Eigen::Vector3f ray =
            (T_world_camera.rotation() * camera.unproject(Vec2(x, y), 1.0)).cast<float>();
        RTCRayHit hit{};
        hit.ray = {origin.x(),  origin.y(), origin.z(),
                   1e-4F,       ray.x(),    ray.y(),
                   ray.z(),     0,          std::numeric_limits<float>::infinity(),
                   0xffffffffU, 0,          0};
        hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(impl_->mesh->scene(), &context, &hit);
        if (hit.hit.geomID != RTC_INVALID_GEOMETRY_ID) depth(x, y) = hit.ray.tfar;
      }
  });
  return depth;
}

DepthAgreement::FrameResult DepthAgreement::add(std::span<const float> measured_m,
                                                std::span<const float> rendered_m) {
  HM_CHECK(measured_m.size() == rendered_m.size(), "{} measured, {} rendered pixels", measured_m.size(),
           rendered_m.size());
  FrameResult frame;
  const std::size_t first = differences_m_.size();
  for (std::size_t i = 0; i < measured_m.size(); ++i) {
    const auto measured = static_cast<double>(measured_m[i]);
    if (!(measured > 0 && measured >= min_depth_m_ && measured <= max_depth_m_)) continue;
    ++frame.valid;
    if (!(rendered_m[i] > 0)) continue;
    ++frame.covered;
    differences_m_.push_back(std::abs(rendered_m[i] - measured_m[i]));
  }
  const auto [median_m, mean_m] = median_and_mean(std::span(differences_m_).subspan(first));
  frame.median_mm = 1e3 * median_m;
  frame.mean_mm = 1e3 * mean_m;
  valid_ += frame.valid;
  ++frames_;
  return frame;
}

DepthAgreement::FrameResult DepthAgreement::total() const {
  std::vector<float> differences = differences_m_;
  const auto [median_m, mean_m] = median_and_mean(differences);
  return {valid_, differences_m_.size(), 1e3 * median_m, 1e3 * mean_m};
}

double DepthAgreement::covered_ratio() const {
  return valid_ > 0 ? static_cast<double>(differences_m_.size()) / static_cast<double>(valid_) : 0.0;
}

}  // namespace hm
