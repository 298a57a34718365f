#pragma once
#include <cstddef>
#include <memory>

#include "hm/io/rgbd/frame_source.hpp"

namespace hm {

/// Losslessly compressed frames in memory: the FrameSource of a live camera, whose frames are stored nowhere
/// else.
///
/// A frame of 640 x 480 takes 0.4 to 0.6 MB (a third of its raw size; measured on public recordings), about
/// 15 ms to store and 7 ms to read. One thread may store frames while others read them.
class FrameArchive final : public FrameSource {
 public:
  /// `camera`: camera of the frames, without lens distortion. `max_bytes` limits bytes(); 0: no limit.
  explicit FrameArchive(const PinholeCamera& camera, std::size_t max_bytes = 0);
  ~FrameArchive() override;

  /// Stores a frame under its index, replacing an earlier one with this index. kOutOfMemory when it exceeds
  /// the limit: this frame is then not stored, smaller ones still may be.
  Result<void> keep(const RgbdFrame& frame);

  [[nodiscard]] PinholeCamera camera() const override;
  /// Returns the stored frame, bit-identical. kNotFound: no frame with this index.
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override;
  [[nodiscard]] Result<RgbdFrame> read_depth(std::size_t index) const override;

  [[nodiscard]] std::size_t frame_count() const;
  /// Memory of the compressed frames in bytes.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
