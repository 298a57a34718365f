#pragma once
#include <cstddef>

#include "hm/core/run_context.hpp"
#include "hm/core/time.hpp"
#include "hm/slam/laser/scan_graph_2d.hpp"

namespace hm {

/// A turn of the path that no loop says is right: between two keyframes of a stretch that no loop spans.
struct UncheckedTurn {
  double angle_rad = 0;  ///< by how much the matches of keyframes turn it against odometry; not negative
  Time from, to;         ///< stamps of the two
};

struct KeyframeRegistration {
  std::size_t pairs = 0;       ///< keyframes near each other that were matched
  std::size_t registered = 0;  ///< of these, whose match PL-ICP confirms
  double moved_m = 0;          ///< the largest change of a keyframe's position
  /// The largest, also where the result is not kept: odometry and the matches of keyframes know the same
  /// walls, and where they disagree about a turn at least one of them is wrong.
  UncheckedTurn unchecked;
};

/// Registers the keyframes of an optimised graph with their surroundings (Lu and Milios, "Globally consistent
/// range scan alignment for environment mapping", Autonomous Robots 1997): each is matched by PL-ICP with the
/// nearest twelve within 8 m, of this visit and of others, and all poses are solved for together with the
/// edges of the graph; twice, as better poses have other neighbours that match. Odometry compares a scan with
/// one keyframe and a loop leads to one submap; here errors of single matches average out.
///
/// Only poses change: edges and loops stay, and an optimise() of the graph forgets the registration. Nothing
/// changes where more of the map would contradict itself (graph_agreement); a stop that is requested ends it
/// after a round that is complete. Cost: twelve matches a keyframe and a solution, twice. The result does not
/// depend on the number of threads.
KeyframeRegistration register_keyframes(ScanGraph2D& graph, const RunContext& run = {});

}  // namespace hm
