// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_cards.h"

#include <algorithm>
#include <utility>

#include "content/cards.h"
#include "engine/base/error.h"
#include "ui/card_targets.h"

namespace docent::app {

namespace {

// Beside a thing, in widths of the image: a gaze is steady to about a degree and a half.
constexpr double kGazeMargin = 0.025;

std::size_t CharactersOf(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0u) != 0x80u; }));
}

}  // namespace

void VisitorCards::Update(const engine::CameraModel& camera, ShownFrame* frame) {
  seconds_ = frame->seconds;
  ui::VisitorDisplay& display = *frame->visitor;
  has_pose_ = engine::HasPose(frame->tracked.state);
  targets_.clear();
  if (has_pose_ && frame->shown.scene) {
    if (frame->tracked.map_key != map_key_) marked_.clear();
    map_key_ = frame->tracked.map_key;
    scene_ = frame->shown.scene;
    targets_ = ui::FindCardTargets(*scene_, camera, frame->tracked.camera_from_map, &shapes_);
    shapes_.EndFrame();
  }
  if (by_gaze_) Look(camera, &display);
  if (by_gaze_ && open_) ReadOn();
  display.targets = targets_;
  Mark(&display);
  if (!open_) return;
  ui::Card& card = display.card.emplace();
  card.entity = open_->entity;
  card.text = open_->pages[open_->page];
  card.hint = HintFor(*open_);
  card.shown = open_->shown;
  card.seconds = std::max(0.0, seconds_ - open_->since_s);
}

void VisitorCards::Mark(ui::VisitorDisplay* display) {
  const auto chosen = std::find_if(targets_.begin(), targets_.end(),
                                   [this](const ui::CardTarget& target) { return target.entity == marked_; });
  if (chosen == targets_.end()) {
    // A choice holds as long as the thing is in view.
    if (has_pose_) marked_.clear();
    if (!targets_.empty()) display->marked = 0;
  } else {
    display->marked = static_cast<std::size_t>(chosen - targets_.begin());
  }
  const double passed_s = seconds_ - std::exchange(hint_last_s_, seconds_).value_or(seconds_);
  if (!display->marked || open_ || has_opened_ || hinted_s_ >= times_.hint || !display->sentence.empty())
    return;
  hinted_s_ += passed_s;
  display->sentence = by_gaze_ ? strings_.look_to_open : strings_.open_a_card;
}

std::string VisitorCards::HintFor(const Open& open) const {
  if (open.page + 1 == open.pages.size()) return by_gaze_ ? strings_.look_away : strings_.close_card;
  return Filled(strings_, by_gaze_ ? strings_.pages_turn : strings_.more_pages,
                {std::to_string(open.page + 1), std::to_string(open.pages.size())});
}

void VisitorCards::Look(const engine::CameraModel& camera, ui::VisitorDisplay* display) {
  const Eigen::Vector2d middle(0.5 * (camera.width_px() - 1), 0.5 * (camera.height_px() - 1));
  const ui::CardTarget* const target = ui::TargetAt(targets_, middle, kGazeMargin * camera.width_px());
  const std::string now = target != nullptr ? target->entity : std::string();
  if (now != looked_at_) {
    looked_at_ = now;
    looked_since_s_ = seconds_;
  }
  if (now != left_) left_.clear();
  const double looked_s = seconds_ - looked_since_s_;
  display->dwell = 0;
  if (open_) {
    // A visitor who is lost may still look at it.
    if (!has_pose_) looked_since_s_ = seconds_;
    if (looked_at_ != open_->entity && has_pose_ && looked_s >= times_.leave) open_.reset();
    return;
  }
  if (looked_at_.empty() || looked_at_ == left_) return;
  display->dwell = std::min(1.0, looked_s / times_.dwell);
  if (looked_s >= times_.dwell) OpenCard(looked_at_);
}

void VisitorCards::ReadOn() {
  const double reading_s =
      times_.turn + static_cast<double>(CharactersOf(open_->pages[open_->page])) / times_.characters_per_s;
  if (open_->page + 1 < open_->pages.size() && seconds_ - open_->page_since_s >= reading_s) TurnPage();
}

void VisitorCards::OpenCard(const std::string& name) {
  const content::Entity* const entity = scene_ ? scene_->Find(name) : nullptr;
  if (entity == nullptr || !content::HasCard(*entity)) throw Error(strings_.nothing_to_open);
  const content::Card card = content::CardOf(*scene_, *entity, language_);
  Open& open = open_.emplace(Open());
  open.entity = name;
  if (card.shown != nullptr) open.shown = std::shared_ptr<const content::Entity>(scene_, card.shown);
  open.pages = content::PagesOf(card.text, times_.page_characters);
  open.since_s = open.page_since_s = seconds_;
  has_opened_ = true;
  opened_.push_back({name, map_key_, card.sounds});
}

void VisitorCards::TurnPage() {
  if (++open_->page == open_->pages.size()) {
    open_.reset();
    return;
  }
  open_->page_since_s = seconds_;
}

bool VisitorCards::Do(const GuideVisitor& guide) {
  switch (guide.step) {
    case GuideVisitor::Step::kSkip:
    case GuideVisitor::Step::kBack:
    case GuideVisitor::Step::kRestart:
    case GuideVisitor::Step::kContinue:
      return false;
    case GuideVisitor::Step::kOpen:
      OpenCard(guide.name);
      return true;
    case GuideVisitor::Step::kClose:
      if (open_) left_ = open_->entity;
      open_.reset();
      return true;
    case GuideVisitor::Step::kPress: {
      if (open_) {
        const std::string entity = open_->entity;
        TurnPage();
        if (!open_) left_ = entity;
        return true;
      }
      if (targets_.empty()) throw Error(strings_.nothing_to_open);
      const bool in_view = std::any_of(targets_.begin(), targets_.end(),
                                       [this](const auto& target) { return target.entity == marked_; });
      OpenCard(in_view ? marked_ : targets_.front().entity);
      return true;
    }
    case GuideVisitor::Step::kMark: {
      if (targets_.empty()) throw Error(strings_.nothing_to_open);
      // The order in the scene, which does not change while the camera moves.
      std::vector<std::string> names;
      for (const content::Entity& entity : scene_->entities) {
        if (std::any_of(targets_.begin(), targets_.end(),
                        [&](const auto& target) { return target.entity == entity.name; }))
          names.push_back(entity.name);
      }
      const std::string now = marked_.empty() ? targets_.front().entity : marked_;
      const auto at = std::find(names.begin(), names.end(), now);
      marked_ = at == names.end() || at + 1 == names.end() ? names.front() : *(at + 1);
      return true;
    }
  }
  return false;
}

}  // namespace docent::app
