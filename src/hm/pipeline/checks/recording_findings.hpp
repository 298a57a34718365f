#pragma once
#include <string>
#include <vector>

#include "hm/pipeline/checks/pose_agreement.hpp"
#include "hm/pipeline/checks/recording_check.hpp"

/// Checks of inspect_recording(): each function appends what it finds to report.findings.
namespace hm {

/// In words, why not one depth image has a pose although the recording has poses: another clock, or gaps.
std::string why_no_pose_fits(const RecordingInfo& info);

/// Images, poses and colour that are not there or cannot be used.
void find_missing(RecordingReport& report);
/// Stamps that run backwards or repeat; long holes.
void find_odd_stamps(RecordingReport& report);
/// Depth that no such sensor delivers.
void find_odd_depth(RecordingReport& report);
void find_color_shift(RecordingReport& report);
/// Compares every reading of depth and poses; fills report.agreement.
void find_misreading(const std::vector<FramePair>& pairs, RecordingReport& report);

}  // namespace hm
