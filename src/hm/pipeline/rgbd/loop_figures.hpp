#pragma once
#include <span>
#include <string>
#include <vector>

#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/report/html_report.hpp"
#include "hm/slam/place_recognition/place_experiment.hpp"

namespace hm {

/// Images of an accepted loop side by side, with lines between the features on which the keyframes agree.
struct LoopFigure {
  std::string summary;  ///< "frames 12 and 97, 2.8 s apart: 31 matches, 0.05 m and 2 deg between the cameras"
  Image<Rgb8> image;
};

/// Draws at most `most` loops of the graph, those with most keyframes between their ends: reads both colour
/// images again and matches the keyframes' features by verify_place(). Node i of the graph is keyframe i.
/// Loops whose images cannot be read are left out.
std::vector<LoopFigure> draw_loops(const FrameSource& frames, const PoseGraph3D& graph,
                                   KeyframeList keyframes, const PlaceVerifierParams& params,
                                   std::size_t most = 12);

/// Adds them as lines that unfold; nothing for none.
void add_loop_figures(HtmlReport& report, std::span<const LoopFigure> figures);

}  // namespace hm
