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

/// Every n-th pixel, at most kMaxWidth of them in a row; `out` keeps its memory where it has the size. The
/// thread of the run waits for it.
template <class Pixel>
void thin(const Image<Pixel>& image, Image<Pixel>& out) {
  const int step = std::max(1, (image.width() + kMaxWidth - 1) / kMaxWidth);
  const int width = image.width() / step, height = image.height() / step;
  if (out.width() != width || out.height() != height) out = Image<Pixel>(width, height);
  if (step == 1) {
    std::copy(image.pixels().begin(), image.pixels().end(), out.pixels().begin());
    return;
  }
  for (int y = 0; y < height; ++y) {
    const Pixel* from = image.row(y * step).data();
    for (Pixel& pixel : out.row(y)) {
      pixel = *from;
      from += step;
    }
  }
}

void put_picture(LiveStore& store, PictureFrame::Which which, const Image<Rgb8>& image, Time stamp) {
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

PictureFeed::Place PictureFeed::free_place() {
  const std::lock_guard lock(mutex_);
  if (free_.empty()) return std::make_shared<SmallPictures>();
  const Place place = std::move(free_.back());
  free_.pop_back();
  return place;
}

void PictureFeed::put(const Place& pictures) {
  put_picture(store_, PictureFrame::Which::kColor, pictures->color, pictures->stamp);
  put_picture(store_, PictureFrame::Which::kDepth, false_colors(pictures->depth.units), pictures->stamp);
  const std::lock_guard lock(mutex_);
  free_.push_back(pictures);
}

PictureFeed::Place PictureFeed::copy(const RgbdFrame& frame) {
  Place pictures = free_place();
  thin(frame.color, pictures->color);
  thin(frame.depth.units, pictures->depth.units);
  pictures->depth.unit_m = frame.depth.unit_m;
  pictures->stamp = frame.stamp;
  return pictures;
}

void PictureFeed::give(const Place& pictures) {
  jobs_.give(0, [this, pictures] { put(pictures); });
}

}  // namespace hm
