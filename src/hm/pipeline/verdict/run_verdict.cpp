#include "hm/pipeline/verdict/run_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "hm/core/statistics.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/report/plot.hpp"

namespace hm {

std::string_view to_string(MapVerdict verdict) {
  switch (verdict) {
    case MapVerdict::kOk:
      return "ok";
    case MapVerdict::kDoubtful:
      return "doubtful";
    case MapVerdict::kBroken:
      break;
  }
  return "broken";
}

void RunVerdict::add(MapVerdict verdict, std::string reason) {
  if (verdict == MapVerdict::kOk) return;
  if (verdict > value)
    reasons.insert(reasons.begin(), std::move(reason));
  else
    reasons.push_back(std::move(reason));
  value = std::max(value, verdict);
}

namespace {

std::string text_of(const RunVerdict& verdict) {
  std::string text(to_string(verdict.value));
  for (std::size_t i = 0; i < verdict.reasons.size(); ++i)
    text += (i == 0 ? ": " : "; ") + verdict.reasons[i];
  return text;
}

}  // namespace

void visit(const RunVerdict& verdict, SummaryTree& v) {
  v({"value"}, to_string(verdict.value));
  v.json("reasons", JsonValue::array_of(verdict.reasons));
  v.shown("text", {}, text_of(verdict));
  v.group("visits", verdict.visits);
  v.group("steps", verdict.steps);
}

RunVerdict verdict_of_report(const JsonValue& report) {
  RunVerdict verdict;
  const JsonValue* written = report.find("verdict");
  const auto* value = written ? written->find_as<std::string>("value") : nullptr;
  if (!value) return verdict;
  for (const MapVerdict known : {MapVerdict::kDoubtful, MapVerdict::kBroken})
    if (*value == to_string(known)) verdict.value = known;
  for (const JsonValue& reason : written->list_at("reasons"))
    if (const auto* text = reason.as_string()) verdict.reasons.push_back(*text);
  if (verdict.value != MapVerdict::kOk && verdict.reasons.empty())
    verdict.reasons.emplace_back("the report gives no reason");
  return verdict;
}

std::string verdict_sentence(const RunVerdict& verdict, const std::string& result) {
  if (verdict.value == MapVerdict::kOk) return result;
  const bool broken = verdict.value == MapVerdict::kBroken;
  return fmt::format("{}: {}. {}", broken ? "Broken" : "Doubtful", verdict.reasons.front(), result);
}

HtmlReport::Verdict report_verdict(const RunVerdict& verdict) {
  switch (verdict.value) {
    case MapVerdict::kOk:
      return HtmlReport::Verdict::kGood;
    case MapVerdict::kDoubtful:
      return HtmlReport::Verdict::kDoubtful;
    case MapVerdict::kBroken:
      break;
  }
  return HtmlReport::Verdict::kBad;
}

std::optional<Error> strict_failure(const RunVerdict& verdict) {
  if (verdict.value == MapVerdict::kOk) return std::nullopt;
  return Error{ErrorCode::kNoResult, "the verdict is " + text_of(verdict), "--strict"};
}

WindowMedians window_medians(const std::vector<double>& values, std::size_t window) {
  WindowMedians result;
  window = std::min(window, values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t first = std::min(i - std::min(i, window / 2), values.size() - window);
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
    result.medians.push_back(
        quantile(std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(window)), 0.5));
    if (result.medians.back() <= result.worst && i > 0) continue;
    result.worst = result.medians.back();
    result.worst_index = i;
  }
  return result;
}

VisitConsistency summarise_visits(std::vector<VisitComparison> comparisons, std::size_t window) {
  VisitConsistency result;
  result.places = comparisons.size();
  if (comparisons.empty()) return result;
  std::vector<double> ratios;
  for (const VisitComparison& comparison : comparisons) ratios.push_back(comparison.contradicted_ratio);
  WindowMedians windows = window_medians(ratios, window);
  result.worst_ratio = windows.worst;
  result.worst_time_s = comparisons[windows.worst_index].time_s;
  result.p95_ratio = quantile(windows.medians, 0.95);
  result.medians = std::move(windows.medians);
  result.comparisons = std::move(comparisons);
  return result;
}

void visit(const VisitConsistency& visits, SummaryTree& v) {
  v({"places", "places seen again"}, visits.places);
  v({"worst_contradicted_ratio", "worst place, contradicted", "{:.0f} %", 100}, visits.worst_ratio);
  v({"worst_time_s", "worst place, time", "{:.1f} s"}, visits.worst_time_s);
  v({"p95_contradicted_ratio", "95 % of the places, contradicted less than", "{:.0f} %", 100},
    visits.p95_ratio);
  if (visits.worst_offset_ratio)
    v({"worst_offset_ratio", "worst place, depth differs by", "{:.1f} %", 100}, *visits.worst_offset_ratio);
}

void visit(const StepConsistency& steps, SummaryTree& v) {
  v({"compared", "neighbouring depth images compared"}, steps.compared);
  v({"worst_time_s", "worst neighbours, time", "{:.1f} s"}, steps.worst_time_s);
  v({"contradicted_ratio", "worst neighbours, contradicted", "{:.0f} %", 100}, steps.contradicted_ratio);
  v({"offset_ratio", "worst neighbours, depth differs by", "{:.1f} %", 100}, steps.offset_ratio);
  v({"tilt_rad", "worst neighbours, tilted by", "{:.3f} rad"}, steps.tilt_rad);
  v({"color_rad", "worst neighbours, colour moved by", "{:.3f} rad"}, steps.color_rad);
}

namespace {

/// Whether so much is contradicted, at so many places, that the result is not to be used as a whole.
bool breaks(const VisitConsistency& visits, const VisitLimits& limits) {
  constexpr std::size_t kEnough = 9, kFew = 5;
  constexpr double kNearlyAll_ratio = 0.6;  // of what is seen at a place
  if (visits.places >= kEnough)
    return visits.worst_ratio > limits.broken_ratio || visits.p95_ratio > limits.broken_p95_ratio;
  if (visits.places < kFew) return false;
  std::vector<double> ratios;
  for (const VisitComparison& comparison : visits.comparisons)
    ratios.push_back(comparison.contradicted_ratio);
  return quantile(std::move(ratios), 0.5) > kNearlyAll_ratio;
}

/// Comparisons in a window, an odd number.
std::size_t window_of(const std::vector<VisitComparison>& comparisons, const VisitLimits& limits) {
  constexpr std::size_t kLeast = 5;
  std::vector<double> steps_m;
  for (std::size_t i = 1; i < comparisons.size(); ++i)
    steps_m.push_back((comparisons[i].place_m - comparisons[i - 1].place_m).norm());
  if (limits.window_m == 0 || steps_m.empty()) return limits.window;
  const double in_window = limits.window_m / std::max(quantile(std::move(steps_m), 0.5), 1e-3);
  if (in_window >= static_cast<double>(limits.window)) return limits.window;
  return std::max(kLeast, static_cast<std::size_t>(in_window) | 1U);
}

}  // namespace

void judge_visits(std::vector<VisitComparison> comparisons, const VisitLimits& limits, std::string_view what,
                  RunVerdict& verdict) {
  const std::size_t window = window_of(comparisons, limits);
  verdict.visits = summarise_visits(std::move(comparisons), window);
  verdict.doubtful_ratio = limits.doubtful_ratio;
  const VisitConsistency& visits = *verdict.visits;
  if (visits.places == 0 || visits.worst_ratio <= limits.doubtful_ratio) return;
  verdict.add(breaks(visits, limits) ? MapVerdict::kBroken : MapVerdict::kDoubtful,
              fmt::format("around {:.1f} s after the start, {:.0f} % of what {} show stands in the free "
                          "space of another visit: the path is wrong there, or people or things have moved",
                          visits.worst_time_s, 100 * visits.worst_ratio, what));
}

void add_doubts(std::vector<std::string> doubts, RunVerdict& verdict) {
  for (std::string& doubt : doubts) verdict.add(MapVerdict::kDoubtful, std::move(doubt));
}

void judge_missing_poses(std::size_t missing, std::size_t all, std::string_view what, RunVerdict& verdict) {
  constexpr double kDoubtful_ratio = 0.05, kBroken_ratio = 0.3;
  if (all == 0) return;
  const double ratio = static_cast<double>(missing) / static_cast<double>(all);
  if (ratio > kDoubtful_ratio)
    verdict.add(ratio > kBroken_ratio ? MapVerdict::kBroken : MapVerdict::kDoubtful,
                fmt::format("{:.0f} % of the {} have no pose", 100 * ratio, what));
}

void judge_memory_limit(const MemoryLimit& limit, std::vector<std::string>& warnings, RunVerdict& verdict) {
  if (limit.max_map_mb == 0 || limit.refused == 0) return;
  const std::string reached =
      fmt::format("the memory cap of {} MB ({}) was reached: ", limit.max_map_mb, limit.parameter);
  warnings.push_back(reached + counted(limit.refused, limit.unit) + " not added");
  verdict.add(MapVerdict::kDoubtful, reached + "parts of the map are missing");
}

void add_visits_section(HtmlReport& report, const RunVerdict& verdict) {
  if (!verdict.visits || verdict.visits->places == 0) return;
  const VisitConsistency& visits = *verdict.visits;
  report.begin_section(
      "Places seen again",
      "Share of what one visit of a place saw that stands in the free space of another: what a wrong path "
      "leads to. Judged is the median of neighbouring places.");
  PlotSeries single{"one place", {}, {}, SeriesStyle::kScatter}, medians{"median", {}, visits.medians};
  PlotSeries consistent{"consistent", {}, {}, SeriesStyle::kScatter, "#4c78a8"};
  PlotSeries contradicted{"contradicted", {}, {}, SeriesStyle::kScatter, "#d65420"};
  for (std::size_t i = 0; i < visits.places; ++i) {
    const VisitComparison& comparison = visits.comparisons[i];
    single.x.push_back(comparison.time_s);
    medians.x.push_back(comparison.time_s);
    single.y.push_back(comparison.contradicted_ratio);
    PlotSeries& place = visits.medians[i] > verdict.doubtful_ratio ? contradicted : consistent;
    place.x.push_back(comparison.place_m.x());
    place.y.push_back(comparison.place_m.y());
  }
  PlotOptions over_time;
  over_time.x.label = "time (s)", over_time.y.label = "contradicted";
  over_time.y.min = 0, over_time.y.max = 1;
  over_time.marks.push_back({PlotMark::Direction::kHorizontal, verdict.doubtful_ratio, "doubtful"});
  const std::array<PlotSeries, 2> in_time{std::move(single), std::move(medians)};
  report.add_svg(plot_svg(in_time, over_time), "When.");
  PlotOptions from_above;
  from_above.x.label = "x (m)", from_above.y.label = "y (m)";
  from_above.equal_aspect = true;
  const std::array<PlotSeries, 2> places{std::move(consistent), std::move(contradicted)};
  report.add_svg(plot_svg(places, from_above), "Where, from above.");
}

}  // namespace hm
