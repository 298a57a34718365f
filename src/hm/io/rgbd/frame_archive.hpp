#pragma once
#include <cstddef>
#include <memory>

#include "hm/io/rgbd/frame_source.hpp"

namespace hm {

/// Frames kept in memory, compressed without loss: the FrameSource of a live camera, whose frames nothing
/// else can give again.
///
/// A frame of 640 x 480 takes 0.4 to 0.6 MB (a third of its pictures' size; measured on public recordings),
/// about 15 ms to keep and 7 ms to read. One thread may keep frames while others read them.
class FrameArchive final : public FrameSource {
 public:
  /// `camera`: of the frames, without lens distortion. `max_bytes` caps bytes(); 0: no cap.
  explicit FrameArchive(const PinholeCamera& camera, std::size_t max_bytes = 0);
  ~FrameArchive() override;

  /// Keeps a frame under its index, in the place of one that was kept under it before. kOutOfMemory when the
  /// cap does not suffice: the frame is not kept then, others still may.
  Result<void> keep(const RgbdFrame& frame);

  [[nodiscard]] PinholeCamera camera() const override;
  /// The frame as it was kept, to the bit. kNotFound: there is none with this index.
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override;

  [[nodiscard]] std::size_t frame_count() const;
  /// Memory held by the compressed frames.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
