#include "hm/pipeline/common/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace hm {
namespace {

/// Parameters that change how a map is computed but not what is in it.
constexpr std::array<std::string_view, 2> kFreeOfMap{"tsdf.max_map_mb", "tsdf.kernel"};

std::string number_text(double value) {
  return std::abs(value) >= 1e6 ? fmt::format("{:.0e}", value) : fmt::format("{}", value);
}

/// The allowed values in words: "0.002 to 0.5", "projection, traversal", "true or false".
std::string allowed_text(const ParamRef& param) {
  if (const auto* choice = std::get_if<ChoiceRef>(&param.value))
    return fmt::format("{}", fmt::join(choice->names, ", "));
  if (std::holds_alternative<bool*>(param.value)) return "true or false";
  if (std::holds_alternative<std::string*>(param.value)) return "a text";
  const auto [low, high] = param.range;
  if (std::isfinite(low) && std::isfinite(high))
    return fmt::format("{} to {}", number_text(low), number_text(high));
  if (std::isfinite(low)) return fmt::format("at least {}", number_text(low));
  if (std::isfinite(high)) return fmt::format("at most {}", number_text(high));
  return "any number";
}

void add_laser(ParamList& list, LaserParameters& laser) {
  list.add("laser", laser.run);
  list.add("scan_projection", laser.projection);
  list.add("matcher", laser.matcher);
  list.add("motion_search", laser.motion_search);
  list.add("loops", laser.loops);
  list.add("loop_matcher", laser.loops.matcher);
  list.add("loop_solver", laser.loops.solver);
  list.add("localiser", laser.localiser);
  list.add("wheel_noise", laser.wheel_noise);
  list.add("height", laser.height);
  list.add("state", laser.state);
  list.add("fusion", laser.state.fusion);
  list.add("tilt", laser.state.tilt);
  list.add("thesis", laser.state.thesis);
  list.add("pose_alpha_beta", laser.state.pose_alpha_beta);
  list.add("height_alpha_beta", laser.state.height_alpha_beta);
  list.add("mvog", laser.mvog);
}

void add_calibration(ParamList& list, Parameters& parameters) {
  list.add("board", parameters.board);
  list.add("camera_fit", parameters.camera_fit);
  list.add("stereo_fit", parameters.stereo_fit);
  list.add("depth_fit", parameters.depth_fit);
  list.add("noise_fit", parameters.noise_fit);
  list.add("calibration_simulation", parameters.calibration_simulation);
}

void add_slam(ParamList& list, Parameters& parameters) {
  list.add("odometry", parameters.odometry);
  list.add("odometry_features", parameters.odometry.features);
  list.add("odometry_tracker", parameters.odometry.tracker);
  list.add("odometry_published", parameters.odometry.published);
  list.add("slam", parameters.slam);
  list.add("places", parameters.loops.search);
  list.add("place_verifier", parameters.loops.verifier);
  list.add("keyframe_loops", parameters.loops);
  list.add("keyframe_solver", parameters.loops.solver);
}

}  // namespace

ParamList list_reconstruction(Parameters& parameters) {
  ParamList list;
  list.add("tsdf", parameters.tsdf);
  list.add("depth_noise", parameters.depth_noise);
  list.add("alignment", parameters.alignment);
  list.add("mesh", parameters.mesh);
  list.add("reconstruction", parameters.reconstruction);
  return list;
}

ParamList list_odometry(Parameters& parameters) {
  ParamList list;
  list.add("odometry", parameters.odometry);
  list.add("odometry_features", parameters.odometry.features);
  list.add("odometry_tracker", parameters.odometry.tracker);
  list.add("odometry_published", parameters.odometry.published);
  list.add("reconstruction", parameters.reconstruction);
  list.add("trajectory_error", parameters.trajectory_error);
  return list;
}

ParamList list_slam(Parameters& parameters) {
  ParamList list = list_reconstruction(parameters);
  add_slam(list, parameters);
  list.add("mvog", parameters.laser.mvog);
  list.add("mesh_error", parameters.mesh_error);
  list.add("trajectory_error", parameters.trajectory_error);
  return list;
}

ParamList list_laser(Parameters& parameters) {
  ParamList list;
  add_laser(list, parameters.laser);
  list.add("trajectory_error", parameters.trajectory_error);
  list.add("relation_error", parameters.relation_error);
  return list;
}

ParamList list_all(Parameters& parameters) {
  ParamList list = list_reconstruction(parameters);
  add_slam(list, parameters);
  add_laser(list, parameters.laser);
  list.add("simulation", parameters.simulation);
  list.add("laser_simulation", parameters.laser_simulation);
  add_calibration(list, parameters);
  list.add("mesh_error", parameters.mesh_error);
  list.add("trajectory_error", parameters.trajectory_error);
  list.add("relation_error", parameters.relation_error);
  return list;
}

std::vector<std::string> map_parameters(const Parameters& parameters) {
  Parameters copy = parameters;
  const ParamList list = list_reconstruction(copy);
  std::vector<std::string> lines;
  for (const ParamRef& param : list.all()) {
    const bool of_map = param.name.starts_with("tsdf.") || param.name.starts_with("depth_noise.") ||
                        param.name.starts_with("alignment.") || param.name == "reconstruction.align";
    if (of_map && std::find(kFreeOfMap.begin(), kFreeOfMap.end(), param.name) == kFreeOfMap.end())
      lines.push_back(fmt::format("{} = {}", param.name, value_text(param)));
  }
  return lines;
}

KeyframeMapParams keyframe_map_params(const Parameters& parameters) {
  return {parameters.slam, parameters.laser.mvog, parameters.depth_noise,
          parameters.odometry.max_depth_sigma_m};
}

Result<void> apply_settings(ParamList list, const std::vector<std::string>& settings) {
  for (const std::string& setting : settings)
    if (auto set = list.set(setting); !set) {
      set.error().where = setting;
      return set;
    }
  return list.check();
}

Result<void> check_parameters(const Parameters& parameters) {
  if (const auto tsdf = check_params(parameters.tsdf); !tsdf)
    return fail(ErrorCode::kUsage, "parameters", "{}", to_string(tsdf.error()));
  if (const auto formats = mesh_formats(parameters.reconstruction); !formats) return forward_error(formats);
  if (const auto maps = map_kinds(parameters.slam); !maps) return forward_error(maps);
  if (const auto mvog = check_params(parameters.laser.mvog); !mvog)
    return fail(ErrorCode::kUsage, "parameters", "{}", to_string(mvog.error()));
  if (parameters.laser.run.slice_top_m < parameters.laser.run.slice_bottom_m)
    return fail(ErrorCode::kUsage, "parameters", "laser.slice_top_m lies below laser.slice_bottom_m");
  return {};
}

std::string to_markdown(const ParamList& list) {
  std::string out, section;
  for (const ParamRef& param : list.all()) {
    const std::size_t dot = param.name.find('.');
    if (const std::string own = param.name.substr(0, dot); own != section) {
      out +=
          fmt::format("\n## {}\n| parameter | default | allowed | what it does |\n|---|---|---|---|\n", own);
      section = own;
    }
    out += fmt::format("| `{}` | `{}` | {} | {} |\n", param.name, value_text(param), allowed_text(param),
                       param.help);
  }
  return out;
}

std::string explain(const ParamRef& param) {
  return fmt::format("{} = {}\n  {}\n  allowed: {}\n", param.name, value_text(param), param.help,
                     allowed_text(param));
}

}  // namespace hm
