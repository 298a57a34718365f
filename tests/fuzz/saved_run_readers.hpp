#pragma once
#include <cstdint>
#include <span>

namespace hm::fuzz {

/// Readers of what an unfinished run has saved; true when the bytes were read.
/// State of a reconstruction, as the header of its map holds it.
bool read_reconstruction_state(std::span<const std::uint8_t> bytes);
/// slam_state.bin, with its size and checksum set right.
bool read_checkpoint(std::span<const std::uint8_t> bytes);
/// slam_journal.bin, with the checksums of its records set right.
bool read_journal(std::span<const std::uint8_t> bytes);

}  // namespace hm::fuzz
