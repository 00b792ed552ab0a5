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

  // Plays a sound file, which is decoded shortly before it is heard. Throws Error when the file is damaged,
  // or the device does not take its samples.
  void Start(const SoundDirector::Key& key, const std::shared_ptr<const content::Asset>& file);
  // Nothing happens if it does not play.
  void Stop(const SoundDirector::Key& key);
  // Decodes what is heard next, and forgets sounds that have ended. Is to be called at least once a second.
  // Throws Error when a file turns out to be damaged; its sound ends.
  void Update();
  bool is_playing() const;
  // False once the system has taken the device away, as when its sound server ends; nothing more is heard.
  bool is_connected() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::app
