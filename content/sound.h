// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

// Sound files: WAV, FLAC and Ogg, read with libsndfile. Pure functions; thread-safe. Each throws Error, which
// names the file, when the bytes are no such file or exceed the limits.
namespace docent::content {

// A guide's sound is a few minutes of speech; its samples at 16 bits stay below 120 MB.
inline constexpr std::uint64_t kMaxSoundFileBytes = std::uint64_t{32} << 20;
inline constexpr double kMaxSoundSeconds = 600;
inline constexpr int kMinSoundRate = 8000, kMaxSoundRate = 192'000;  // Samples per second and channel.
inline constexpr std::uint64_t kMaxSoundSamples = 60'000'000;        // Of all channels together.

// What the header of a sound file says.
struct SoundFormat {
  int channels = 1;          // 1 or 2.
  int rate = kMinSoundRate;  // Samples per second and channel.
  std::uint64_t frames = 0;  // Samples of each channel; positive.

  double seconds() const { return static_cast<double>(frames) / rate; }
};

// A decoded sound.
struct SoundSamples {
  SoundFormat format;
  std::vector<std::int16_t> samples;  // frames x channels, the channels side by side.
};

// Whether the bytes begin like such a file.
bool IsSoundFile(std::span<const std::uint8_t> bytes);
// Reads the header only.
SoundFormat ReadSoundFormat(const std::string& file, std::span<const std::uint8_t> bytes);
// Also refuses a file that ends too early. Takes about a second for the longest sound.
SoundSamples DecodeSound(const std::string& file, std::span<const std::uint8_t> bytes);

}  // namespace docent::content
