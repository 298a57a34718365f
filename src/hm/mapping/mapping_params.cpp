#include "hm/mapping/mapping_params.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

namespace hm {
namespace {

/// Splits a comma-separated list; the error names an unknown word.
Result<std::vector<std::string>> words_of(const std::string& text, std::string_view parameter,
                                          std::span<const std::string_view> known) {
  std::vector<std::string> words;
  std::string word;
  for (const char c : text + ",") {
    if (c != ',' && c != ' ') {
      word += c;
    } else if (!word.empty()) {
      if (std::find(known.begin(), known.end(), word) == known.end())
        return fail(ErrorCode::kUsage, "parameters", "{} names '{}'; known are {}", parameter, word,
                    fmt::join(known, ", "));
      words.push_back(std::move(word));
      word.clear();
    }
  }
  return words;
}

}  // namespace

Result<std::vector<std::string>> mesh_formats(const ReconstructionParams& params) {
  constexpr std::array<std::string_view, 3> kFormats{"ply", "glb", "obj"};
  return words_of(params.mesh_formats, "reconstruction.mesh_formats", kFormats);
}

Result<std::vector<std::string>> map_kinds(const SlamParams& params) {
  constexpr std::array<std::string_view, 3> kKinds{"points", "octomap", "mvog"};
  return words_of(params.maps, "slam.maps", kKinds);
}

}  // namespace hm
