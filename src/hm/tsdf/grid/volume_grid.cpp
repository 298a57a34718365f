#include "hm/tsdf/grid/volume_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "hm/core/check.hpp"
#include "hm/tsdf/grid/volume_grid_impl.hpp"

namespace hm {
namespace {

bool key_order(VolumeKey a, VolumeKey b) { return std::array{a.z, a.y, a.x} < std::array{b.z, b.y, b.x}; }

int floor_to_int(double v) { return static_cast<int>(std::floor(v)); }

}  // namespace

VolumeGrid::VolumeGrid(double voxel_size_m, double sdf_unit_m, std::size_t max_bytes)
    : voxel_size_m_(voxel_size_m), sdf_unit_m_(sdf_unit_m), impl_(std::make_unique<Impl>()) {
  HM_CHECK(voxel_size_m > 0 && sdf_unit_m > 0, "voxel {} m, unit {} m", voxel_size_m, sdf_unit_m);
  impl_->max_bytes = max_bytes;
}
VolumeGrid::~VolumeGrid() = default;
VolumeGrid::VolumeGrid(VolumeGrid&&) noexcept = default;
VolumeGrid& VolumeGrid::operator=(VolumeGrid&&) noexcept = default;

const Volume* VolumeGrid::find(VolumeKey key) const {
  Page* page = nullptr;
  return impl_->find(key, page);
}

Volume* VolumeGrid::find(VolumeKey key) {
  Page* page = nullptr;
  Volume* volume = impl_->find(key, page);
  if (!volume) return nullptr;
  impl_->keep_for_snapshot(*page, place_in_page(key));
  page->last_used = impl_->pack_calls;
  return volume;
}

bool VolumeGrid::contains(VolumeKey key) const {
  const Page* page = impl_->pages.find(page_of(key));
  return page && (page->occupied >> place_in_page(key) & 1u);
}

VolumeGrid::Found VolumeGrid::look_up(VolumeKey key) const {
  Page* page = impl_->pages.find(page_of(key));
  const unsigned place = place_in_page(key);
  if (!page || (page->occupied >> place & 1u) == 0) return {};
  return {page, key, (page->interior >> place & 1u) != 0};
}

Volume* VolumeGrid::open(const Found& found) {
  if (!found.page) return nullptr;
  const unsigned place = place_in_page(found.key);
  Volume& volume = found.page->volumes[place];
  if (!volume.voxels) impl_->unpack(*found.page, place);
  impl_->keep_for_snapshot(*found.page, place);
  found.page->last_used = impl_->pack_calls;
  return &volume;
}

Volume* VolumeGrid::allocate(VolumeKey key) {
  if (Volume* existing = find(key)) return existing;
  if (!PageTable::is_representable(page_of(key))) return nullptr;
  if (!impl_->may_take_block(impl_->pages.find(page_of(key)) ? 0 : sizeof(Page))) {
    ++impl_->refused;
    return nullptr;
  }
  void* block = impl_->pool.take();
  Page& page = impl_->pages.find_or_add(page_of(key));
  Volume& volume = page.volumes[place_in_page(key)];
  volume = {key, static_cast<TsdfVoxel*>(block), nullptr};
  page.occupied |= std::uint64_t{1} << place_in_page(key);
  page.last_used = impl_->pack_calls;
  ++impl_->volume_count;
  return &volume;
}

bool VolumeGrid::allocate_colors(Volume& volume) {
  if (volume.colors) return true;
  if (!impl_->may_take_block()) return false;
  volume.colors = static_cast<ColorVoxel*>(impl_->pool.take());
  return true;
}

void VolumeGrid::release_colors(Volume& volume) {
  if (!volume.colors) return;
  impl_->pool.give_back(volume.colors, true);
  volume.colors = nullptr;
}

void VolumeGrid::release_unused_colors(Volume& volume) {
  if (!volume.colors) return;
  impl_->pool.give_back(volume.colors, false);
  volume.colors = nullptr;
}

void VolumeGrid::release(VolumeKey key) { release(key, true); }
void VolumeGrid::release_unused(VolumeKey key) { release(key, false); }

void VolumeGrid::release(VolumeKey key, bool dirty) {
  Page* page = impl_->pages.find(page_of(key));
  const unsigned place = place_in_page(key);
  if (!page || (page->occupied >> place & 1u) == 0) return;
  impl_->keep_for_snapshot(*page, place);
  Volume& volume = page->volumes[place];
  if (volume.voxels) {
    release_colors(volume);
    impl_->pool.give_back(volume.voxels, dirty);
  } else {
    impl_->drop_packed(*page, place);
  }
  volume = {};
  page->occupied &= ~(std::uint64_t{1} << place);
  page->interior &= ~(std::uint64_t{1} << place);
  --impl_->volume_count;
  if (page->occupied == 0) impl_->remove_page(*page);
}

void VolumeGrid::set_may_hold_interior(VolumeKey key, bool may_hold) {
  Page* page = impl_->pages.find(page_of(key));
  HM_CHECK(page, "volume {} {} {} is not there", key.x, key.y, key.z);
  impl_->keep_for_snapshot(*page, place_in_page(key));
  const std::uint64_t bit = std::uint64_t{1} << place_in_page(key);
  page->interior = may_hold ? page->interior | bit : page->interior & ~bit;
}

bool VolumeGrid::may_hold_interior(VolumeKey key) const {
  const Page* page = impl_->pages.find(page_of(key));
  return page && (page->interior >> place_in_page(key) & 1u);
}

std::size_t VolumeGrid::volume_count() const { return impl_->volume_count; }

std::vector<VolumeKey> VolumeGrid::sorted_keys() const {
  std::vector<VolumeKey> keys;
  keys.reserve(impl_->volume_count);
  for (const Page* page : impl_->pages.unsorted_pages())
    for (std::uint64_t bits = page->occupied; bits != 0; bits &= bits - 1)
      keys.push_back(page->volumes[static_cast<std::size_t>(std::countr_zero(bits))].key);
  std::sort(keys.begin(), keys.end(), key_order);
  return keys;
}

template <class Visitor>
void VolumeGrid::visit_pages(const Box3& box, Visitor&& visit) const {
  if (box.isEmpty()) return;
  const double page_size_m = volume_size_m() * kPageSide;
  const Vec3 lo = (box.min() / page_size_m).array().floor().max(-1e6);
  const Vec3 hi = (box.max() / page_size_m).array().floor().min(1e6);
  const Vec3 extent = hi - lo + Vec3::Ones();
  if (extent.prod() > static_cast<double>(impl_->pages.size()) * 4) {  // fewer pages than places to look
    for (Page* page : impl_->pages.unsorted_pages()) {
      const Vec3 at(page->key.x, page->key.y, page->key.z);
      if ((at.array() >= lo.array()).all() && (at.array() <= hi.array()).all()) visit(*page);
    }
    return;
  }
  for (int z = static_cast<int>(lo.z()); z <= static_cast<int>(hi.z()); ++z)
    for (int y = static_cast<int>(lo.y()); y <= static_cast<int>(hi.y()); ++y)
      for (int x = static_cast<int>(lo.x()); x <= static_cast<int>(hi.x()); ++x)
        if (Page* page = impl_->pages.find({x, y, z})) visit(*page);
}

std::vector<VolumeKey> VolumeGrid::keys_in(const Box3& box) const {
  std::vector<VolumeKey> keys;
  visit_pages(box, [&](const Page& page) {
    for (std::uint64_t bits = page.occupied; bits != 0; bits &= bits - 1) {
      const VolumeKey key = page.volumes[static_cast<std::size_t>(std::countr_zero(bits))].key;
      const Vec3 low = Vec3(key.x, key.y, key.z) * volume_size_m();
      if (box.intersects(Box3(low, low + Vec3::Constant(volume_size_m())))) keys.push_back(key);
    }
  });
  std::sort(keys.begin(), keys.end(), key_order);
  return keys;
}

void VolumeGrid::find_interior(const Box3& box, std::vector<VolumeKey>& keys) const {
  visit_pages(box, [&](const Page& page) {
    for (std::uint64_t bits = page.interior; bits != 0; bits &= bits - 1)
      keys.push_back(key_at(page.key, std::countr_zero(bits)));
  });
}

Box3 VolumeGrid::bounds() const {
  Box3 box;
  for (const VolumeKey key : sorted_keys()) {
    const Vec3 low = Vec3(key.x, key.y, key.z) * volume_size_m();
    box.extend(low);
    box.extend(low + Vec3::Constant(volume_size_m()));
  }
  return box;
}

std::size_t VolumeGrid::map_bytes() const {
  return impl_->pool.blocks_in_use() * BlockPool::kBlockBytes + impl_->packed_bytes + impl_->pages.bytes();
}
std::size_t VolumeGrid::unpacked_bytes() const { return impl_->unpacked_bytes(); }
std::size_t VolumeGrid::max_bytes() const { return impl_->max_bytes; }
std::size_t VolumeGrid::volumes_refused() const { return impl_->refused; }
void VolumeGrid::set_max_bytes(std::size_t max_bytes) { impl_->max_bytes = max_bytes; }

VolumeKey VolumeGrid::key_of(const Vec3& p_world) const {
  const Vec3 at = p_world / volume_size_m();
  return {floor_to_int(at.x()), floor_to_int(at.y()), floor_to_int(at.z())};
}

TsdfVoxel VolumeGrid::voxel(int x, int y, int z) const {
  const Volume* volume = find(VolumeKey{x >> 3, y >> 3, z >> 3});
  return volume ? volume->voxels[voxel_offset(x & 7, y & 7, z & 7)] : TsdfVoxel{};
}

std::optional<double> VolumeGrid::distance_at_voxel(const Vec3& p_world) const {
  const Vec3 at = p_world / voxel_size_m_;
  const TsdfVoxel found = voxel(floor_to_int(at.x()), floor_to_int(at.y()), floor_to_int(at.z()));
  if (found.weight() == 0) return std::nullopt;
  return found.sdf() * sdf_unit_m_;
}

std::optional<VolumeGrid::Sample> VolumeGrid::sample(const Vec3& p_world) const {
  const Vec3 at = p_world / voxel_size_m_ - Vec3::Constant(0.5);
  const Eigen::Vector3i low = at.array().floor().cast<int>();
  const Vec3 f = at - low.cast<double>();
  std::array<double, 8> d{};
  for (int corner = 0; corner < 8; ++corner) {
    const TsdfVoxel found =
        voxel(low.x() + (corner & 1), low.y() + (corner >> 1 & 1), low.z() + (corner >> 2));
    if (found.weight() == 0) return std::nullopt;
    d[static_cast<std::size_t>(corner)] = found.sdf() * sdf_unit_m_;
  }
  return blend(d, f, voxel_size_m_);
}

VolumeGrid::Sample VolumeGrid::blend(const std::array<double, 8>& d, const Vec3& f, double voxel_size_m) {
  const auto lerp = [](double a, double b, double t) { return a + (b - a) * t; };
  // Along x for the four (y, z) edges, then y, then z; differences on the way give the gradient.
  const double x00 = lerp(d[0], d[1], f.x()), x10 = lerp(d[2], d[3], f.x());
  const double x01 = lerp(d[4], d[5], f.x()), x11 = lerp(d[6], d[7], f.x());
  const double y0 = lerp(x00, x10, f.y()), y1 = lerp(x01, x11, f.y());
  const double dx0 = lerp(d[1] - d[0], d[3] - d[2], f.y()), dx1 = lerp(d[5] - d[4], d[7] - d[6], f.y());
  Sample sample;
  sample.distance_m = lerp(y0, y1, f.z());
  sample.gradient = Vec3(lerp(dx0, dx1, f.z()), lerp(x10 - x00, x11 - x01, f.z()), y1 - y0) / voxel_size_m;
  return sample;
}

}  // namespace hm
