// SPDX-License-Identifier: Apache-2.0
#include "content/sound.h"

#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <memory>
#include <string_view>

#include "content/gltf/json.h"

namespace docent::content {

// A file in memory, as libsndfile reads it.
struct SoundBytes {
  std::span<const std::uint8_t> bytes;
  sf_count_t position = 0;

  sf_count_t size() const { return static_cast<sf_count_t>(bytes.size()); }
};

struct CloseSound {
  void operator()(SNDFILE* file) const { sf_close(file); }
};
using SoundFile = std::unique_ptr<SNDFILE, CloseSound>;

namespace {

sf_count_t SoundLength(void* user) {
  return static_cast<SoundBytes*>(user)->size();
}

sf_count_t SeekSound(sf_count_t offset, int whence, void* user) {
  auto* const file = static_cast<SoundBytes*>(user);
  const sf_count_t from = whence == SEEK_CUR ? file->position : whence == SEEK_END ? file->size() : 0;
  file->position = std::clamp<sf_count_t>(from + offset, 0, file->size());
  return file->position;
}

sf_count_t ReadSoundBytes(void* target, sf_count_t count, void* user) {
  auto* const file = static_cast<SoundBytes*>(user);
  const sf_count_t length = std::clamp<sf_count_t>(count, 0, file->size() - file->position);
  if (length > 0) std::memcpy(target, file->bytes.data() + file->position, static_cast<std::size_t>(length));
  file->position += length;
  return length;
}

sf_count_t WriteNoSoundBytes(const void* /*source*/, sf_count_t /*count*/, void* /*user*/) {
  return 0;
}

sf_count_t SoundPosition(void* user) {
  return static_cast<SoundBytes*>(user)->position;
}

// Opens the file and checks its format.
SoundFile OpenSound(const std::string& name, SoundBytes* bytes, SoundFormat* format) {
  if (bytes->bytes.size() > kMaxSoundFileBytes)
    Refuse(name, "", "the sound has more than " + std::to_string(kMaxSoundFileBytes >> 20) + " MiB.");
  if (!IsSoundFile(bytes->bytes)) Refuse(name, "", "is not a WAV, FLAC or Ogg sound file.");
  SF_VIRTUAL_IO reading{SoundLength, SeekSound, ReadSoundBytes, WriteNoSoundBytes, SoundPosition};
  SF_INFO info{};
  SoundFile file(sf_open_virtual(&reading, SFM_READ, &info, bytes));
  if (!file) Refuse(name, "", "is a damaged sound.");
  if (info.channels < 1 || info.channels > 2)
    Refuse(name, "", "the sound has " + std::to_string(info.channels) + " channels; it may have 1 or 2.");
  if (info.samplerate < kMinSoundRate || info.samplerate > kMaxSoundRate)
    Refuse(name, "", "the sound has a rate that is not between 8000 and 192000 samples per second.");
  if (info.frames < 1) Refuse(name, "", "the sound is empty.");
  *format = {info.channels, info.samplerate, static_cast<std::uint64_t>(info.frames)};
  if (format->seconds() > kMaxSoundSeconds ||
      format->frames > kMaxSoundSamples / static_cast<std::uint64_t>(info.channels)) {
    Refuse(name, "",
           "the sound is longer than " + std::to_string(static_cast<int>(kMaxSoundSeconds) / 60) +
               " minutes or has more than " + std::to_string(kMaxSoundSamples) + " samples.");
  }
  return file;
}

// A sample in the range of -1 to 1 at 16 bits. One that libsndfile made of 16 bits, by dividing by 32768,
// becomes exactly what it was. Files of floating-point numbers may have others: they are clipped, and what is
// no number is silence.
std::int16_t SampleAt16Bits(float sample) {
  constexpr float kScale = 32'768, kLeast = -32'768, kMost = 32'767;
  if (std::isnan(sample)) return 0;
  return static_cast<std::int16_t>(std::lrint(std::clamp(kScale * sample, kLeast, kMost)));
}

}  // namespace

bool IsSoundFile(std::span<const std::uint8_t> bytes) {
  const std::string_view begin(reinterpret_cast<const char*>(bytes.data()),
                               std::min<std::size_t>(bytes.size(), 12));
  const bool is_wave = begin.size() == 12 && begin.starts_with("RIFF") && begin.ends_with("WAVE");
  return is_wave || begin.starts_with("fLaC") || begin.starts_with("OggS");
}

SoundFormat ReadSoundFormat(const std::string& file, std::span<const std::uint8_t> bytes) {
  SoundBytes source{bytes};
  SoundFormat format;
  OpenSound(file, &source, &format);
  return format;
}

struct SoundReader::Impl {
  std::string name;
  SoundBytes source;
  SoundFormat format;
  SoundFile file;
  std::uint64_t done = 0;      // Frames.
  std::vector<float> samples;  // Those that were read last.
};

SoundReader::SoundReader(const std::string& file, std::span<const std::uint8_t> bytes)
    : impl_(std::make_unique<Impl>()) {
  impl_->name = file;
  impl_->source.bytes = bytes;
  impl_->file = OpenSound(file, &impl_->source, &impl_->format);
}

SoundReader::~SoundReader() = default;
SoundReader::SoundReader(SoundReader&& other) noexcept = default;
SoundReader& SoundReader::operator=(SoundReader&& other) noexcept = default;

const SoundFormat& SoundReader::format() const {
  return impl_->format;
}

std::uint64_t SoundReader::Read(std::uint64_t frames, std::vector<std::int16_t>* samples) {
  const std::uint64_t wanted = std::min(frames, impl_->format.frames - impl_->done);
  if (wanted == 0) return 0;
  const auto channels = static_cast<std::uint64_t>(impl_->format.channels);
  // libsndfile does not scale files of floating-point numbers when it is asked for integers.
  constexpr std::uint64_t kFramesAtOnce = 16'384;
  std::vector<float>& piece = impl_->samples;
  for (std::uint64_t left = wanted; left > 0;) {
    const std::uint64_t count = std::min(left, kFramesAtOnce);
    piece.resize(count * channels);
    const sf_count_t read = sf_readf_float(impl_->file.get(), piece.data(), static_cast<sf_count_t>(count));
    if (read != static_cast<sf_count_t>(count)) Refuse(impl_->name, "", "the sound ends too early.");
    std::transform(piece.begin(), piece.end(), std::back_inserter(*samples), SampleAt16Bits);
    left -= count;
  }
  impl_->done += wanted;
  return wanted;
}

SoundSamples DecodeSound(const std::string& file, std::span<const std::uint8_t> bytes) {
  SoundReader reader(file, bytes);
  SoundSamples sound;
  sound.format = reader.format();
  // The header may promise more than the file has, so that memory is taken as samples come.
  constexpr std::uint64_t kFramesAtOnce = 65'536;
  while (reader.Read(kFramesAtOnce, &sound.samples) > 0) {
  }
  return sound;
}

}  // namespace docent::content
