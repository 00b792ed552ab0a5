// SPDX-License-Identifier: Apache-2.0
#include "app/sound/sound_device.h"

#include <array>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "engine/base/error.h"

#ifdef DOCENT_HAS_OPENAL
#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>
#endif

namespace docent::app {

#ifdef DOCENT_HAS_OPENAL

namespace {

// The first piece is short, so that a sound begins at once. The others last for longer than the longest pause
// between two updates on a slow machine.
constexpr double kFirstPiece_s = 0.1, kPiece_s = 0.75;
constexpr std::size_t kPieces = 4;

}  // namespace

struct SoundDevice::Impl {
  // A sound whose next pieces wait in the device.
  struct Playing {
    explicit Playing(std::shared_ptr<const content::Asset> played)
        : file(std::move(played)), reader(file->name, file->bytes) {}

    std::shared_ptr<const content::Asset> file;  // The reader reads from it.
    content::SoundReader reader;
    ALuint source = 0;
    std::array<ALuint, kPieces> buffers = {};
    std::vector<ALuint> unused;  // Of the buffers.
    bool is_read = false;        // To its end.
  };

  static void Remove(const Playing& ended) {
    alSourceStop(ended.source);
    alDeleteSources(1, &ended.source);
    alDeleteBuffers(static_cast<ALsizei>(kPieces), ended.buffers.data());
  }
  // Gives the device one more piece.
  void Queue(double seconds, Playing* sound) {
    const content::SoundFormat& format = sound->reader.format();
    samples.clear();
    const auto frames = static_cast<std::uint64_t>(seconds * format.rate);
    if (sound->reader.Read(frames, &samples) == 0) {
      sound->is_read = true;
      return;
    }
    const ALuint buffer = sound->unused.back();
    sound->unused.pop_back();
    alBufferData(buffer, format.channels == 2 ? AL_FORMAT_STEREO16 : AL_FORMAT_MONO16, samples.data(),
                 static_cast<ALsizei>(samples.size() * sizeof(std::int16_t)), format.rate);
    alSourceQueueBuffers(sound->source, 1, &buffer);
  }
  // Takes back the pieces that were heard, and gives new ones. False when the sound has ended.
  bool Refill(Playing* sound) {
    ALint state = AL_PLAYING, heard = 0;
    alGetSourcei(sound->source, AL_SOURCE_STATE, &state);
    for (alGetSourcei(sound->source, AL_BUFFERS_PROCESSED, &heard); heard > 0; --heard) {
      ALuint buffer = 0;
      alSourceUnqueueBuffers(sound->source, 1, &buffer);
      sound->unused.push_back(buffer);
    }
    while (!sound->is_read && !sound->unused.empty()) Queue(kPiece_s, sound);
    if (sound->unused.size() == kPieces) return false;
    // All pieces were heard before new ones came.
    if (state != AL_PLAYING) alSourcePlay(sound->source);
    return true;
  }

  ALCdevice* device = nullptr;
  ALCcontext* context = nullptr;
  std::map<SoundDirector::Key, Playing> playing;
  std::vector<std::int16_t> samples;
};

SoundDevice::SoundDevice() : impl_(std::make_unique<Impl>()) {
  impl_->device = alcOpenDevice(nullptr);
  if (impl_->device == nullptr) throw Error("there is no sound device");
  impl_->context = alcCreateContext(impl_->device, nullptr);
  if (impl_->context == nullptr || alcMakeContextCurrent(impl_->context) == ALC_FALSE) {
    if (impl_->context != nullptr) alcDestroyContext(impl_->context);
    alcCloseDevice(impl_->device);
    throw Error("the sound device cannot be used");
  }
}

SoundDevice::~SoundDevice() {
  for (const auto& [key, playing] : impl_->playing) impl_->Remove(playing);
  alcMakeContextCurrent(nullptr);
  alcDestroyContext(impl_->context);
  alcCloseDevice(impl_->device);
}

void SoundDevice::Start(const SoundDirector::Key& key, const std::shared_ptr<const content::Asset>& file) {
  Stop(key);
  Impl::Playing playing(file);
  alGetError();  // Forgets an earlier one.
  alGenBuffers(static_cast<ALsizei>(kPieces), playing.buffers.data());
  alGenSources(1, &playing.source);
  playing.unused.assign(playing.buffers.begin(), playing.buffers.end());
  try {
    impl_->Queue(kFirstPiece_s, &playing);
    alSourcePlay(playing.source);
    impl_->Refill(&playing);
    if (alGetError() != AL_NO_ERROR) throw Error("the sound device does not play a sound");
  } catch (const Error&) {
    Impl::Remove(playing);
    throw;
  }
  impl_->playing.emplace(key, std::move(playing));
}

void SoundDevice::Stop(const SoundDirector::Key& key) {
  const auto found = impl_->playing.find(key);
  if (found == impl_->playing.end()) return;
  impl_->Remove(found->second);
  impl_->playing.erase(found);
}

void SoundDevice::Update() {
  for (auto sound = impl_->playing.begin(); sound != impl_->playing.end();) {
    bool goes_on = false;
    try {
      goes_on = impl_->Refill(&sound->second);
    } catch (const Error&) {
      Impl::Remove(sound->second);
      impl_->playing.erase(sound);
      throw;
    }
    if (!goes_on) Impl::Remove(sound->second);
    sound = goes_on ? std::next(sound) : impl_->playing.erase(sound);
  }
}

bool SoundDevice::is_playing() const {
  return !impl_->playing.empty();
}

bool SoundDevice::is_connected() const {
  if (alcIsExtensionPresent(impl_->device, "ALC_EXT_disconnect") == ALC_FALSE) return true;
  ALCint connected = ALC_TRUE;
  alcGetIntegerv(impl_->device, ALC_CONNECTED, 1, &connected);
  return connected != ALC_FALSE;
}

#else

struct SoundDevice::Impl {};

SoundDevice::SoundDevice() {
  throw Error("this program was built without OpenAL");
}
SoundDevice::~SoundDevice() = default;
void SoundDevice::Start(const SoundDirector::Key&, const std::shared_ptr<const content::Asset>&) {}
void SoundDevice::Stop(const SoundDirector::Key&) {}
void SoundDevice::Update() {}
bool SoundDevice::is_playing() const {
  return false;
}
bool SoundDevice::is_connected() const {
  return false;
}

#endif

}  // namespace docent::app
