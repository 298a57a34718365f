#include "terminal.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace {

constexpr std::chrono::milliseconds kRedraw{100};
constexpr std::chrono::seconds kPlainInterval{5};

/// 75 -> "1:15".
std::string clock_text(double seconds) {
  const auto whole = static_cast<long>(seconds + 0.5);
  return whole >= 3600 ? fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60)
                       : fmt::format("{}:{:02}", whole / 60, whole % 60);
}

std::size_t columns() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 20 ? size.ws_col : 80;
}

}  // namespace

Terminal::Terminal() {
  const char* kind = std::getenv("TERM");
  interactive_ = isatty(STDERR_FILENO) != 0 && kind && std::string_view(kind) != "dumb";
}

Terminal::~Terminal() { clear(); }

void Terminal::clear() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
  drawn_ = false;
}

void Terminal::line(const std::string& text) {
  clear();
  fmt::print(stderr, "{}\n", text);
}

void Terminal::show(const hm::Progress& progress) {
  const auto now = Clock::now();
  if (progress.stage != stage_) {
    stage_ = progress.stage;
    stage_begin_ = now;
    stage_begin_done_ = progress.done;
    last_shown_ = interactive_ ? Clock::time_point{} : now;
    if (!interactive_) fmt::print(stderr, "{}\n", stage_);
  }
  const bool finished = progress.total > 0 && progress.done >= progress.total;
  if (now - last_shown_ < (interactive_ ? Clock::duration(kRedraw) : Clock::duration(kPlainInterval)) &&
      !(finished && interactive_))
    return;
  last_shown_ = now;
  std::string text = stage_;
  const double elapsed_s = std::chrono::duration<double>(now - stage_begin_).count();
  const double done_here = static_cast<double>(progress.done - std::min(progress.done, stage_begin_done_));
  const double per_s = elapsed_s > 0 ? done_here / elapsed_s : 0;
  if (progress.total > 0) {
    const double ratio = static_cast<double>(progress.done) / static_cast<double>(progress.total);
    if (interactive_) {
      constexpr std::size_t kWidth = 20;
      const auto filled = std::min(kWidth, static_cast<std::size_t>(ratio * kWidth));
      text += " [" + std::string(filled, '#') + std::string(kWidth - filled, '.') + "]";
    }
    text += fmt::format(" {} of {} ({:.0f} %)", progress.done, progress.total, 100 * ratio);
    if (per_s > 0 && elapsed_s > 0.5)
      text += fmt::format(
          ", {:.1f}/s, {} left", per_s,
          clock_text(static_cast<double>(progress.total - std::min(progress.total, progress.done)) / per_s));
  }
  if (!progress.details.empty()) text += ", " + progress.details;
  if (interactive_) {
    if (text.size() >= columns()) text.resize(columns() - 1);
    fmt::print(stderr, "\r\033[K{}", text);
    drawn_ = true;
    std::fflush(stderr);
  } else {
    fmt::print(stderr, "{}\n", text);
  }
}
