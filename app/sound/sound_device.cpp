// SPDX-License-Identifier: Apache-2.0
#include "app/sound/sound_device.h"

#include "engine/base/error.h"

#ifdef DOCENT_HAS_OPENAL
#include <AL/al.h>
#include <AL/alc.h>
#endif

namespace docent::app {

#ifdef DOCENT_HAS_OPENAL

struct SoundDevice::Impl {
  struct Playing {
    ALuint source = 0, buffer = 0;
  };

  void Remove(const Playing& ended) {
    alSourceStop(ended.source);
    alDeleteSources(1, &ended.source);
    alDeleteBuffers(1, &ended.buffer);
  }

  ALCdevice* device = nullptr;
  ALCcontext* context = nullptr;
  std::map<SoundDirector::Key, Playing> playing;
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

void SoundDevice::Start(const SoundDirector::Key& key, const content::SoundSamples& sound) {
  Stop(key);
  alGetError();  // Forgets an earlier one.
  Impl::Playing playing;
  alGenBuffers(1, &playing.buffer);
  alGenSources(1, &playing.source);
  alBufferData(playing.buffer, sound.format.channels == 2 ? AL_FORMAT_STEREO16 : AL_FORMAT_MONO16,
               sound.samples.data(), static_cast<ALsizei>(sound.samples.size() * sizeof(std::int16_t)),
               sound.format.rate);
  alSourcei(playing.source, AL_BUFFER, static_cast<ALint>(playing.buffer));
  alSourcePlay(playing.source);
  if (alGetError() != AL_NO_ERROR) {
    impl_->Remove(playing);
    throw Error("the sound device does not play a sound");
  }
  impl_->playing.emplace(key, playing);
}

void SoundDevice::Stop(const SoundDirector::Key& key) {
  const auto found = impl_->playing.find(key);
  if (found == impl_->playing.end()) return;
  impl_->Remove(found->second);
  impl_->playing.erase(found);
}

void SoundDevice::RemoveEnded() {
  std::erase_if(impl_->playing, [this](const auto& sound) {
    ALint state = AL_STOPPED;
    alGetSourcei(sound.second.source, AL_SOURCE_STATE, &state);
    if (state == AL_PLAYING) return false;
    impl_->Remove(sound.second);
    return true;
  });
}

#else

struct SoundDevice::Impl {};

SoundDevice::SoundDevice() {
  throw Error("this program was built without OpenAL");
}
SoundDevice::~SoundDevice() = default;
void SoundDevice::Start(const SoundDirector::Key&, const content::SoundSamples&) {}
void SoundDevice::Stop(const SoundDirector::Key&) {}
void SoundDevice::RemoveEnded() {}

#endif

}  // namespace docent::app
