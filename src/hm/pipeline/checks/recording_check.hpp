#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/checks/stream_report.hpp"

namespace hm {

/// Statistics of the sampled depth images; metres. All zero when none could be read.
struct DepthReport {
  std::size_t frames_sampled = 0;
  std::size_t frames_unreadable = 0;
  std::string first_error;  ///< why the first unreadable one could not be read
  double valid_ratio = 0;
  double min_m = 0, p05_m = 0, median_m = 0, p95_m = 0, max_m = 0;
};

/// Agreement of poses and depth under one reading of the files: one frame's depth is moved into
/// another by their poses, and compared with the depth measured there.
struct AgreementReport {
  std::string hypothesis;       ///< "as given", "poses inverted", "depth x 10", ...
  double agreement_mm = 0;      ///< median over the pairs of the median |z predicted - z measured|
  double agreement_ratio = 1;   ///< the same, relative to the depth: comparable between depth scales
  double systematic_ratio = 1;  ///< the same with the noise of single pixels averaged out (80 x 80 px)
  double overlap_ratio = 0;     ///< share of predicted points that met a measured depth
};

enum class FindingKind {
  kDepthScale,         ///< another depth unit fits the poses clearly better
  kInvertedPoses,      ///< the poses are world-to-camera
  kQuaternionOrder,    ///< the real part of the quaternions comes first
  kFlippedFy,          ///< fy has the wrong sign
  kPoorAgreement,      ///< depth and poses do not agree, and no hypothesis explains it
  kStamps,             ///< stamps run backwards or repeat
  kUnregisteredColor,  ///< colour edges lie a shift or a scale away from depth edges
  kMissing,            ///< images are missing or unreadable, lines were left out
  kMissingPoses,       ///< depth images without a pose
  kMissingColor,       ///< no colour images at all
  kGap,                ///< holes in a stream
  kDepthRange,         ///< almost nothing valid
  kOddScale,           ///< depths that no such sensor delivers: the depth unit may be another
  kPoseUnit,           ///< the poses are not in metres
};
std::string_view to_string(FindingKind kind);

/// Something that looks wrong, in words, with the number that shows it.
struct Finding {
  FindingKind kind;
  std::string message;
};

/// Offset of colour edges from depth edges: the shift of the colour image that fits best, and its
/// scale about the image's middle.
struct ColorShift {
  int right_px = 0, down_px = 0;
  double gain_ratio = 1;   ///< colour gradient at depth edges with the shift, over the one without
  double scale_ratio = 1;  ///< of what colour sees, by what depth sees; 1 unless another is clearly better
  bool is_judged = false;  ///< there were edges enough, in enough of the image
};

/// Content of a recording, for `hm info`.
struct RecordingReport {
  RecordingInfo info;
  std::vector<StreamReport> streams;
  DepthReport depth;
  ColorShift color_shift;
  double path_length_m = 0;
  Vec3 pose_extent_m = Vec3::Zero();  ///< size of the box around the camera centres
  std::size_t pairs_compared = 0;
  std::vector<AgreementReport> agreement;  ///< "as given" first; empty when no pair moved enough
  std::vector<Finding> findings;
};

struct InspectOptions {
  int depth_samples = 20;          ///< frames whose depth statistics are taken
  int pairs = 12;                  ///< pairs of frames compared under every hypothesis
  double min_motion_m = 0.01;      ///< a pair needs this much translation ...
  double min_rotation_rad = 0.01;  ///< ... or this much rotation
};

/// Looks at a recording: streams, rates, depth, poses, and what seems wrong with them. Decodes about fifty
/// images. Images that cannot be read are counted, not fatal.
RecordingReport inspect_recording(const Recording& recording, const InspectOptions& options = {},
                                  const ProgressSink& progress = {});

/// The report's keys in snake_case with units, and its lines for a terminal.
void visit(const RecordingReport& report, SummaryTree& v);
std::string to_text(const RecordingReport& report);

}  // namespace hm
