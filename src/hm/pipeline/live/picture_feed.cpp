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

/// Every n-th pixel, at most kMaxWidth of them in a row; `out` keeps its memory where it has the size.
template <class Pixel>
void thin(const Image<Pixel>& image, Image<Pixel>& out) {
  const int step = std::max(1, (image.width() + kMaxWidth - 1) / kMaxWidth);
  const int width = image.width() / step, height = image.height() / step;
  if (out.width() != width || out.height() != height) out = Image<Pixel>(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) out(x, y) = image(x * step, y * step);
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
  if (free_.empty()) return std::make_shared<Pictures>();
  const Place place = std::move(free_.back());
  free_.pop_back();
  return place;
}

void PictureFeed::put(const Place& pictures) {
  put_picture(store_, PictureFrame::Which::kColor, pictures->color, pictures->stamp);
  put_picture(store_, PictureFrame::Which::kDepth, false_colors(pictures->depth), pictures->stamp);
  const std::lock_guard lock(mutex_);
  free_.push_back(pictures);
}

void PictureFeed::give(const RgbdFrame& frame) {
  const Place pictures = free_place();
  thin(frame.color, pictures->color);
  thin(frame.depth.units, pictures->depth);
  pictures->stamp = frame.stamp;
  jobs_.give(0, [this, pictures] { put(pictures); });
}

}  // namespace hm
