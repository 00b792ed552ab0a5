// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "app/command_line/frame_slot.h"
#include "app/command_line/notices.h"
#include "app/command_line/run_guide.h"
#include "app/evaluation/camera_report.h"
#include "app/script/commands.h"
#include "content/scene.h"
#include "ui/authoring_actions.h"

namespace docent::app {

// What the window needs from the run. Thread-safe.
struct WindowLink {
  std::span<CommandInbox> inboxes;  // By camera.
  NoticeQueue* notices = nullptr;   // Never null.
  std::function<SavingState()> saving;
  std::function<std::vector<ui::MapFacts>()> maps;
  // The content of a map as it is now, also while no camera is tracked in it; null if it is not in memory.
  std::function<std::shared_ptr<const content::Scene>(std::uint64_t map_key)> scene_of;
  // From now on nothing is saved.
  std::function<void()> discard_changes;
  // Pauses recordings, or lets them go on.
  std::function<void()> toggle_pause;
  // Plays recordings as fast as they can be tracked, or by their times again.
  std::function<void()> toggle_fast_forward;
  // On a tour: carries out a step of the visitor at once, also while an image is tracked, and returns the
  // last frame of this camera with what has changed; null before the first frame and after the last one.
  std::function<std::shared_ptr<const ShownFrame>(std::size_t, const GuideVisitor&)> lead;
  // On a tour: called when a button or a key is pressed or released, whatever that does.
  std::function<void()> used;
  // Called with what has changed in drawing because of the machine's load, for the log.
  std::function<void(const std::string&)> adapted;
  // Called with each frame that the window shows, at the end of each stage but tracking.
  std::function<void(FrameStage, const ShownFrame&)> reached;
};

// Shows frames in a window until the frames end or the person closes it. The author's window puts commands
// into the inbox of the camera that is shown large; ui/strings.h lists its keys. With two cameras, the first
// is shown large and the other small; a click on the small image swaps them. Main thread only, as GLFW
// requires. Throws Error when there is no display.
//
// VisitorControls has the keys of a tour.
void ShowInWindow(const GuideRequest& request, std::span<const CalibratedCamera> cameras, FrameSlot* slot,
                  const WindowLink& link);

}  // namespace docent::app
