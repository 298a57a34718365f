#include "hm/pipeline/flight/emulated_board.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

namespace hm {
namespace {

constexpr std::uint8_t kReady = 'R';

/// Replaces a child process by the emulator. Only calls that are allowed after fork().
[[noreturn]] void become(const std::vector<char*>& words, int port, int messages, int status) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // ends with us, however we end
  ::dup2(port, STDIN_FILENO);
  ::dup2(port, STDOUT_FILENO);
  ::dup2(messages, STDERR_FILENO);
  ::execvp(words[0], words.data());
  const int reason = errno;
  (void)!::write(status, &reason, sizeof reason);
  ::_exit(127);
}

/// A pair of connected descriptors that other programs do not inherit.
Result<std::pair<FileDescriptor, FileDescriptor>> make_pair(bool socket) {
  std::array<int, 2> ends{};
  const int made = socket ? ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data())
                          : ::pipe2(ends.data(), O_CLOEXEC);
  if (made != 0) return fail(ErrorCode::kInternal, "emulated board", "no pipe: {}", std::strerror(errno));
  return std::pair(FileDescriptor(ends[0]), FileDescriptor(ends[1]));
}

}  // namespace

Result<std::unique_ptr<EmulatedBoard>> EmulatedBoard::start(const EmulatedBoardSetup& setup) {
  if (!std::filesystem::exists(setup.image))
    return fail(ErrorCode::kNotFound, setup.image.string(),
                "no firmware here: build it with cmake -S firmware -B build/firmware -G Ninja && ninja -C "
                "build/firmware (packages gcc-arm-none-eabi, libnewlib-arm-none-eabi, "
                "libstdc++-arm-none-eabi-dev)");
  std::unique_ptr<EmulatedBoard> board(new EmulatedBoard(setup));
  if (auto launched = board->launch(); !launched) return forward_error(launched);
  if (auto ready = board->wait_ready(); !ready) return forward_error(ready);
  return board;
}

void EmulatedBoard::stop() {
  if (process_ < 0) return;
  ::kill(process_, SIGKILL);
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
}

Result<void> EmulatedBoard::launch() {
  auto port = make_pair(true), messages = make_pair(false), status = make_pair(false);
  for (auto* pair : {&port, &messages, &status})
    if (!*pair) return forward_error(*pair);
  std::vector<std::string> words{setup_.emulator,      "-machine", "netduinoplus2", "-display", "none",
                                 "-monitor",           "none",     "-serial",       "stdio",    "-kernel",
                                 setup_.image.string()};
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  process_ = ::fork();
  if (process_ == 0) become(pointers, port->second.get(), messages->second.get(), status->second.get());
  if (process_ < 0)
    return fail(ErrorCode::kInternal, setup_.emulator, "no process: {}", std::strerror(errno));
  status->second.reset();
  int reason = 0;
  if (::read(status->first.get(), &reason, sizeof reason) == sizeof reason)
    return fail(ErrorCode::kNotFound, setup_.emulator, "could not be started ({}): install the package {}",
                std::strerror(reason), "qemu-system-arm");
  port_ = std::move(port->first);
  messages_ = std::move(messages->first);
  ::fcntl(messages_.get(), F_SETFL, O_NONBLOCK);
  return {};
}

/// The board sends a byte when its serial port is on; what is sent before that is lost.
Result<void> EmulatedBoard::wait_ready() {
  std::array<std::uint8_t, 1> byte{};
  const auto count = read_some(byte);
  if (!count) return forward_error(count);
  if (byte[0] != kReady) return failed("the firmware does not start");
  return {};
}

tl::unexpected<Error> EmulatedBoard::failed(std::string_view what) {
  std::array<char, 500> text{};
  const ssize_t size = messages_.is_open() ? ::read(messages_.get(), text.data(), text.size()) : 0;
  const std::string_view said(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  return fail(ErrorCode::kInternal, setup_.image.string(), "{} after {} steps{}{}", what, steps_,
              said.empty() ? "" : ": ", said);
}

Result<std::size_t> EmulatedBoard::read_some(std::span<std::uint8_t> bytes) {
  for (;;) {
    if (!port_.wait_readable(setup_.answer_limit)) return failed("the board gives no answer");
    const ssize_t count = ::read(port_.get(), bytes.data(), bytes.size());
    if (count > 0) return static_cast<std::size_t>(count);
    if (count == 0) return failed("the emulator has ended");
    if (errno != EINTR) return failed(std::strerror(errno));
  }
}

Result<void> EmulatedBoard::send(const AutopilotInputs& inputs) {
  std::array<std::uint8_t, CoreRecorder::kMaxRecords * CoreTraceRecord::kBytes> bytes{};
  std::size_t size = 0, sent = 0;
  for (const CoreTraceRecord& record : recorder_.inputs(inputs)) {
    const CoreTraceFrame frame = frame_of(record);
    std::memcpy(bytes.data() + size, frame.bytes.data(), frame.size);
    size += frame.size;
  }
  while (sent < size) {
    const ssize_t count = ::send(port_.get(), bytes.data() + sent, size - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return failed("the emulator has ended");
    sent += static_cast<std::size_t>(count);
  }
  return {};
}

Result<CoreOutputs> EmulatedBoard::receive() {
  std::array<std::uint8_t, CoreTraceRecord::kBytes> bytes{};
  for (;;) {
    const auto count = read_some(bytes);
    if (!count) return forward_error(count);
    for (const std::uint8_t byte : std::span(bytes).first(*count)) {
      parser_.push(byte);
      const auto record = parser_.next();
      if (parser_.skipped() > 0) return failed("the board reports a fault");
      if (!record) continue;
      const auto outputs = read_core_outputs(*record);
      if (!outputs || record->sequence != steps_ + 1) return failed("the board answers another step");
      return *outputs;
    }
  }
}

AutopilotOutputs EmulatedBoard::step(const AutopilotInputs& inputs) {
  if (!failure_) {
    Result<void> sent = send(inputs);
    Result<CoreOutputs> answer = sent ? receive() : forward_error(sent);
    if (answer) {
      ++steps_;
      estimate_.stamp = inputs.imu ? inputs.imu->stamp : inputs.now;
      estimate_.position_m = answer->position_m;
      estimate_.velocity_m_s = answer->velocity_m_s;
      estimate_.roll_pitch_yaw_rad = answer->roll_pitch_yaw_rad;
      estimate_.planar_ready = answer->planar_ready;
      estimate_.height_ready = answer->height_ready;
      return answer->outputs;
    }
    failure_ = answer.error();
  }
  AutopilotOutputs off;
  off.stamp = inputs.now;
  off.state = AutopilotState::kError;
  return off;
}

}  // namespace hm
