#include "flags/serve_flags.hpp"

#include <unistd.h>

#include <fmt/format.h>

#include <chrono>
#include <string_view>
#include <thread>

#include "output.hpp"
#include "version.hpp"

namespace {

/// Value of --serve without one.
constexpr std::string_view kThisMachine = "default";
/// Time for the last frames to reach the viewers.
constexpr std::chrono::milliseconds kLastFrames{500};

}  // namespace

void ServeFlags::add_to(Command command) {
  command
      .add_flag(
          fmt::format("--serve{{{}}}", kThisMachine), listen,
          "show the run live on a web page; --serve=PORT or --serve=ADDRESS:PORT (an address that other "
          "machines reach needs the token in the link that is printed)")
      .each([this](const std::string&) { is_wanted = true; });
}

hm::Result<Serving> ServeFlags::open(hm::LiveStationOptions options, const hm::ParamList& in_effect,
                                     hm::RunContext& run) const {
  if (!is_wanted) return Serving();
  options.listen = listen == kThisMachine ? "" : listen;
  options.program_version = kVersion;
  auto session = hm::LiveStation::open(options);
  if (!session) return hm::forward_error(session);
  write_message((*session)->announcement() + "\n");
  run.view = &(*session)->view();
  run.view->on_parameters(in_effect.to_toml());
  return Serving(std::move(*session), run.stop);
}

void Serving::finish(bool worked, const std::string& reason) {
  if (!session_) return;
  session_->offer_report();
  session_->view().set_state(worked ? "finished" : "failed", reason);
  session_->view().flush();
  if (session_->station().viewers() > 0) std::this_thread::sleep_for(kLastFrames);
  if (isatty(STDERR_FILENO) == 0 || stop_.stop_requested()) return;
  write_message("the run has ended; the live view stays open until Ctrl-C\n");
  while (!stop_.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
}
