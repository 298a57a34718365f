#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>

#include "fuzz_readers.hpp"
#include "fuzz_seeds.hpp"
#include "hm/io/bytes/file_bytes.hpp"

/// What libFuzzer calls. HM_FUZZ_READER names the reader; HM_FUZZ_SEEDS a folder that its good files are
/// written into first. Without a reader the names of all are printed.
namespace {
const hm::fuzz::Reader* chosen = nullptr;

void write_seeds(const std::filesystem::path& folder) {
  int number = 0;
  for (const hm::fuzz::Seed& seed : hm::fuzz::seeds())
    if (seed.reader == chosen->name &&
        !hm::write_file_bytes(folder / ("seed" + std::to_string(number++)), seed.bytes))
      std::abort();
}
}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* name = std::getenv("HM_FUZZ_READER");
  chosen = name ? hm::fuzz::find_reader(name) : nullptr;
  if (!chosen) {
    for (const hm::fuzz::Reader& reader : hm::fuzz::readers())
      std::printf("%.*s\n", static_cast<int>(reader.name.size()), reader.name.data());
    std::exit(name ? 2 : 0);
  }
  if (const char* folder = std::getenv("HM_FUZZ_SEEDS")) write_seeds(folder);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->run({data, size});
  return 0;
}
