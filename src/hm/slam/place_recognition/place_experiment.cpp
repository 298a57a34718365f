#include "hm/slam/place_recognition/place_experiment.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "hm/slam/place_recognition/place_search.hpp"

namespace hm {
namespace {

PlaceMatrices empty_matrices(std::size_t count) {
  const int n = static_cast<int>(count);
  PlaceMatrices matrices;
  matrices.candidate = Image<std::uint8_t>(n, n);
  matrices.correspondence = Image<std::int32_t>(n, n);
  matrices.association = Image<std::uint8_t>(n, n);
  return matrices;
}

double processor_seconds(std::clock_t begin) {
  return static_cast<double>(std::clock() - begin) / static_cast<double>(CLOCKS_PER_SEC);
}

bool is_adjacent(const Keyframe& a, const Keyframe& b, std::size_t apart, const PlaceSearchParams& search) {
  return a.submap == b.submap && apart < static_cast<std::size_t>(search.min_keyframes_apart);
}

template <class T>
double largest(const Image<T>& image) {
  return image.empty() ? 0
                       : static_cast<double>(*std::max_element(image.pixels().begin(), image.pixels().end()));
}

template <class T>
Image<Rgb8> picture_of(const Image<T>& matrix, int pixels) {
  Image<Rgb8> picture(matrix.width() * pixels, matrix.height() * pixels);
  const double most = std::max(1.0, largest(matrix));
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      const double share = static_cast<double>(matrix(x / pixels, y / pixels)) / most;
      const auto grey = static_cast<std::uint8_t>(255 * std::sqrt(std::max(0.0, share)));
      picture(x, y) = {grey, grey, grey};
    }
  return picture;
}

}  // namespace

PlaceMatrices brute_force_places(KeyframeList keyframes, const PlaceSearchParams& search,
                                 const PlaceVerifierParams& verifier) {
  const std::clock_t begin = std::clock();
  PlaceMatrices matrices = empty_matrices(keyframes.size());
  for (std::size_t y = 0; y < keyframes.size(); ++y)
    for (std::size_t x = 0; x < keyframes.size(); ++x) {
      if (x == y || is_adjacent(*keyframes[x], *keyframes[y], x > y ? x - y : y - x, search)) continue;
      const PlaceMatch match = verify_place(*keyframes[y], *keyframes[x], verifier);
      ++matrices.comparisons;
      const int column = static_cast<int>(x), row = static_cast<int>(y);
      matrices.candidate(column, row) = 1;
      matrices.correspondence(column, row) = match.inliers;
      matrices.association(column, row) = match.is_same_place() ? 1 : 0;
      if (match.is_same_place() && y < x)
        matrices.associations.push_back(
            {static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(x), match.T_a_b, match.inliers});
    }
  matrices.seconds = processor_seconds(begin);
  return matrices;
}

PlaceMatrices heuristic_places(KeyframeList keyframes, const PlaceSearchParams& search,
                               const PlaceVerifierParams& verifier) {
  const std::clock_t begin = std::clock();
  PlaceMatrices matrices = empty_matrices(keyframes.size());
  matrices.match = Image<std::int32_t>(matrices.candidate.width(), matrices.candidate.height());
  PlaceSearch places(search);
  for (const auto& keyframe : keyframes) places.add(*keyframe);
  for (std::uint32_t row = 0; row < keyframes.size(); ++row) {
    const std::vector<PlaceCandidate> candidates = places.candidates(*keyframes[row], row);
    for (std::size_t rank = 0; rank < candidates.size(); ++rank) {
      const std::uint32_t column = candidates[rank].keyframe;
      const int x = static_cast<int>(column), y = static_cast<int>(row);
      matrices.match(x, y) = candidates[rank].votes;
      matrices.candidate(x, y) = matrices.candidate(y, x) = 1;
      if (matrices.association(x, y) != 0) continue;
      const PlaceMatch match =
          verify_candidate(*keyframes[column], *keyframes[row], candidates[rank], rank, verifier);
      ++matrices.comparisons;
      matrices.correspondence(x, y) = matrices.correspondence(y, x) = match.inliers;
      if (!match.is_same_place()) continue;
      matrices.association(x, y) = matrices.association(y, x) = 1;
      const bool forward = column < row;
      matrices.associations.push_back({std::min(row, column), std::max(row, column),
                                       forward ? match.T_a_b : match.T_a_b.inverse(), match.inliers});
    }
  }
  matrices.seconds = processor_seconds(begin);
  return matrices;
}

PlaceSweepRow compare_places(const PlaceMatrices& brute_force, const PlaceMatrices& heuristic,
                             const PlaceSearchParams& search) {
  PlaceSweepRow row{search.candidates, search.neighbours, 0, 0, 0, heuristic.seconds};
  for (int y = 0; y < brute_force.association.height(); ++y)
    for (int x = 0; x < brute_force.association.width(); ++x) {
      if (brute_force.association(x, y) == 0) continue;
      ++row.total;
      if (heuristic.candidate(x, y) == 0) ++row.missed_candidates;
      if (heuristic.association(x, y) == 0) ++row.missed_associations;
    }
  return row;
}

PlacePictures draw_places(const PlaceMatrices& matrices, int pixels) {
  return {picture_of(matrices.match, pixels), picture_of(matrices.candidate, pixels),
          picture_of(matrices.correspondence, pixels), picture_of(matrices.association, pixels)};
}

}  // namespace hm
