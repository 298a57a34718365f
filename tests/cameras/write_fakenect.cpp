// Writes a recording as the files that fakenect plays, libfreenect's stand-in without hardware: raw 11-bit
// disparity and colour, at 30 Hz. Usage: write_fakenect RECORDING FOLDER FRAMES
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "hm/depth_camera/disparity.hpp"
#include "hm/io/rgbd/recording.hpp"

namespace {

/// "d-0.033333-2000000.pgm": type, time in seconds, counter at 60 MHz.
std::string file_name(char type, std::size_t frame, const char* ending) {
  const double time_s = static_cast<double>(frame) / 30;
  return fmt::format("{}-{:.6f}-{}.{}", type, time_s, std::lround(time_s * 60e6), ending);
}

hm::Image<std::uint16_t> disparity_of(const hm::DepthImage& depth) {
  const hm::DisparityModel model;
  hm::Image<std::uint16_t> raw(depth.width(), depth.height(), hm::DisparityTable::kNone);
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      if (const double z = depth.depth_m(x, y); z > 0)
        raw(x, y) = static_cast<std::uint16_t>(std::lround(model.disparity(z)));
  return raw;
}

template <class Pixel>
void write(const std::string& path, const char* kind, int most, const hm::Image<Pixel>& image) {
  std::ofstream file(path, std::ios::binary);
  file << fmt::format("{} {} {} {}\n", kind, image.width(), image.height(), most);
  const auto pixels = image.pixels();
  file.write(reinterpret_cast<const char*>(pixels.data()), static_cast<std::streamsize>(pixels.size_bytes()));
}

}  // namespace

int main(int count, char** words) {
  if (count != 4) return 2;
  const auto recording = hm::open_recording(words[1]);
  if (!recording) return 3;
  const std::string folder = std::string(words[2]) + "/";
  std::ofstream index(folder + "INDEX.txt");
  for (std::size_t i = 0; i < std::strtoul(words[3], nullptr, 10); ++i) {
    const auto frame = (*recording)->read(i);
    if (!frame) return 3;
    const std::string depth = file_name('d', i, "pgm"), color = file_name('r', i, "ppm");
    write(folder + depth, "P5", 65535, disparity_of(frame->depth));
    write(folder + color, "P6", 255, frame->color);
    index << depth << '\n' << color << '\n';
  }
  return index.good() ? 0 : 1;
}
