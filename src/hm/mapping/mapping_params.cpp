#include "hm/mapping/mapping_params.hpp"

#include <fmt/format.h>

#include <array>
#include <span>

#include "hm/core/text/known_words.hpp"

namespace hm {
namespace {

/// Words of a parameter; the error names an unknown one.
Result<std::vector<std::string>> words_of(const std::string& text, std::string_view parameter,
                                          std::span<const std::string_view> known) {
  KnownWords found = known_words(text, known);
  if (found.unknown.empty()) return std::move(found.words);
  return fail(ErrorCode::kUsage, "parameters", "{} names '{}'; known are {}", parameter, found.unknown,
              fmt::join(known, ", "));
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
