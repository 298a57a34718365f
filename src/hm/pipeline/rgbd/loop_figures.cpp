#include "hm/pipeline/rgbd/loop_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/report/render/canvas.hpp"
#include "hm/slam/place_recognition/place_verifier.hpp"

namespace hm {
namespace {

constexpr int kImageWidth_px = 360, kGap_px = 6;
constexpr std::size_t kMostLines = 60;

/// Mean over the pixels of the source that fall into one of the result.
Image<Rgb8> shrunk(const Image<Rgb8>& image, int width) {
  const double scale = static_cast<double>(image.width()) / width;
  const int height = std::max(1, static_cast<int>(std::lround(image.height() / scale)));
  Image<Rgb8> out(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Vec3 sum = Vec3::Zero();
      double count = 0;
      const int bottom = std::max(static_cast<int>((y + 1) * scale), static_cast<int>(y * scale) + 1),
                right = std::max(static_cast<int>((x + 1) * scale), static_cast<int>(x * scale) + 1);
      for (int v = static_cast<int>(y * scale); v < std::min(bottom, image.height()); ++v)
        for (int u = static_cast<int>(x * scale); u < std::min(right, image.width()); ++u, ++count)
          sum += Vec3(image(u, v).r, image(u, v).g, image(u, v).b);
      const auto channel = [&](int k) {
        return static_cast<std::uint8_t>(std::lround(sum[k] / std::max(count, 1.0)));
      };
      out(x, y) = {channel(0), channel(1), channel(2)};
    }
  return out;
}

/// Loops of the graph by the keyframes between their ends, most first; each pair of nodes once.
std::vector<std::pair<std::size_t, std::size_t>> longest_loops(const PoseGraph3D& graph,
                                                               std::size_t keyframes) {
  std::vector<std::pair<std::size_t, std::size_t>> loops;
  for (const PoseEdge3D& edge : graph.edges)
    if (edge.kind == PoseEdgeKind::kLoop && edge.from != edge.to && std::max(edge.from, edge.to) < keyframes)
      loops.emplace_back(std::min(edge.from, edge.to), std::max(edge.from, edge.to));
  std::sort(loops.begin(), loops.end(), [](const auto& a, const auto& b) {
    const std::size_t span_a = a.second - a.first, span_b = b.second - b.first;
    return span_a != span_b ? span_a > span_b : a < b;
  });
  loops.erase(std::unique(loops.begin(), loops.end()), loops.end());
  return loops;
}

Image<Rgb8> draw_pair(const Image<Rgb8>& first, const Image<Rgb8>& second, const Keyframe& a,
                      const Keyframe& b, const PlaceMatch& match) {
  const Image<Rgb8> left = shrunk(first, kImageWidth_px), right = shrunk(second, kImageWidth_px);
  Image<Rgb8> image(2 * kImageWidth_px + kGap_px, std::max(left.height(), right.height()), {255, 255, 255});
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < kImageWidth_px; ++x) {
      if (left.contains(x, y)) image(x, y) = left(x, y);
      if (right.contains(x, y)) image(kImageWidth_px + kGap_px + x, y) = right(x, y);
    }
  const double scale_a = static_cast<double>(kImageWidth_px) / first.width(),
               scale_b = static_cast<double>(kImageWidth_px) / second.width();
  const std::size_t step = match.pairs.size() / kMostLines + 1;
  for (std::size_t i = 0; i < match.pairs.size(); i += step) {
    const Vec2 from = scale_a * a.features[match.pairs[i].first].pixel,
               to = scale_b * b.features[match.pairs[i].second].pixel + Vec2(kImageWidth_px + kGap_px, 0);
    draw_line(image, from, to, 1, {{90, 235, 150}, 0.55});
    fill_circle(image, from, 2.2, {{90, 235, 150}, 1});
    fill_circle(image, to, 2.2, {{90, 235, 150}, 1});
  }
  return image;
}

}  // namespace

std::vector<LoopFigure> draw_loops(const FrameSource& frames, const PoseGraph3D& graph,
                                   KeyframeList keyframes, const PlaceVerifierParams& params,
                                   std::size_t most) {
  std::vector<LoopFigure> figures;
  for (const auto& [older, newer] : longest_loops(graph, keyframes.size())) {
    if (figures.size() >= most) break;
    const Keyframe &a = *keyframes[older], &b = *keyframes[newer];
    const auto first = frames.read(a.frame_index), second = frames.read(b.frame_index);
    if (!first || !second || first->color.empty() || second->color.empty()) continue;
    const PlaceMatch match = verify_place(a, b, params);
    std::string words = fmt::format("frames {} and {}, {:.1f} s apart", a.frame_index, b.frame_index,
                                    (b.stamp - a.stamp).seconds());
    if (match.is_same_place())
      words += fmt::format(": {} matches, {:.2f} m and {:.0f} deg between the cameras", match.inliers,
                           match.T_a_b.translation().norm(),
                           so3_log(match.T_a_b.rotation()).norm() * kDegreesPerRadian);
    figures.push_back({std::move(words), draw_pair(first->color, second->color, a, b, match)});
  }
  return figures;
}

void add_loop_figures(HtmlReport& report, std::span<const LoopFigure> figures) {
  if (figures.empty()) return;
  report.add_paragraph(
      fmt::format("The {} loops with most keyframes between their ends, with the features on which "
                  "both images agree:",
                  figures.size()));
  for (const LoopFigure& figure : figures)
    report.add_collapsible_figure(figure.summary, encode_jpeg(figure.image, 82),
                                  {figure.summary, {}, HtmlReport::Place::kWide, {}, 0, 0});
}

}  // namespace hm
