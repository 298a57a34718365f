#include "hm/sim/sensor/renderer.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>
#include <stdexcept>

namespace hm {
namespace {

constexpr int kTile = 4;  ///< a packet is a square of 4 x 4 pixels
constexpr int kPacket = kTile * kTile;

/// Illumination of a surface: from above and from three sides, fixed in the world. Without shadows, so that
/// it depends on the normal only.
float light(const Eigen::Vector3f& n) {
  const float a = std::max(0.0f, 0.45f * n.x() + 0.35f * n.y() + 0.82f * n.z());
  const float b = std::max(0.0f, -0.6f * n.x() + 0.75f * n.y() + 0.28f * n.z());
  const float c = std::max(0.0f, 0.2f * n.x() - 0.95f * n.y() + 0.2f * n.z());
  const float bounced = 0.36f * std::max(0.0f, -n.z());
  return 0.6f + bounced + 0.28f * a + 0.16f * b + 0.22f * c;
}

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value * 255.0f + 0.5f, 0.0f, 255.0f));
}

/// Plane normal.dot(p) = offset.
struct Plane {
  Vec3 normal;
  double offset;
};

Vec3 closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = (b - a).cross(c - a);
  const std::pair<Vec3, Vec3> edges[] = {{a, b}, {b, c}, {c, a}};
  bool inside = normal.squaredNorm() > 0;
  Vec3 best = a;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [from, to] : edges) {
    const Vec3 edge = to - from;
    inside = inside && normal.dot(edge.cross(p - from)) >= 0;
    const double length2 = std::max(edge.squaredNorm(), 1e-30);
    const Vec3 on_edge = from + std::clamp(edge.dot(p - from) / length2, 0.0, 1.0) * edge;
    if ((p - on_edge).squaredNorm() < nearest) nearest = (p - on_edge).squaredNorm(), best = on_edge;
  }
  return inside ? Vec3(p - normal * (normal.dot(p - a) / normal.squaredNorm())) : best;
}

/// What Embree says about its first error. Of fixed size: memory may have run out.
using EmbreeReason = std::array<char, 256>;

void keep_reason(void* reason, RTCError, const char* text) {
  auto& kept = *static_cast<EmbreeReason*>(reason);
  if (kept[0] == '\0') std::snprintf(kept.data(), kept.size(), "%s", text != nullptr ? text : "");
}

/// Throws when Embree has failed: std::bad_alloc if memory ran out, else std::runtime_error with Embree's own
/// words. Null: it gave no device.
void check_embree(RTCDevice device, const EmbreeReason& reason) {
  const RTCError code = rtcGetDeviceError(device);
  if (code == RTC_ERROR_NONE && device != nullptr) return;
  if (code == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw std::runtime_error(fmt::format(
      "Embree cannot build the scene (its error {}: {})", static_cast<int>(code),
      reason[0] != '\0' ? reason.data() : "no reason given; the system may have refused a thread"));
}

struct ReleaseEmbree {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <class Handle>
using EmbreeOwner = std::unique_ptr<std::remove_pointer_t<Handle>, ReleaseEmbree>;

}  // namespace

struct Renderer::Impl {
  const World* world = nullptr;
  TriangleMesh mesh;
  std::vector<Plane> planes;           ///< of every triangle
  std::vector<std::uint16_t> part_of;  ///< of every triangle
  std::vector<Reflectance> returns;    ///< of every part
  EmbreeReason reason{};               ///< of the last error; the device points to it
  EmbreeOwner<RTCDevice> device;
  EmbreeOwner<RTCScene> scene;

  explicit Impl(const World& w) : world(&w), mesh(merged_mesh(w)) {
    HM_CHECK(w.parts.size() < RenderedView::kNoPart, "{} parts", w.parts.size());
    for (const WorldPart& part : w.parts) returns.push_back(part.material.reflectance);
    for (std::size_t i = 0; i < w.parts.size(); ++i)
      part_of.insert(part_of.end(), w.parts[i].mesh.triangles.size(), static_cast<std::uint16_t>(i));
    for (const auto& t : mesh.triangles) {
      const Vec3 a = mesh.vertices[t[0]].cast<double>();
      const Vec3 cross =
          (mesh.vertices[t[1]].cast<double>() - a).cross(mesh.vertices[t[2]].cast<double>() - a);
      const Vec3 normal = cross.normalized();
      planes.push_back({normal, normal.dot(a)});
    }
    build_scene();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void build_scene() {
    // A number of threads here would be a limit of TBB for the whole process while the device lives.
    device.reset(rtcNewDevice(nullptr));
    check_embree(device.get(), reason);
    rtcSetDeviceErrorFunction(device.get(), keep_reason, &reason);
    scene.reset(rtcNewScene(device.get()));
    check_embree(device.get(), reason);
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    const EmbreeOwner<RTCGeometry> geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    check_embree(device.get(), reason);
    void* vertices = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             3 * sizeof(float), mesh.vertices.size());
    void* indices = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), mesh.triangles.size());
    check_embree(device.get(), reason);
    std::copy_n(mesh.vertices.data()->data(), 3 * mesh.vertices.size(), static_cast<float*>(vertices));
    std::copy_n(mesh.triangles.data()->data(), 3 * mesh.triangles.size(),
                static_cast<std::uint32_t*>(indices));
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene.get(), geometry.get());
    rtcCommitScene(scene.get());
    rtcSetDeviceErrorFunction(device.get(), nullptr, nullptr);
    check_embree(device.get(), reason);
  }

  [[nodiscard]] Vec3 corner(std::uint32_t triangle, std::size_t k) const {
    return mesh.vertices[mesh.triangles[triangle][k]].cast<double>();
  }

  /// Colour of a point on a triangle, independent of the view.
  [[nodiscard]] Rgb8 shade(std::uint32_t triangle, const Vec3& p) const {
    const Eigen::Vector3f n = planes[triangle].normal.cast<float>();
    const Material& material = world->parts[part_of[triangle]].material;
    const float light_here = material.pattern == Pattern::kSky ? 1.0f : light(n);
    const Eigen::Vector3f c = albedo(material, p.cast<float>(), n) * light_here;
    return {to_byte(c.x()), to_byte(c.y()), to_byte(c.z())};
  }
};

namespace {

/// Packet of rays of up to 16 pixels or beams; invalid lanes are disabled.
struct Packet {
  alignas(64) int valid[kPacket] = {};
  RTCRayHit16 hits{};  // Embree checks lanes that are not valid, too, where it is built with assertions
  Vec3 origin[kPacket], direction[kPacket];

  void set(std::size_t lane, const Vec3& from, const Vec3& along, double near_m) {
    origin[lane] = from, direction[lane] = along;
    const Eigen::Vector3f o = from.cast<float>(), d = along.cast<float>();
    RTCRay16& ray = hits.ray;
    ray.org_x[lane] = o.x(), ray.org_y[lane] = o.y(), ray.org_z[lane] = o.z();
    ray.dir_x[lane] = d.x(), ray.dir_y[lane] = d.y(), ray.dir_z[lane] = d.z();
    ray.tnear[lane] = static_cast<float>(near_m);
    ray.tfar[lane] = std::numeric_limits<float>::infinity();
    ray.time[lane] = 0, ray.mask[lane] = ~0u, ray.id[lane] = 0, ray.flags[lane] = 0;
    hits.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    hits.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }
  void trace(RTCScene scene) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(valid, scene, &context, &hits);
  }
  /// Distance along the ray to the plane of the hit triangle, in lengths of its direction.
  [[nodiscard]] double distance(std::size_t lane, const Plane& plane) const {
    const double along = plane.normal.dot(direction[lane]);
    return std::abs(along) > 1e-9 ? (plane.offset - plane.normal.dot(origin[lane])) / along
                                  : static_cast<double>(hits.ray.tfar[lane]);
  }
};

/// Fills the packet for the tile at (x0, y0) with the camera poses of its rows, and traces it.
void trace_tile(RTCScene scene, const PinholeCamera& camera, int x0, int y0,
                std::span<const SE3> T_world_camera, Packet& packet) {
  for (std::size_t lane = 0; lane < kPacket; ++lane) {
    const int x = x0 + static_cast<int>(lane) % kTile, y = y0 + static_cast<int>(lane) / kTile;
    const bool inside = x < camera.width && y < camera.height;
    packet.valid[lane] = inside ? -1 : 0;
    const SE3& pose = T_world_camera[static_cast<std::size_t>(std::min(y, camera.height - 1))];
    const double u = (x - camera.cx) / camera.fx, v = (y - camera.cy) / camera.fy;
    const Vec3 d = pose.rotation().col(0) * u + pose.rotation().col(1) * v + pose.rotation().col(2);
    packet.set(lane, pose.translation(), d, 1e-3);
  }
  packet.trace(scene);
}

/// Calls body(x0, y0) for every tile of the image.
template <class Body>
void for_tiles(const PinholeCamera& camera, const ParallelLoop& loop, const Body& body) {
  const auto tile_rows = static_cast<std::size_t>((camera.height + kTile - 1) / kTile);
  loop.for_ranges(tile_rows, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (int x = 0; x < camera.width; x += kTile) body(x, static_cast<int>(row) * kTile);
  });
}

}  // namespace

Renderer::Renderer(const World& world) : impl_(std::make_unique<Impl>(world)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

RenderedView Renderer::render(const PinholeCamera& camera, const SE3& T_world_camera,
                              const ParallelLoop& loop) const {
  const std::vector<SE3> of_rows(static_cast<std::size_t>(camera.height), T_world_camera);
  return render(camera, of_rows, loop);
}

RenderedView Renderer::render(const PinholeCamera& camera, std::span<const SE3> T_world_camera,
                              const ParallelLoop& loop) const {
  HM_CHECK(camera.distortion.is_zero(), "rendering needs an undistorted camera");
  const int w = camera.width, h = camera.height;
  HM_CHECK(T_world_camera.size() == static_cast<std::size_t>(h), "{} poses for {} rows",
           T_world_camera.size(), h);
  RenderedView view{Image<float>(w, h),
                    Image<float>(w, h),
                    Image<std::uint16_t>(w, h, RenderedView::kNoPart),
                    Image<Eigen::Vector3f>(w, h, Eigen::Vector3f::Zero()),
                    Image<Rgb8>(w, h),
                    impl_->returns};
  for_tiles(camera, loop, [&](int x0, int y0) {
    Packet packet;
    trace_tile(impl_->scene.get(), camera, x0, y0, T_world_camera, packet);
    for (std::size_t lane = 0; lane < kPacket; ++lane) {
      if (!packet.valid[lane] || packet.hits.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) continue;
      const int x = x0 + static_cast<int>(lane) % kTile, y = y0 + static_cast<int>(lane) / kTile;
      const std::uint32_t triangle = packet.hits.hit.primID[lane];
      const Plane& plane = impl_->planes[triangle];
      const Vec3 &o = packet.origin[lane], &d = packet.direction[lane];
      const double along = plane.normal.dot(d), z = packet.distance(lane, plane);
      view.depth_m(x, y) = static_cast<float>(z);
      view.cos_incidence(x, y) = static_cast<float>(std::abs(along) / d.norm());
      view.part(x, y) = impl_->part_of[triangle];
      view.normal(x, y) = plane.normal.cast<float>();
      view.color(x, y) = impl_->shade(triangle, o + z * d);
    }
  });
  return view;
}

void Renderer::cast(std::span<const Ray> rays, std::span<RayHit> hits) const {
  HM_CHECK(rays.size() == hits.size(), "{} hits for {} rays", hits.size(), rays.size());
  for (std::size_t begin = 0; begin < rays.size(); begin += kPacket) {
    const std::size_t count = std::min<std::size_t>(kPacket, rays.size() - begin);
    Packet packet;
    for (std::size_t lane = 0; lane < count; ++lane) {
      const Ray& ray = rays[begin + lane];
      packet.valid[lane] = -1;
      packet.set(lane, ray.origin_world, ray.direction_world, ray.near_m);
    }
    packet.trace(impl_->scene.get());
    for (std::size_t lane = 0; lane < count; ++lane) {
      RayHit& hit = hits[begin + lane];
      hit = {};
      if (packet.hits.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) continue;
      const std::uint32_t triangle = packet.hits.hit.primID[lane];
      hit = {packet.distance(lane, impl_->planes[triangle]), impl_->planes[triangle].normal,
             impl_->part_of[triangle], triangle};
    }
  }
}

Rgb8 Renderer::color(const Ray& ray, const RayHit& hit) const {
  return impl_->shade(hit.triangle, ray.origin_world + hit.range_m * ray.direction_world);
}

bool Renderer::is_free(const Vec3& a_world, const Vec3& b_world, double margin_m) const {
  const Vec3 d = b_world - a_world;
  const double length = d.norm();
  if (length <= 2 * margin_m) return true;
  RTCRay ray{};
  ray.org_x = static_cast<float>(a_world.x()), ray.org_y = static_cast<float>(a_world.y());
  ray.org_z = static_cast<float>(a_world.z());
  ray.dir_x = static_cast<float>(d.x() / length), ray.dir_y = static_cast<float>(d.y() / length);
  ray.dir_z = static_cast<float>(d.z() / length);
  ray.tnear = static_cast<float>(margin_m), ray.tfar = static_cast<float>(length - margin_m);
  ray.mask = ~0u;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(impl_->scene.get(), &context, &ray);
  return ray.tfar >= 0;  // Embree marks a hit with -infinity
}

double Renderer::clearance_m(const Vec3& p_world, double limit_m) const {
  struct Search {
    const Impl* impl;
    Vec3 p;
    double nearest;
  } search{impl_.get(), p_world, limit_m};
  RTCPointQuery query{};
  query.x = static_cast<float>(p_world.x()), query.y = static_cast<float>(p_world.y());
  query.z = static_cast<float>(p_world.z());
  query.radius = static_cast<float>(limit_m);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  const auto visit = [](RTCPointQueryFunctionArguments* args) {
    auto& s = *static_cast<Search*>(args->userPtr);
    const std::uint32_t t = args->primID;
    const Vec3 on =
        closest_on_triangle(s.p, s.impl->corner(t, 0), s.impl->corner(t, 1), s.impl->corner(t, 2));
    const double distance = (on - s.p).norm();
    if (distance >= s.nearest) return false;
    s.nearest = distance;
    args->query->radius = static_cast<float>(distance);
    return true;
  };
  rtcPointQuery(impl_->scene.get(), &query, &context, visit, &search);
  return search.nearest;
}

}  // namespace hm
