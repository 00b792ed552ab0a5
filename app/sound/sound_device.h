// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "app/sound/sound_director.h"
#include "content/sound.h"

namespace docent::app {

// The loudspeakers, as SoundPlayer uses them. One thread.
class SoundDevice {
 public:
  // Opens the default device. Throws Error when there is none, or the program was built without OpenAL.
  SoundDevice();
  // Stops all sounds.
  ~SoundDevice();
  SoundDevice(const SoundDevice&) = delete;
  SoundDevice& operator=(const SoundDevice&) = delete;

  // Throws Error when the device does not take the samples.
  void Start(const SoundDirector::Key& key, const content::SoundSamples& sound);
  // Nothing happens if it does not play.
  void Stop(const SoundDirector::Key& key);
  // Forgets sounds that have ended.
  void RemoveEnded();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::app
