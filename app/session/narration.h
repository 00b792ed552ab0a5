// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/session/visitor_strings.h"
#include "app/session/way_on.h"
#include "content/scene.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "ui/renderer.h"

namespace docent::app {

// A text of the content that a visitor can read in an image.
struct ReadableSign {
  std::string entity;  // Its name.
  std::string text;    // In the visitor's language.
};

// The texts of signposts and labels that are in view and large enough to be read, by name. Pure; any thread.
std::vector<ReadableSign> SignsInView(const content::Scene& scene, const engine::CameraModel& camera,
                                      const engine::Rigid3& camera_from_map, const std::string& language);

// Decides what is spoken to a visitor who cannot see the screen: the place on arrival, what to do, how far
// the tour has come, the way on, the texts in view, and the pages of cards. What changes from image to image
// is spoken only once it has stayed for a while, and nothing is repeated while it stays. Times are seconds
// that do not decrease. One thread.
class Narration {
 public:
  // `strings` is one of the constants behind VisitorStringsFor.
  explicit Narration(const VisitorStrings& strings) : strings_(strings) {}

  // What a visitor sees in an image.
  struct Seen {
    double seconds = 0;
    const ui::VisitorDisplay* display = nullptr;  // Not null.
    const ShownWay* way = nullptr;                // Null for none.
    std::vector<ReadableSign> signs;
  };
  // The texts to be spoken now, in their order; mostly none.
  std::vector<std::string> Update(const Seen& seen);

 private:
  // A text that is spoken once it has stayed for a while.
  struct Settling {
    std::string text, spoken;
    double since_s = 0, spoken_s = -1e9;
    // Whether the text is to be spoken at this time.
    bool Settle(const std::string& now, double seconds, double stay_s, double repeat_s);
  };
  std::string WayText(const ShownWay& way) const;

  const VisitorStrings& strings_;
  std::string place_;
  std::string card_;  // The page that is open; empty for none.
  Settling sentence_, route_, way_;
  std::set<std::string> read_;  // The signs at this place that were spoken, by name.
  std::string sign_;            // The sign in view that is next, by name, and since when.
  double sign_since_s_ = 0;
};

}  // namespace docent::app
