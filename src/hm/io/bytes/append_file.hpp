#pragma once
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "hm/core/result.hpp"

namespace hm {

/// A file that only grows, for a journal: unlike OutputFile it has its name from the start, so after a kill
/// it may end in the middle of a write. Whoever reads it must know from elsewhere how much of it counts.
/// Stays open when it is renamed. After a failed write later ones are ignored and every Result has the error.
class AppendFile {
 public:
  /// A new, empty file; an earlier regular file of that name is replaced, a link is an error.
  static Result<AppendFile> create(const std::filesystem::path& path);
  /// Continues a file after its first `size` bytes; what stands behind them is cut off. Errors: not found, a
  /// link, shorter.
  static Result<AppendFile> continue_at(const std::filesystem::path& path, std::uint64_t size);

  void append(std::span<const std::uint8_t> bytes);
  /// Bytes so far.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// The error of the first write that failed, as far as bytes have been handed over by now: of a full disk
  /// at most a few kB late.
  [[nodiscard]] Result<void> written() const;
  /// Hands everything to the operating system: a kill of the process then loses none of it.
  Result<void> flush();
  /// Syncs what flush() has handed over to disk. May run on another thread while this one appends.
  [[nodiscard]] Result<void> sync() const;

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  AppendFile(std::string name, std::unique_ptr<std::FILE, Closer> file, std::uint64_t size)
      : name_(std::move(name)), file_(std::move(file)), size_(size) {}

  std::string name_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::uint64_t size_ = 0;
  int failure_ = 0;  ///< errno of the first failure
};

}  // namespace hm
