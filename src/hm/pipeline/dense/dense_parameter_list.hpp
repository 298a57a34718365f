#pragma once
#include <string>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/mapping/mapping_params.hpp"

namespace hm {

/// Everything that decides what a reconstruction does, and how it is compared with the truth.
struct DenseParameters : DenseParams {
  MeshErrorParams mesh_error;
  TrajectoryErrorParams trajectory_error;
};

/// The sections that decide what a reconstruction looks like and how it is run: tsdf, depth_noise, alignment,
/// mesh, reconstruction.
ParamList list_reconstruction(DenseParams& parameters);
/// These, mesh_error and trajectory_error.
ParamList list_dense(DenseParameters& parameters);
/// Those that a map was made with and cannot change later: tsdf (but for the memory cap and the kernel),
/// depth_noise, whether poses are levelled or aligned, and how. As "name = value" lines.
std::vector<std::string> map_parameters(const DenseParams& parameters);

/// Reports all contradictions between parameters in one error; ranges are checked by ParamList::check().
Result<void> check_parameters(const DenseParams& parameters);

}  // namespace hm
