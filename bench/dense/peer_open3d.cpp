#include <open3d/Open3D.h>
#include <open3d/pipelines/integration/UniformTSDFVolume.h>
#include <tbb/global_control.h>

#include <cstring>

#include "dense/peer.hpp"
#include "hm/core/stopwatch.hpp"

namespace hm::bench {
namespace {

namespace o3d = open3d;

class ScalablePeer : public Peer {
 public:
  ScalablePeer(const PeerOptions& options, const PinholeCamera& camera)
      : options_(options),
        camera_(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy),
        volume_(options.voxel_size_m, options.band_m,
                options.color ? o3d::pipelines::integration::TSDFVolumeColorType::RGB8
                              : o3d::pipelines::integration::TSDFVolumeColorType::NoColor) {}

  void prepare(std::span<const RgbdFrame> frames) override {
    images_.clear();
    poses_.clear();
    for (const RgbdFrame& frame : frames) {
      o3d::geometry::Image depth, color;
      depth.Prepare(frame.depth.width(), frame.depth.height(), 1, 2);
      std::memcpy(depth.data_.data(), frame.depth.units.data(), depth.data_.size());
      color.Prepare(frame.depth.width(), frame.depth.height(), 3, 1);
      if (!frame.color.empty()) std::memcpy(color.data_.data(), frame.color.data(), color.data_.size());
      images_.push_back(o3d::geometry::RGBDImage::CreateFromColorAndDepth(
          color, depth, 1.0 / frame.depth.unit_m, options_.far_m, false));
      poses_.push_back(frame.T_world_camera->inverse().matrix());
    }
  }
  void integrate(std::size_t place) override { volume_.Integrate(*images_[place], camera_, poses_[place]); }

  std::size_t map_bytes() const override {
    return block_count() * 16 * 16 * 16 * sizeof(o3d::geometry::TSDFVoxel);
  }
  std::size_t block_count() const override {
    std::size_t count = 0;
    for (const auto& [key, unit] : volume_.volume_units_) count += unit.volume_ ? 1 : 0;
    return count;
  }
  TriangleMesh extract(double& milliseconds) override {
    const Stopwatch watch;
    const auto mesh = volume_.ExtractTriangleMesh();
    milliseconds = watch.milliseconds();
    TriangleMesh ours;
    for (const auto& vertex : mesh->vertices_) ours.vertices.push_back(vertex.cast<float>());
    for (const auto& t : mesh->triangles_)
      ours.triangles.push_back({static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]),
                                static_cast<std::uint32_t>(t[2])});
    return ours;
  }

 private:
  PeerOptions options_;
  o3d::camera::PinholeCameraIntrinsic camera_;
  o3d::pipelines::integration::ScalableTSDFVolume volume_;
  std::vector<std::shared_ptr<o3d::geometry::RGBDImage>> images_;
  std::vector<Eigen::Matrix4d> poses_;
};

/// Its kernels exist for 16-bit weights with 16-bit colours, and for float throughout; the first is the
/// faster one with colour, the second takes less without.
o3d::t::geometry::VoxelBlockGrid make_block_grid(const PeerOptions& options) {
  std::vector<std::string> names{"tsdf", "weight"};
  std::vector<o3d::core::Dtype> types{o3d::core::Float32, o3d::core::Float32};
  std::vector<o3d::core::SizeVector> shapes{{1}, {1}};
  if (options.color) {
    names.push_back("color");
    types = {o3d::core::Float32, o3d::core::UInt16, o3d::core::UInt16};
    shapes.push_back({3});
  }
  return {names, types, shapes, static_cast<float>(options.voxel_size_m), 8, 20000};
}

/// A block far away in buffer 0: its mesh extraction takes the very first voxel for a missing one and aborts.
void occupy_first_block(o3d::t::geometry::VoxelBlockGrid& grid) {
  o3d::core::Tensor buffers, masks;
  grid.GetHashMap().Activate(o3d::core::Tensor::Init<int>({{100000, 100000, 100000}}), buffers, masks);
}

class VoxelBlockPeer : public Peer {
 public:
  VoxelBlockPeer(const PeerOptions& options, const PinholeCamera& camera)
      : options_(options), grid_(make_block_grid(options)) {
    const Eigen::Matrix3d k =
        (Eigen::Matrix3d() << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1).finished();
    occupy_first_block(grid_);
    intrinsic_ = o3d::core::eigen_converter::EigenMatrixToTensor(k);
  }

  void prepare(std::span<const RgbdFrame> frames) override {
    depths_.clear();
    colors_.clear();
    poses_.clear();
    for (const RgbdFrame& frame : frames) {
      const std::int64_t height = frame.depth.height(), width = frame.depth.width();
      depths_.emplace_back(
          o3d::core::Tensor(frame.depth.units.data(), {height, width, 1}, o3d::core::UInt16));
      if (options_.color)
        colors_.emplace_back(o3d::core::Tensor(reinterpret_cast<const std::uint8_t*>(frame.color.data()),
                                               {height, width, 3}, o3d::core::UInt8));
      poses_.push_back(o3d::core::eigen_converter::EigenMatrixToTensor(
          Eigen::Matrix4d(frame.T_world_camera->inverse().matrix())));
      depth_scale_ = static_cast<float>(1.0 / frame.depth.unit_m);
    }
  }

  void integrate(std::size_t place) override {
    const auto far = static_cast<float>(options_.far_m);
    const auto band = static_cast<float>(options_.band_m / options_.voxel_size_m);
    const auto blocks =
        grid_.GetUniqueBlockCoordinates(depths_[place], intrinsic_, poses_[place], depth_scale_, far, band);
    if (options_.color)
      grid_.Integrate(blocks, depths_[place], colors_[place], intrinsic_, poses_[place], depth_scale_, far,
                      band);
    else
      grid_.Integrate(blocks, depths_[place], intrinsic_, poses_[place], depth_scale_, far, band);
  }

  std::size_t map_bytes() const override { return block_count() * 512 * (options_.color ? 12 : 8); }
  std::size_t block_count() const override {
    return static_cast<std::size_t>(
               const_cast<o3d::t::geometry::VoxelBlockGrid&>(grid_).GetHashMap().Size()) -
           1;
  }
  TriangleMesh extract(double& milliseconds) override {
    const Stopwatch watch;
    const auto mesh = grid_.ExtractTriangleMesh(0.0f, estimated_vertices_);
    milliseconds = watch.milliseconds();
    const auto legacy = mesh.ToLegacy();
    estimated_vertices_ = static_cast<int>(legacy.vertices_.size());  // a later call has one pass less
    TriangleMesh ours;
    for (const auto& vertex : legacy.vertices_) ours.vertices.push_back(vertex.cast<float>());
    for (const auto& t : legacy.triangles_)
      ours.triangles.push_back({static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]),
                                static_cast<std::uint32_t>(t[2])});
    return ours;
  }

 private:
  PeerOptions options_;
  o3d::t::geometry::VoxelBlockGrid grid_;
  o3d::core::Tensor intrinsic_;
  std::vector<o3d::t::geometry::Image> depths_, colors_;
  std::vector<o3d::core::Tensor> poses_;
  float depth_scale_ = 1000;
  int estimated_vertices_ = -1;
};

}  // namespace

std::unique_ptr<Peer> make_peer(const PeerOptions& options, const PinholeCamera& camera) {
  if (options.grid == PeerGrid::kScalable) return std::make_unique<ScalablePeer>(options, camera);
  return std::make_unique<VoxelBlockPeer>(options, camera);
}
bool has_peer() { return true; }
void limit_peer_threads(int threads) {
  static std::unique_ptr<tbb::global_control> control;
  control = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(threads));
  o3d::utility::SetVerbosityLevel(o3d::utility::VerbosityLevel::Error);
}

}  // namespace hm::bench
