#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/io/mesh/mesh_formats.hpp"

namespace hm {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

std::string_view next_word(std::string_view& line) {
  const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
  line.remove_prefix(begin);
  const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(end);
  return word;
}

class ObjReader {
 public:
  explicit ObjReader(InputFile& file) : file_(file) {}

  Result<TriangleMesh> read() {
    std::string_view line;
    while (file_.read_line(line)) {
      if (!line.empty() && line.back() == '\\')
        return fail(ErrorCode::kUnsupported, file_.at_line(), "a line continued with '\\'");
      if (line.find('\0') != std::string_view::npos)
        return fail(ErrorCode::kCorrupted, file_.at_line(), "not a text file");
      line = line.substr(0, line.find('#'));
      const std::string_view keyword = next_word(line);
      Result<void> done;
      if (keyword == "v") done = read_vertex(line);
      if (keyword == "vn") done = read_normal(line);
      if (keyword == "f") done = read_face(line);
      if (!done) return forward_error(done);
    }
    return finish();
  }

 private:
  struct Corner {
    std::uint32_t vertex = 0;
    std::uint32_t normal = kNone;
  };
  /// The largest index met so far, and its line: it may name something that comes later in the file.
  struct Farthest {
    std::uint32_t index = 0;
    std::uint64_t line = 0;
  };

  template <std::size_t N>
  Result<std::size_t> read_numbers(std::string_view line, std::array<float, N>& out) {
    std::size_t count = 0;
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      if (word.front() == '+') word.remove_prefix(1);
      if (count == N) return fail(ErrorCode::kCorrupted, file_.at_line(), "more than {} numbers", N);
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out[count]);
      // Numbers too small for a float are as good as zero.
      const bool tiny = error == std::errc::result_out_of_range && word.find("e-") != std::string_view::npos;
      if (tiny) out[count] = 0;
      if ((error != std::errc{} && !tiny) || end != word.data() + word.size() || !std::isfinite(out[count]))
        return fail(ErrorCode::kCorrupted, file_.at_line(), "'{}' is no finite number", word);
      ++count;
    }
    return count;
  }

  Result<void> read_vertex(std::string_view line) {
    std::array<float, 7> values{};
    const auto count = read_numbers(line, values);
    if (!count) return forward_error(count);
    if (*count != 3 && *count != 4 && *count != 6 && *count != 7)
      return fail(ErrorCode::kCorrupted, file_.at_line(), "a vertex of {} numbers", *count);
    mesh_.vertices.emplace_back(values[0], values[1], values[2]);
    if (*count < 6) return {};
    std::array<std::uint8_t, 3> rgb{};
    for (std::size_t c = 0; c < 3; ++c)
      rgb[c] = static_cast<std::uint8_t>(std::lround(std::clamp(values[3 + c], 0.f, 1.f) * 255.f));
    mesh_.colors.push_back({rgb[0], rgb[1], rgb[2]});
    return {};
  }

  Result<void> read_normal(std::string_view line) {
    std::array<float, 3> values{};
    const auto count = read_numbers(line, values);
    if (!count) return forward_error(count);
    if (*count != 3) return fail(ErrorCode::kCorrupted, file_.at_line(), "a normal of {} numbers", *count);
    normals_.emplace_back(values[0], values[1], values[2]);
    return {};
  }

  /// An index as written (from 1, or negative from the end of what was read so far) as an index from 0.
  std::optional<std::uint32_t> resolve(std::string_view text, std::size_t count, Farthest& farthest) const {
    std::int64_t index = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
    if (error != std::errc{} || end != text.data() + text.size() || index == 0) return std::nullopt;
    index = index > 0 ? index - 1 : index + static_cast<std::int64_t>(count);
    if (index < 0 || index >= std::int64_t{kNone}) return std::nullopt;
    const auto resolved = static_cast<std::uint32_t>(index);
    if (resolved >= farthest.index) farthest = {resolved, file_.line()};
    return resolved;
  }

  std::optional<Corner> read_corner(std::string_view word) {
    const std::size_t slash = word.find('/');
    const auto vertex = resolve(word.substr(0, slash), mesh_.vertices.size(), farthest_vertex_);
    if (!vertex) return std::nullopt;
    Corner corner{*vertex, kNone};
    const std::size_t second = slash == std::string_view::npos ? slash : word.find('/', slash + 1);
    if (second == std::string_view::npos || second + 1 == word.size()) return corner;
    const auto normal = resolve(word.substr(second + 1), normals_.size(), farthest_normal_);
    if (!normal) return std::nullopt;
    corner.normal = *normal;
    return corner;
  }

  Result<void> read_face(std::string_view line) {
    polygon_.clear();
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      const auto corner = read_corner(word);
      if (!corner) return fail(ErrorCode::kCorrupted, file_.at_line(), "'{}' is no corner of a face", word);
      polygon_.push_back(*corner);
    }
    if (polygon_.size() < 3)
      return fail(ErrorCode::kCorrupted, file_.at_line(), "a face of {} corners", polygon_.size());
    for (std::size_t i = 2; i < polygon_.size(); ++i)
      mesh_.triangles.push_back({polygon_[0].vertex, polygon_[i - 1].vertex, polygon_[i].vertex});
    for (const Corner& corner : polygon_)
      if (corner.normal != kNone) corners_.push_back(corner);
    return {};
  }

  Result<TriangleMesh> finish() {
    if (!mesh_.triangles.empty() && farthest_vertex_.index >= mesh_.vertices.size())
      return fail(ErrorCode::kCorrupted, file_.name() + ":" + std::to_string(farthest_vertex_.line),
                  "a face names vertex {} of {}", farthest_vertex_.index + 1, mesh_.vertices.size());
    if (!corners_.empty() && farthest_normal_.index >= normals_.size())
      return fail(ErrorCode::kCorrupted, file_.name() + ":" + std::to_string(farthest_normal_.line),
                  "a face names normal {} of {}", farthest_normal_.index + 1, normals_.size());
    if (mesh_.colors.size() != mesh_.vertices.size()) mesh_.colors.clear();
    assign_normals();
    return std::move(mesh_);
  }

  /// One normal a vertex: the corners' normal, or the mean where corners differ.
  void assign_normals() {
    if (corners_.empty()) return;
    std::vector<std::uint32_t> first(mesh_.vertices.size(), kNone);
    std::vector<bool> mixed(mesh_.vertices.size(), false);
    std::vector<Eigen::Vector3f> normals(mesh_.vertices.size(), Eigen::Vector3f::Zero());
    for (const Corner& corner : corners_) {
      const Eigen::Vector3f& normal = normals_[corner.normal];
      if (first[corner.vertex] == kNone) {
        first[corner.vertex] = corner.normal;
        normals[corner.vertex] = normal;
      } else if (first[corner.vertex] != corner.normal && normals_[first[corner.vertex]] != normal) {
        normals[corner.vertex] += normal;
        mixed[corner.vertex] = true;
      }
    }
    std::vector<bool> used(mesh_.vertices.size(), false);
    for (const auto& triangle : mesh_.triangles)
      for (const std::uint32_t index : triangle) used[index] = true;
    for (std::size_t i = 0; i < normals.size(); ++i) {
      if (used[i] && first[i] == kNone) return;  // normals for a part of the mesh only: none
      if (mixed[i]) normals[i].normalize();
    }
    mesh_.normals = std::move(normals);
  }

  InputFile& file_;
  TriangleMesh mesh_;
  std::vector<Eigen::Vector3f> normals_;
  std::vector<Corner> polygon_;
  std::vector<Corner> corners_;  ///< all corners with a normal
  Farthest farthest_vertex_, farthest_normal_;
};

}  // namespace

Result<TriangleMesh> read_obj(InputFile& file) { return ObjReader(file).read(); }

}  // namespace hm
