// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/command_words.h"

#include <filesystem>

#include "content/occluder.h"
#include "ui/strings.h"

namespace docent::app {

namespace {

std::string NamesText(const std::vector<std::string>& names) {
  if (names.size() == 1) return names.front();
  return std::to_string(names.size()) + " objects";
}

struct DoneWriter {
  std::string operator()(const NewMap& c) const { return "Started the map " + c.name + "."; }
  std::string operator()(const StopMap&) const { return "Stopped the map."; }
  std::string operator()(const UseMap& c) const { return "Continued the map " + c.name + "."; }
  std::string operator()(const SetPolicy& c) const {
    if (c.policy == maps::Policy::kOpen) return "All changes to the map " + c.name + " are now allowed.";
    return "Changes to the map " + c.name +
           " are now limited to: " + ui::strings::PolicyLabel(maps::ToString(c.policy)) + ".";
  }
  std::string operator()(const RenameMap& c) const {
    return "Renamed the map " + c.name + " to " + c.new_name + ".";
  }
  std::string operator()(const RemoveMap& c) const { return "Removed the map " + c.name + "."; }
  std::string operator()(const JoinMap& c) const { return "Comparing the map " + c.name + " with this one…"; }
  std::string operator()(const SetMapUp& c) const {
    return c.pixel ? "This surface is now the ground of the map."
                   : "The up direction is now estimated from how the camera was held.";
  }
  std::string operator()(const SetMapScale& c) const {
    return c.length_m > 0 ? "The map now has a scale: models are placed at their true size."
                          : "The map now has no scale.";
  }
  std::string operator()(const SetMapEntrance& c) const {
    return c.here ? "Visitors who look for this map are now shown this view."
                  : "Visitors who look for this map are now shown its first view.";
  }
  std::string operator()(const PlaceModel& c) const {
    return "Placed " + std::filesystem::path(c.file).filename().string() + ".";
  }
  std::string operator()(const PlaceSignpost&) const { return "Placed a signpost."; }
  std::string operator()(const PlaceLabel&) const { return "Placed a label."; }
  std::string operator()(const PlaceImage& c) const {
    return "Placed " + std::filesystem::path(c.file).filename().string() + ".";
  }
  std::string operator()(const PlaceSound& c) const {
    return "Placed " + std::filesystem::path(c.file).filename().string() + ".";
  }
  std::string operator()(const PlaceTrail&) const { return "Placed a trail."; }
  std::string operator()(const PlaceOccluder& c) const {
    return std::string("Placed an occluder: a ") + content::NameOf(c.shape) + ".";
  }
  std::string operator()(const ResizeOccluder& c) const { return "Resized " + c.name + "."; }
  std::string operator()(const ExtendTrail& c) const { return "Added a point to " + c.name + "."; }
  std::string operator()(const ShortenTrail& c) const { return "Removed a point of " + c.name + "."; }
  std::string operator()(const SetLabelOffset& c) const { return "Moved the board of " + c.name + "."; }
  std::string operator()(const MoveEntity& c) const { return "Moved " + c.name + "."; }
  std::string operator()(const RotateEntity& c) const { return "Rotated " + c.name + "."; }
  std::string operator()(const ScaleEntity& c) const { return "Scaled " + c.name + "."; }
  std::string operator()(const TransformEntities& c) const {
    std::vector<std::string> names;
    for (const EntityPose& pose : c.poses) names.push_back(pose.name);
    return "Moved " + NamesText(names) + ".";
  }
  std::string operator()(const AlignEntity& c) const { return "Aligned " + c.name + "."; }
  std::string operator()(const BendEntity& c) const { return "Bent " + c.name + "."; }
  std::string operator()(const UnbendEntity& c) const {
    return "Restored the original shape of " + c.name + ".";
  }
  std::string operator()(const RemoveEntities& c) const { return "Removed " + NamesText(c.names) + "."; }
  std::string operator()(const DuplicateEntities& c) const {
    return "Duplicated " + NamesText(c.names) + ".";
  }
  std::string operator()(const RenameEntity& c) const {
    return "Renamed " + c.name + " to " + c.new_name + ".";
  }
  std::string operator()(const SetEntityText& c) const { return "Changed the text of " + c.name + "."; }
  std::string operator()(const SetSignpostTarget& c) const {
    return c.name + (c.to_map.empty() ? " leads nowhere now." : " leads to " + c.to_map + " now.");
  }
  std::string operator()(const SetSignpostDirection& c) const {
    if (!c.ahead && !c.direction) return c.name + " has no arrow now.";
    return "The arrow of " + c.name + " points " + (c.ahead ? "where the camera looks." : "there now.");
  }
  std::string operator()(const SetEntityFlag& c) const {
    const bool is_lock = c.flag == content::EntityFlag::kLocked;
    const char* const verb = is_lock ? (c.value ? "Locked " : "Unlocked ") : (c.value ? "Hid " : "Showed ");
    return verb + NamesText(c.names) + ".";
  }
  std::string operator()(const GroupEntities& c) const {
    return (c.group.empty() ? "Ungrouped " : "Grouped ") + NamesText(c.names) + ".";
  }
  std::string operator()(const PasteEntities& c) const { return "Pasted " + NamesText(c.names) + "."; }
  std::string operator()(const GuideVisitor& c) const {
    switch (c.step) {
      case GuideVisitor::Step::kSkip:
        return "Skipped a stop.";
      case GuideVisitor::Step::kBack:
        return "Going back to the previous stop.";
      case GuideVisitor::Step::kOpen:
        return "Opened the card of " + NamesText({c.name}) + ".";
      case GuideVisitor::Step::kPress:
      case GuideVisitor::Step::kMark:
      case GuideVisitor::Step::kClose:
      case GuideVisitor::Step::kContinue:
        break;
      case GuideVisitor::Step::kRestart:
        return "The tour starts again.";
    }
    return "";
  }
  std::string operator()(const Undo&) const { return "Undid the last change."; }
  std::string operator()(const Redo&) const { return "Redid the change."; }
  std::string operator()(const Save&) const { return "Saving all maps."; }
};

template <typename... Commands>
bool IsOneOf(const Command& command) {
  return (std::holds_alternative<Commands>(command) || ...);
}

}  // namespace

std::string DoneText(const Command& command) {
  return std::visit(DoneWriter{}, command);
}

std::string ReadingText(const std::string& file) {
  return "Reading " + std::filesystem::path(file).filename().string() + "…";
}

bool CanBeUndone(const Command& command) {
  return !IsOneOf<NewMap, StopMap, UseMap, SetPolicy, RenameMap, RemoveMap, JoinMap, GuideVisitor, Undo, Redo,
                  Save>(command);
}

}  // namespace docent::app
