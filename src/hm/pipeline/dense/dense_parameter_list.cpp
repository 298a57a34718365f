#include "hm/pipeline/dense/dense_parameter_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace hm {
namespace {

/// Parameters that change how a map is computed but not what is in it.
constexpr std::array<std::string_view, 2> kFreeOfMap{"tsdf.max_map_mb", "tsdf.kernel"};

}  // namespace

ParamList list_reconstruction(DenseParams& parameters) {
  ParamList list;
  list.add("tsdf", parameters.tsdf);
  list.add("depth_noise", parameters.depth_noise);
  list.add("alignment", parameters.alignment);
  list.add("mesh", parameters.mesh);
  list.add("reconstruction", parameters.reconstruction);
  list.add_renamed("mesh.min_piece_triangles", "mesh.min_piece_size_m");
  return list;
}

ParamList list_dense(DenseParameters& parameters) {
  ParamList list = list_reconstruction(parameters);
  list.add("mesh_error", parameters.mesh_error);
  list.add("trajectory_error", parameters.trajectory_error);
  return list;
}

std::vector<std::string> map_parameters(const DenseParams& parameters) {
  DenseParams copy = parameters;
  const ParamList list = list_reconstruction(copy);
  std::vector<std::string> lines;
  for (const ParamRef& param : list.all()) {
    const bool of_map = param.name.starts_with("tsdf.") || param.name.starts_with("depth_noise.") ||
                        param.name.starts_with("alignment.") || param.name == "reconstruction.align" ||
                        param.name == "reconstruction.level";
    if (of_map && std::find(kFreeOfMap.begin(), kFreeOfMap.end(), param.name) == kFreeOfMap.end())
      lines.push_back(fmt::format("{} = {}", param.name, value_text(param)));
  }
  return lines;
}

Result<void> check_parameters(const DenseParams& parameters) {
  if (const auto tsdf = check_params(parameters.tsdf); !tsdf)
    return fail(ErrorCode::kUsage, "parameters", "{}", to_string(tsdf.error()));
  if (const auto formats = mesh_formats(parameters.reconstruction); !formats) return forward_error(formats);
  return {};
}

}  // namespace hm
