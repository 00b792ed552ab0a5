// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/command_line/run_guide.h"
#include "app/output/run_output.h"
#include "app/session/guided_view.h"
#include "app/sound/sound_director.h"
#include "app/sound/sound_player.h"

namespace docent::app {

// The sounds of one run: which ones the frames of the first camera start, and when they are heard. In a
// tour's window a sound is heard together with the image that starts it, which a slow machine draws later.
// One thread at a time.
class RunSounds {
 public:
  explicit RunSounds(const GuideRequest& request);

  // Starts and stops sounds for a frame of the first camera, and sets its caption. asked: what its visitor
  // asks for; see SoundDirector::Ask. Returns the events of this.
  std::vector<Event> Add(ShownFrame* frame, std::span<const SoundDirector::Key> asked = {});
  // The first camera's image with this index, or a later one, is on the screen.
  void HandleShown(std::uint64_t index);
  // Why something is not heard, as a sentence, once; empty otherwise.
  std::string TakeProblem();

 private:
  const bool waits_for_screen_;
  SoundDirector director_;
  int visitors_before_ = 0;            // See ShownFrame.
  std::optional<SoundPlayer> player_;  // Only if sounds are to be heard.
  // What is to be heard with an image that is not on the screen yet, with the image's index.
  std::deque<std::pair<std::uint64_t, SoundDirector::Orders>> undrawn_;
};

}  // namespace docent::app
