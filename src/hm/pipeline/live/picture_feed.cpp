#include "hm/pipeline/live/picture_feed.hpp"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "hm/io/image/image_file.hpp"
#include "hm/report/render/color_map.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

constexpr int kMaxWidth = 320;
constexpr int kJpegQuality = 70;

/// Every n-th pixel, at most kMaxWidth of them in a row.
template <class Pixel>
Image<Pixel> thinned(const Image<Pixel>& image) {
  const int step = std::max(1, (image.width() + kMaxWidth - 1) / kMaxWidth);
  Image<Pixel> out(image.width() / step, image.height() / step);
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x) out(x, y) = image(x * step, y * step);
  return out;
}

void put(LiveStore& store, PictureFrame::Which which, const Image<Rgb8>& image, Time stamp) {
  if (image.empty()) return;
  const auto file = encode_jpeg(image, kJpegQuality);
  PictureFrame frame;
  frame.which = which;
  frame.format = PictureFrame::Format::kJpeg;
  frame.width = static_cast<std::uint16_t>(image.width());
  frame.height = static_cast<std::uint16_t>(image.height());
  frame.file.resize(file.size());
  std::memcpy(frame.file.data(), file.data(), file.size());
  store.put(LiveKind::kPicture, static_cast<std::uint64_t>(which), stamp, to_payload(frame));
}

}  // namespace

Image<Rgb8> false_colors(const Image<std::uint16_t>& depth) {
  Image<Rgb8> out(depth.width(), depth.height());
  std::vector<std::uint16_t> readings;
  for (const std::uint16_t units : depth.pixels())
    if (units > 0) readings.push_back(units);
  if (readings.empty()) return out;
  std::sort(readings.begin(), readings.end());
  const double near = readings[readings.size() / 50],
               far = readings[readings.size() - 1 - readings.size() / 50];
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x)
      if (const std::uint16_t units = depth(x, y); units > 0)
        out(x, y) = to_rgb8(sequential_color((far - units) / std::max(1.0, far - near)));
  return out;
}

void PictureFeed::give(const RgbdFrame& frame) {
  jobs_.give(0,
             [this, color = thinned(frame.color), depth = thinned(frame.depth.units), stamp = frame.stamp] {
               put(store_, PictureFrame::Which::kColor, color, stamp);
               put(store_, PictureFrame::Which::kDepth, false_colors(depth), stamp);
             });
}

}  // namespace hm
