#pragma once
#include <fmt/core.h>

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace hm {

/// Reason why an operation on external input (file, folder, configuration) failed.
enum class ErrorCode {
  kNotFound,      ///< a file, folder, stream or key does not exist
  kUnreadable,    ///< the operating system refused to open, read or write it
  kTruncated,     ///< the input ends too early
  kCorrupted,     ///< its contents contradict its format
  kUnsupported,   ///< a valid variant that this program does not handle
  kInvalidValue,  ///< a value is outside of its allowed range, or not a number
  kUsage,         ///< invalid command-line usage or request
  kOutOfMemory,   ///< a memory cap was reached
  kCancelled,     ///< stopped by the user
  kInternal,      ///< unexpected failure, e.g. of an external library
  kNoResult,      ///< the input is valid, but does not contain the result
};
std::string_view to_string(ErrorCode code);

/// Error description for the user: what is wrong, and where (path, with line or byte offset where known).
struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;
  std::string where;
};

/// "where: message", or just the message.
std::string to_string(const Error& error);

/// A value or an Error. Used for input, files and configuration; a broken precondition is an HM_CHECK, and an
/// estimation failure is a status in a result struct.
template <class T>
using Result = tl::expected<T, Error>;

/// Creates the error of a Result: `return fail(ErrorCode::kTruncated, path, "ends at byte {}", n);`
template <class... Args>
[[nodiscard]] tl::unexpected<Error> fail(ErrorCode code, std::string where,
                                         fmt::format_string<Args...> format, Args&&... args) {
  return tl::make_unexpected(Error{code, fmt::format(format, std::forward<Args>(args)...), std::move(where)});
}

/// Propagates an error to a Result of another value type.
template <class T>
[[nodiscard]] tl::unexpected<Error> forward_error(const Result<T>& result) {
  return tl::make_unexpected(result.error());
}

}  // namespace hm
