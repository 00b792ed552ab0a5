// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/script/commands.h"
#include "app/session/guided_view.h"
#include "app/session/visitor_strings.h"
#include "ui/entity_shapes.h"

namespace docent::app {

// Times and lengths of cards. They are design choices, each for the reason given.
struct CardTimes {
  double dwell = 1.5;  // Looked at for this long, an entity's card opens: most glances are shorter.
  double leave = 2;    // A card that was opened by gaze closes when one has looked elsewhere for this long.
  // Pages turn by themselves for visitors without free hands: at 15 characters a second, which subtitles are
  // limited to, and this long for the change.
  double characters_per_s = 15, turn = 2;
  double hint = 10;  // How cards are opened is said for this long in all, while something can be opened.
  std::size_t page_characters = 300;  // Fits at normal size on a display of 800x480 pixels.
};

// The cards of one visitor: what can be opened in view, what is marked for the one button or looked at, and
// the card that is open. Times are those of the images and do not decrease. One thread.
class VisitorCards {
 public:
  // `strings` is one of the constants behind VisitorStringsFor; `language` chooses the texts of the content.
  // `by_gaze`: what stays in the middle of the image opens by itself.
  VisitorCards(const VisitorStrings& strings, std::string language, bool by_gaze, const CardTimes& times = {})
      : strings_(strings), language_(std::move(language)), by_gaze_(by_gaze), times_(times) {}

  // Adds targets, mark and card to frame->visitor, which must be there. A card stays while the camera is
  // lost.
  void Update(const engine::CameraModel& camera, ShownFrame* frame);
  // Carries out a step of cards; false for any other step. Throws Error, with a sentence in the visitor's
  // language, when there is nothing to open.
  bool Do(const GuideVisitor& guide);

  // What was opened since the last call, in order: the name of the entity, its map and the sounds of its
  // card.
  struct Opened {
    std::string entity;
    std::uint64_t map_key = 0;
    std::vector<std::string> sounds;
  };
  std::vector<Opened> TakeOpened() { return std::exchange(opened_, {}); }

 private:
  struct Open {
    std::string entity;
    std::shared_ptr<const content::Entity> shown;
    std::vector<std::string> pages;
    std::size_t page = 0;
    double since_s = 0, page_since_s = 0;
  };
  void OpenCard(const std::string& name);
  void TurnPage();
  void Look(const engine::CameraModel& camera, ui::VisitorDisplay* display);
  // With gaze alone, while a card is open.
  void ReadOn();
  void Mark(ui::VisitorDisplay* display);
  std::string HintFor(const Open& open) const;

  const VisitorStrings& strings_;
  const std::string language_;
  const bool by_gaze_;
  const CardTimes times_;
  ui::EntityShapes shapes_;
  double seconds_ = 0;
  bool has_pose_ = false;
  // Those of the last frame; the scene is that of the last pose.
  std::vector<ui::CardTarget> targets_;
  std::shared_ptr<const content::Scene> scene_;
  std::uint64_t map_key_ = 0;
  std::string marked_;  // Chosen by the visitor; empty for the nearest to the middle.
  std::optional<Open> open_;
  std::string looked_at_;  // Since looked_since_s_; empty for nothing.
  double looked_since_s_ = 0;
  std::string left_;  // What was closed by gaze, until one looks elsewhere.
  std::optional<double> hint_last_s_;
  double hinted_s_ = 0;  // For how long how cards are opened was said.
  bool has_opened_ = false;
  std::vector<Opened> opened_;
};

}  // namespace docent::app
