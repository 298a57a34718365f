#pragma once
#include "hm/report/html_report.hpp"
#include "hm/pipeline/laser/laser_run.hpp"

namespace hm {

/// The part of a run's page about the frame `map`: loops or the place in a saved map, what the correction
/// changed, and where `odom` lay over time. Nothing where `map` is `odom` by choice.
void add_map_frame_section(HtmlReport& report, const LaserSummary& summary);

}  // namespace hm
