// SPDX-License-Identifier: Apache-2.0
#include "app/session/narration.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace docent::app {

namespace {

// Design choices, in seconds. A sentence flickers while a camera is nearly recognized; a way turns with the
// head.
constexpr double kSentenceStays = 1, kSentenceAgain = 15, kWayStays = 2, kWayAgain = 20, kSignStays = 1.5;
// A letter is legible from an angle of 0.3 to 0.4 degrees on (ISO 9241-303 recommends 20 to 22 minutes of
// arc).
constexpr double kLegible_deg = 0.4;

// The boards of a signpost and a label: their middle, and the height of a letter. Empty for other kinds.
std::optional<std::pair<Eigen::Vector3d, double>> BoardOf(const content::Entity& entity) {
  // A signpost's board holds about three lines.
  if (entity.kind == content::Entity::Kind::kSignpost)
    return std::pair(content::BoardMiddle(entity.signpost), entity.signpost.height / 3);
  if (entity.kind == content::Entity::Kind::kLabel)
    return std::pair(Eigen::Vector3d(entity.label.anchor + entity.label.offset), entity.label.text_height);
  return std::nullopt;
}

}  // namespace

std::vector<ReadableSign> SignsInView(const content::Scene& scene, const engine::CameraModel& camera,
                                      const engine::Rigid3& camera_from_map, const std::string& language) {
  std::vector<ReadableSign> signs;
  for (const content::Entity& entity : scene.entities) {
    const auto board = BoardOf(entity);
    if (!board || entity.hidden) continue;
    const Eigen::Vector3d middle = camera_from_map * board->first;
    const auto pixel = camera.Project(middle);
    if (!pixel || !camera.IsInside(*pixel)) continue;
    const double angle_deg = std::atan2(board->second, middle.norm()) * 180 / std::numbers::pi;
    if (angle_deg < kLegible_deg) continue;
    signs.push_back({entity.name, content::ShownText(entity, language)});
  }
  std::sort(signs.begin(), signs.end(), [](const auto& a, const auto& b) { return a.entity < b.entity; });
  return signs;
}

bool Narration::Settling::Settle(const std::string& now, double seconds, double stay_s, double repeat_s) {
  if (now != text) {
    text = now;
    since_s = seconds;
  }
  if (text.empty() || seconds - since_s < stay_s) return false;
  if (text == spoken && (since_s <= spoken_s || seconds - spoken_s < repeat_s)) return false;
  spoken = text;
  spoken_s = seconds;
  return true;
}

// The quarter of the horizontal circle that the way lies in, seen from the camera.
std::string Narration::WayText(const ShownWay& way) const {
  const double angle = std::atan2(way.towards.x(), way.towards.z());
  const char* pattern = strings_.behind;
  if (std::abs(angle) < std::numbers::pi / 4) {
    pattern = strings_.ahead;
  } else if (std::abs(angle) < 3 * std::numbers::pi / 4) {
    pattern = angle < 0 ? strings_.at_left : strings_.at_right;
  }
  return Filled(strings_, pattern, {way.drawn.text});
}

std::vector<std::string> Narration::Update(const Seen& seen) {
  std::vector<std::string> texts;
  const ui::VisitorDisplay& display = *seen.display;
  if (display.place != place_ && !display.place.empty()) {
    place_ = display.place;
    read_.clear();
    texts.push_back(place_);
  }
  if (display.card && !display.card->text.empty() && display.card->text != card_)
    texts.push_back(display.card->text);
  card_ = display.card ? display.card->text : std::string();
  // The end of a tour stands in both places.
  const std::string sentence = display.sentence == display.route_line ? std::string() : display.sentence;
  if (sentence_.Settle(sentence, seen.seconds, kSentenceStays, kSentenceAgain)) texts.push_back(sentence);
  if (route_.Settle(display.route_line, seen.seconds, kSentenceStays, kSentenceAgain))
    texts.push_back(display.route_line);
  const std::string way = seen.way != nullptr ? WayText(*seen.way) : std::string();
  if (way_.Settle(way, seen.seconds, kWayStays, kWayAgain)) texts.push_back(way);
  const auto next = std::find_if(seen.signs.begin(), seen.signs.end(),
                                 [this](const ReadableSign& sign) { return !read_.contains(sign.entity); });
  if (next == seen.signs.end()) {
    sign_.clear();
  } else if (next->entity != sign_) {
    sign_ = next->entity;
    sign_since_s_ = seen.seconds;
  } else if (seen.seconds - sign_since_s_ >= kSignStays) {
    if (!next->text.empty()) texts.push_back(next->text);
    read_.insert(sign_);
    sign_.clear();
  }
  return texts;
}

}  // namespace docent::app
