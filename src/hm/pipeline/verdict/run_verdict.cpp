#include "hm/pipeline/verdict/run_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "hm/core/statistics.hpp"

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

VisitConsistency summarise_visits(std::span<const VisitComparison> comparisons) {
  VisitConsistency result;
  result.places = comparisons.size();
  if (comparisons.empty()) return result;
  const std::size_t window = std::min(VisitConsistency::kWindow, comparisons.size());
  std::vector<double> medians;
  for (std::size_t first = 0; first + window <= comparisons.size(); ++first) {
    std::vector<double> ratios;
    for (const VisitComparison& comparison : comparisons.subspan(first, window))
      ratios.push_back(comparison.contradicted_ratio);
    medians.push_back(quantile(std::move(ratios), 0.5));
    if (medians.back() <= result.worst_ratio && first > 0) continue;
    result.worst_ratio = medians.back();
    result.worst_time_s = comparisons[first + window / 2].time_s;
  }
  result.p95_ratio = quantile(std::move(medians), 0.95);
  return result;
}

void visit(const VisitConsistency& visits, SummaryTree& v) {
  v({"places", "places seen again"}, visits.places);
  v({"worst_contradicted_ratio", "worst place, contradicted", "{:.0f} %", 100}, visits.worst_ratio);
  v({"worst_time_s", "worst place, time", "{:.1f} s"}, visits.worst_time_s);
  v({"p95_contradicted_ratio", "95 % of the places, contradicted less than", "{:.0f} %", 100},
    visits.p95_ratio);
}

void judge_visits(std::span<const VisitComparison> comparisons, const VisitLimits& limits,
                  std::string_view what, RunVerdict& verdict) {
  verdict.visits = summarise_visits(comparisons);
  const VisitConsistency& visits = *verdict.visits;
  if (visits.places == 0 || visits.worst_ratio <= limits.doubtful_ratio) return;
  const bool broken =
      visits.places >= VisitConsistency::kWindow &&
      (visits.worst_ratio > limits.broken_ratio || visits.p95_ratio > limits.broken_p95_ratio);
  verdict.add(
      broken ? MapVerdict::kBroken : MapVerdict::kDoubtful,
      fmt::format("around {:.1f} s after the start, {:.0f} % of what {} of one visit show stands in the "
                  "free space of another (of all {} places seen again, 95 % have less than {:.0f} %)",
                  visits.worst_time_s, 100 * visits.worst_ratio, what, visits.places,
                  100 * visits.p95_ratio));
}

}  // namespace hm
