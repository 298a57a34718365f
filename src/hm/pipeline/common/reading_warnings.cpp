#include "hm/pipeline/common/reading_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "hm/core/text/counted.hpp"

namespace hm {
namespace {

/// Sentences in their order, each once.
class Warnings {
 public:
  void add(const std::string& sentence) {
    if (std::find(sentences_.begin(), sentences_.end(), sentence) == sentences_.end())
      sentences_.push_back(sentence);
  }
  void add(const std::vector<SkippedLines>& skipped) {
    for (const SkippedLines& lines : skipped) add(to_string(lines));
  }
  std::vector<std::string> take() { return std::move(sentences_); }

 private:
  std::vector<std::string> sentences_;
};

}  // namespace

std::vector<std::string> reading_warnings(const RecordingInfo& info) {
  Warnings warnings;
  for (const std::string& assumption : info.assumptions) warnings.add(assumption);
  if (!info.poses_unreadable.empty()) warnings.add("poses are not used: " + info.poses_unreadable);
  warnings.add(info.skipped);
  if (info.missing_images > 0)
    warnings.add(fmt::format("{} missing (first: {})", counted(info.missing_images, "image"),
                             info.first_missing_image));
  return warnings.take();
}

std::vector<std::string> reading_warnings(const LaserRecording& recording) {
  Warnings warnings;
  warnings.add(recording.skipped);
  for (const std::string& damage : recording.damage) warnings.add(damage);
  for (const std::string& note : recording.notes) warnings.add(note);
  return warnings.take();
}

}  // namespace hm
