#include "hm/pipeline/common/run_records.hpp"

#include <algorithm>
#include <cmath>

namespace hm {

void RunningSummary::add(double value) {
  min_ = values_.count() == 0 ? value : std::min(min_, value);
  max_ = values_.count() == 0 ? value : std::max(max_, value);
  sum_ += value;
  squares_ += value * value;
  values_.push_back(value);
}

Summary RunningSummary::summary() const {
  Summary summary = summarise(values_.items());
  if (values_.count() == values_.items().size()) return summary;
  const auto count = static_cast<double>(values_.count());
  summary.count = values_.count();
  summary.mean = sum_ / count;
  summary.rmse = std::sqrt(squares_ / count);
  summary.min = min_, summary.max = max_;
  return summary;
}

}  // namespace hm
