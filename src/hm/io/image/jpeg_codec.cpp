#include <turbojpeg.h>

#include <memory>
#include <string_view>

#include "hm/core/check.hpp"
#include "hm/io/image/image_codec.hpp"

namespace hm {
namespace {

struct DestroyHandle {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Handle = std::unique_ptr<void, DestroyHandle>;

tl::unexpected<Error> jpeg_error(tjhandle handle, std::size_t file_bytes, const std::string& where) {
  const std::string_view reason = tjGetErrorStr2(handle);
  if (reason.find("remature end") != std::string_view::npos)
    return fail(ErrorCode::kTruncated, where, "the JPEG ends too early, at byte {}", file_bytes);
  return fail(ErrorCode::kCorrupted, where, "not a valid JPEG: {} ({} bytes)", reason, file_bytes);
}

/// True for the common warning about extra bytes between two markers, which is harmless; every other warning
/// means wrong pixels.
bool is_harmless(tjhandle handle) {
  return tjGetErrorCode(handle) == TJERR_WARNING &&
         std::string_view(tjGetErrorStr2(handle)).find("extraneous bytes") != std::string_view::npos;
}

Result<ImageSize> size_of(tjhandle handle, std::span<const std::uint8_t> bytes, const std::string& where) {
  ImageSize size;
  int subsampling = 0, color_space = 0;
  if (tjDecompressHeader3(handle, bytes.data(), bytes.size(), &size.width, &size.height, &subsampling,
                          &color_space) != 0)
    return jpeg_error(handle, bytes.size(), where);
  if (color_space == TJCS_CMYK || color_space == TJCS_YCCK)
    return fail(ErrorCode::kUnsupported, where, "a JPEG for print (CMYK) is not read");
  if (auto fits = detail::check_image_size(size.width, size.height, where); !fits) return forward_error(fits);
  return size;
}

}  // namespace

Result<ImageSize> detail::jpeg_size(std::span<const std::uint8_t> bytes, const std::string& where) {
  const Handle handle(tjInitDecompress());
  if (!handle) return fail(ErrorCode::kInternal, where, "turbojpeg cannot start");
  return size_of(handle.get(), bytes, where);
}

Result<Image<Rgb8>> detail::decode_jpeg(std::span<const std::uint8_t> bytes, const std::string& where) {
  const Handle handle(tjInitDecompress());
  if (!handle) return fail(ErrorCode::kInternal, where, "turbojpeg cannot start");
  const auto size = size_of(handle.get(), bytes, where);
  if (!size) return forward_error(size);
  Image<Rgb8> image(size->width, size->height);
  static_assert(sizeof(Rgb8) == 3);
  if (tjDecompress2(handle.get(), bytes.data(), bytes.size(), reinterpret_cast<unsigned char*>(image.data()),
                    size->width, 0, size->height, TJPF_RGB, TJFLAG_LIMITSCANS) != 0 &&
      !is_harmless(handle.get()))
    return jpeg_error(handle.get(), bytes.size(), where);
  return image;
}

std::vector<std::uint8_t> encode_jpeg(const Image<Rgb8>& image, int quality) {
  HM_CHECK(!image.empty() && image.width() <= 65500 && image.height() <= 65500, "{} x {}", image.width(),
           image.height());
  HM_CHECK(quality >= 1 && quality <= 100, "quality = {}", quality);
  const Handle handle(tjInitCompress());
  HM_CHECK(handle, "turbojpeg cannot start");
  std::vector<std::uint8_t> bytes(tjBufSize(image.width(), image.height(), TJSAMP_420));
  unsigned char* out = bytes.data();
  unsigned long size = bytes.size();
  const int status =
      tjCompress2(handle.get(), reinterpret_cast<const unsigned char*>(image.data()), image.width(), 0,
                  image.height(), TJPF_RGB, &out, &size, TJSAMP_420, quality, TJFLAG_NOREALLOC);
  HM_CHECK(status == 0, "turbojpeg: {}", tjGetErrorStr2(handle.get()));
  bytes.resize(size);
  return bytes;
}

}  // namespace hm
