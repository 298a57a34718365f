#include "terminal.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "hm/core/text/counted.hpp"
#include "output.hpp"

namespace {

constexpr std::chrono::milliseconds kRedraw{100};
constexpr std::chrono::seconds kPlainInterval{5};

/// 75 -> "1:15".
std::string clock_text(double seconds) {
  const long whole = std::lround(seconds);
  return whole >= 3600 ? fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60)
                       : fmt::format("{}:{:02}", whole / 60, whole % 60);
}

/// 0.25 -> " [#####...............]".
std::string bar_text(double ratio) {
  constexpr std::size_t kWidth = 20;
  const auto filled = std::min(kWidth, static_cast<std::size_t>(ratio * kWidth));
  return " [" + std::string(filled, '#') + std::string(kWidth - filled, '.') + "]";
}

/// Width of the terminal in characters, at least 1; 80 where neither the terminal nor COLUMNS says it.
std::size_t columns() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  const char* words = std::getenv("COLUMNS");
  const long width = words ? std::strtol(words, nullptr, 10) : 0;
  return width > 0 ? static_cast<std::size_t>(width) : 80;
}

/// The first `most` characters of a text in UTF-8, none of them cut in two.
std::string_view first_characters(std::string_view text, std::size_t most) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool begins_character = (static_cast<unsigned char>(text[i]) & 0xc0) != 0x80;
    if (begins_character && count++ == most) return text.substr(0, i);
  }
  return text;
}

}  // namespace

Terminal::Terminal() {
  const char* kind = std::getenv("TERM");
  interactive_ = isatty(STDERR_FILENO) != 0 && kind && std::string_view(kind) != "dumb";
}

Terminal::~Terminal() { clear(); }

void Terminal::clear() {
  if (drawn_) write_message("\r\033[K");
  drawn_ = false;
}

void Terminal::line(const std::string& text) {
  const std::lock_guard lock(mutex_);
  clear();
  write_message(text + "\n");
}

void Terminal::show(const hm::Progress& progress) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  if (progress.stage != stage_) begin_stage(progress, now);
  const auto interval = interactive_ ? Clock::duration(kRedraw) : Clock::duration(kPlainInterval);
  const bool finished = progress.total > 0 && progress.done >= progress.total;
  if (now - last_shown_ < interval && !(finished && interactive_)) return;
  last_shown_ = now;
  const std::string text = progress_text(progress, now);
  if (!interactive_) {
    write_message(text + "\n");
    return;
  }
  // The last column stays free: a character there makes some terminals begin a new line.
  write_message("\r\033[K" + std::string(first_characters(text, columns() - 1)));
  std::fflush(stderr);
  drawn_ = true;
}

void Terminal::begin_stage(const hm::Progress& progress, Clock::time_point now) {
  stage_ = progress.stage;
  stage_begin_ = now;
  stage_begin_done_ = progress.done;
  last_shown_ = interactive_ ? Clock::time_point{} : now;
  if (!interactive_) write_message(stage_ + "\n");
}

std::string Terminal::progress_text(const hm::Progress& progress, Clock::time_point now) const {
  std::string text = progress.stage;
  if (progress.total > 0) {
    const double ratio = static_cast<double>(progress.done) / static_cast<double>(progress.total);
    if (interactive_) text += bar_text(ratio);
    text += fmt::format(" {} of {} ({:.0f} %)", hm::with_thousands(progress.done),
                        hm::with_thousands(progress.total), 100 * ratio);
    text += rate_text(progress, now);
  }
  if (!progress.details.empty()) text += ", " + progress.details;
  return text;
}

std::string Terminal::rate_text(const hm::Progress& progress, Clock::time_point now) const {
  constexpr double kFirstGuess_s = 0.5;
  const double elapsed_s = std::chrono::duration<double>(now - stage_begin_).count();
  const auto done_here = static_cast<double>(progress.done - std::min(progress.done, stage_begin_done_));
  if (elapsed_s <= kFirstGuess_s || done_here <= 0) return {};
  const double per_s = done_here / elapsed_s;
  const auto left = static_cast<double>(progress.total - std::min(progress.total, progress.done));
  return fmt::format(", {:.1f}/s, {} left", per_s, clock_text(left / per_s));
}
