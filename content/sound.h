// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

// Sound files: WAV, FLAC and Ogg, read with libsndfile. Pure functions; thread-safe. Each, and SoundReader,
// throws Error, which names the file, when the bytes are no such file or exceed the limits.
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

// Decodes a sound piece by piece, so that a long one begins at once. One thread at a time.
class SoundReader {
 public:
  // Reads the header. The bytes must outlive this.
  SoundReader(const std::string& file, std::span<const std::uint8_t> bytes);
  ~SoundReader();
  SoundReader(SoundReader&& other) noexcept;
  SoundReader& operator=(SoundReader&& other) noexcept;

  const SoundFormat& format() const;
  // Appends the next samples, at most so many of each channel, and returns how many that are: 0 at the end.
  // Throws Error when the file ends too early.
  std::uint64_t Read(std::uint64_t frames, std::vector<std::int16_t>* samples);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Whether the bytes begin like such a file.
bool IsSoundFile(std::span<const std::uint8_t> bytes);
// Reads the header only.
SoundFormat ReadSoundFormat(const std::string& file, std::span<const std::uint8_t> bytes);
// Also refuses a file that ends too early. Takes about a second for the longest sound.
SoundSamples DecodeSound(const std::string& file, std::span<const std::uint8_t> bytes);

}  // namespace docent::content
