// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "content/scene.h"

// All texts of the author's window, in one place, so that they can be read together and translated. Texts
// after "##" are not shown; they only tell widgets apart.
namespace docent::ui::strings {

// Panel.
inline constexpr const char* kHidePanel = "Hide panel (F9)";
inline constexpr const char* kShowPanel = "Show panel (F9)";
inline constexpr const char* kNoMap = "No map";
inline constexpr const char* kUnsaved = "Unsaved changes";
inline constexpr const char* kSavedJustNow = "Saved just now";
inline constexpr const char* kSavedSecondsAgo = "Saved %d s ago";
inline constexpr const char* kSavedMinutesAgo = "Saved %d min ago";
inline constexpr const char* kNothingSaved = "Nothing saved yet";

// Map section.
inline constexpr const char* kMap = "Map";
inline constexpr const char* kMapNameHint = "Name of the new map";
inline constexpr const char* kNewMap = "New map";
inline constexpr const char* kStopMap = "Stop map";
inline constexpr const char* kUndo = "Undo";
inline constexpr const char* kRedo = "Redo";
inline constexpr const char* kSave = "Save";
inline constexpr const char* kNumberedMap = "Map %d";
inline constexpr const char* kBegin = "Press New map to begin.";
inline constexpr const char* kStarting = "Move the camera sideways, slowly.";

// Section of the current map's space.
inline constexpr const char* kSpace = "Floor, scale and entrance";
inline constexpr const char* kNoMapForSpace = "There is no current map.";
inline constexpr const char* kFloorEstimated = "The up direction is estimated from how the camera was held.";
inline constexpr const char* kFloorKnown = "The floor is known. Objects stand upright on it.";
inline constexpr const char* kPickFloor = "Show the floor…";
inline constexpr const char* kClickFloor = "Click on the floor or on a table in the image. Escape cancels.";
inline constexpr const char* kForgetFloor = "Estimate it again";
inline constexpr const char* kScaleUnknown =
    "The scale of the map is unknown. Measure a length in it to give models their true size.";
inline constexpr const char* kScaleKnown = "One unit of this map is %.3g m.";
inline constexpr const char* kLength = "Length (m)";
inline constexpr const char* kMeasure = "Measure it…";
inline constexpr const char* kClickFirstPoint = "Click on its first end in the image. Escape cancels.";
inline constexpr const char* kClickSecondPoint = "Click on its other end.";
inline constexpr const char* kMeasureEnded =
    "The view changed before the other end was shown, so nothing was measured.";
inline constexpr const char* kForgetScale = "Forget the scale";
inline constexpr const char* kEntranceFirst = "Visitors who look for this place are shown its first view.";
inline constexpr const char* kEntranceChosen =
    "Visitors who look for this place are shown the view you chose.";
inline constexpr const char* kChooseEntrance = "Show them this view";
inline constexpr const char* kForgetEntrance = "Show them the first view";

// Section of all maps.
inline constexpr const char* kMaps = "All maps";
inline constexpr const char* kNoMaps = "There is no map yet.";
inline constexpr const char* kFindMap = "Find a map";
inline constexpr const char* kChooseMap = "Choose a map to continue, rename, protect or remove it.";
inline constexpr const char* kMapSize = "%lu views, %lu objects";
inline constexpr const char* kNotInMemory = "Saved in the library, not in memory.";
inline constexpr const char* kContinueMap = "Continue this map";
inline constexpr const char* kPolicy = "Changes";
inline constexpr const char* kJoinMap = "Join to this map";
inline constexpr const char* kJoinMapHelp =
    "Makes one map of both, with the content of both, if they show the same place. Otherwise both stay as "
    "they are.";
inline constexpr const char* kRemoveMap = "Remove map…";
inline constexpr const char* kRemoveMapQuestion =
    "Remove this map with everything in it? This cannot be undone. Signposts to it will lead nowhere, "
    "and tours will leave it out.";
inline constexpr const char* kRemoveMapNow = "Remove for good";
struct PolicyText {
  const char* policy;  // Its name on the command line.
  const char* label;
  const char* explanation;
};
inline constexpr PolicyText kPolicies[] = {
    {"open", "All allowed", "The map may grow, and its content may be changed."},
    {"bounded", "Within its bounds", "The map does not grow beyond the space that it covers now."},
    {"augment-only", "Content only", "The map stays as it is; its content may be changed."},
    {"read-only", "None", "Nothing may be changed."},
};
// The label of a policy by its name on the command line; the name itself if there is none.
inline const char* PolicyLabel(const char* policy) {
  for (const PolicyText& text : kPolicies) {
    if (std::string_view(policy) == text.policy) return text.label;
  }
  return policy;
}

// Place section.
inline constexpr const char* kPlace = "Place";
inline constexpr const char* kToolSelect = "Select";
inline constexpr const char* kToolModel = "Model";
inline constexpr const char* kToolSignpost = "Signpost";
inline constexpr const char* kToolLabel = "Label";
inline constexpr const char* kToolImage = "Image";
inline constexpr const char* kToolSound = "Sound";
inline constexpr const char* kToolTrail = "Trail";
inline constexpr const char* kToolOccluder = "Occluder";
inline constexpr const char* kImageFileHint = "Image file (PNG, JPEG)";
inline constexpr const char* kSoundFileHint = "Sound file (WAV, FLAC, Ogg)";
inline constexpr const char* kUpright = "Upright, facing me";
inline constexpr const char* kCaptionHint = "Caption, shown while it plays";
inline constexpr const char* kClickToPlaceLabel = "Click on what the label is about.";
inline constexpr const char* kClickToPlaceImage = "Click in the image to place it.";
inline constexpr const char* kClickToPlaceSound = "Click where the sound should be heard.";
inline constexpr const char* kClickToPlaceTrail =
    "Click along the way, point by point. Each click extends the selected trail; press Escape to end it.";
inline constexpr const char* kWriteCaption = "Write its caption first.";
inline constexpr const char* kChooseImage = "Choose an image file first.";
inline constexpr const char* kChooseSound = "Choose a sound file first.";
inline constexpr const char* kClickToPlaceOccluder =
    "Click on the surface on which the real thing stands. What is behind the shape is hidden; visitors do "
    "not see it.";
inline constexpr const char* kShapePlane = "Plane";
inline constexpr const char* kShapeBox = "Box";
inline constexpr const char* kShapeCylinder = "Cylinder";
inline constexpr const char* kTrailBegun = "The trail begins here; click on its next point.";
inline constexpr const char* kModelFile = "Model file";
inline constexpr const char* kModelFileHint = "FILE.glb";
inline constexpr const char* kBrowse = "Browse…";
inline constexpr const char* kBrowseTitle = "Choose a model";
inline constexpr const char* kBrowseImageTitle = "Choose an image";
inline constexpr const char* kBrowseSoundTitle = "Choose a sound";
inline constexpr const char* kNoFileDialog =
    "No file dialog is installed (xdg-desktop-portal or zenity). Type the file's name.";
inline constexpr const char* kFiles = "Files here and recent ones";
inline constexpr const char* kDropFiles = "Or drop a file onto the image.";
inline constexpr const char* kAutomaticSize = "Automatic size";
inline constexpr const char* kScale = "Scale";
inline constexpr const char* kTurn = "Turn";
inline constexpr const char* kDegrees = "%.0f°";
inline constexpr const char* kClickToPlaceModel = "Click in the image to place the model.";
inline constexpr const char* kSignText = "Text";
inline constexpr const char* kLeadsTo = "Leads to";
inline constexpr const char* kLeadsNowhere = "(nowhere)";
inline constexpr const char* kClickToPlaceSign = "Click in the image to place the signpost.";
inline constexpr const char* kWriteText = "Write its text first.";
inline constexpr const char* kChooseFile = "Choose a model file first.";
inline constexpr const char* kNoModelFile =
    " cannot be placed: it is not a model, image or sound file.";  // After the file's name.
inline constexpr const char* kDropOnImage = "Drop files onto the image to place them there.";
inline constexpr const char* kDropOnMap =
    "Files are placed in the image, not in the map from above. Press M to see the image.";
inline constexpr const char* kNoSurface = "No surface is known here.";

// Contents section.
inline constexpr const char* kContents = "Contents";
inline constexpr const char* kNothingPlaced = "Nothing is placed in this map.";
inline constexpr const char* kName = "Name";
inline constexpr const char* kKind = "Kind";
constexpr const char* NameOf(content::Entity::Kind kind) {
  switch (kind) {
    case content::Entity::Kind::kModel:
      return "model";
    case content::Entity::Kind::kSignpost:
      return "sign";
    case content::Entity::Kind::kLabel:
      return "label";
    case content::Entity::Kind::kImage:
      return "image";
    case content::Entity::Kind::kSound:
      return "sound";
    case content::Entity::Kind::kTrail:
      return "trail";
    case content::Entity::Kind::kOccluder:
      return "occluder";
  }
  return "";
}
inline constexpr const char* kShown = "Shown";
inline constexpr const char* kLocked = "Locked";
inline constexpr const char* kDistance = "Distance";

// Section of the selected entity.
inline constexpr const char* kSelected = "Selected";
inline constexpr const char* kNothingSelected = "Click an object to select it.";
inline constexpr const char* kManySelected = "%d objects";
inline constexpr const char* kRename = "Name";
inline constexpr const char* kPosition = "Position";
inline constexpr const char* kRotation = "Rotation";
inline constexpr const char* kSize = "Size";
inline constexpr const char* kRange = "Range";
inline constexpr const char* kWidth = "Width";
inline constexpr const char* kBoardOffset = "Board, from the point";
inline constexpr const char* kArrowDirection = "Arrow, along the map's axes";
inline constexpr const char* kNoArrow = "It has no arrow: the way to that map is not known.";
inline constexpr const char* kLeaveHere = "Leave here: point this way";
inline constexpr const char* kLeaveHereHelp = "The arrow points where the camera looks now.";
inline constexpr const char* kRemoveArrow = "Remove arrow";
inline constexpr const char* kLanguageHint = "Language of the text: de, es, …";
inline constexpr const char* kNoLanguage = "This is not a language tag such as de or es-419.";
inline constexpr const char* kTextTooLong =
    "This text is too long and is not kept: shorten it to 10,000 bytes.";
inline constexpr const char* kNotWritableHere =
    "It has characters, such as emoji, that a field cannot hold. Change it with docent content edit.";
inline constexpr const char* kMapNotWritableHere =
    "It has characters, such as emoji, that a field cannot hold. Change it with docent maps rename.";
inline constexpr const char* kRowWithoutLanguages = "  (no ";  // Followed by "de, es)".
inline constexpr const char* kTextWithoutLanguages =           // Followed by "de, es.".
    "Other texts of this map are translated. Readers of these languages see this one as it is: ";
inline constexpr const char* kSides = "Width, height, depth";
inline constexpr const char* kTrailPoints = "%d points";
inline constexpr const char* kRemoveLastPoint = "Remove last point";
inline constexpr const char* kDuplicate = "Duplicate";
inline constexpr const char* kCopy = "Copy";
inline constexpr const char* kPaste = "Paste";
inline constexpr const char* kDelete = "Delete";
inline constexpr const char* kStandUpright = "Stand upright";
inline constexpr const char* kFit = "Fit by points…";
inline constexpr const char* kFitHelp =
    "Click points of the object and the places where they belong; then it is moved, turned and scaled to "
    "fit.";
inline constexpr const char* kFitting = "Fitting %s";
inline constexpr const char* kFitClickObject = "Click a point on the object.";
inline constexpr const char* kFitClickPlace = "Now click the place where this point belongs.";
inline constexpr const char* kFitPairs = "Pairs of points: %d";
inline constexpr const char* kFitNeeds = "Three pairs are needed to fit it, four to bend it.";
inline constexpr const char* kFitPair = "%d: %.3g map units off";
inline constexpr const char* kFitPairUnused = "%d: %.3g map units off, left out";
inline constexpr const char* kFitFull = "A model can have no more pairs of points.";
inline constexpr const char* kFitMissed = "This is not on the object.";
inline constexpr const char* kFitAlign = "Fit";
inline constexpr const char* kFitBend = "Bend to fit";
inline constexpr const char* kFitBendHelp = "Deforms the object smoothly so that every pair fits exactly.";
inline constexpr const char* kFitRemoveLast = "Remove last point";
inline constexpr const char* kFitEnd = "Done";
inline constexpr const char* kUnbend = "Undo bending";
inline constexpr const char* kLock = "Lock";
inline constexpr const char* kUnlock = "Unlock";
inline constexpr const char* kHide = "Hide";
inline constexpr const char* kShow = "Show";
inline constexpr const char* kGroup = "Group";
inline constexpr const char* kUngroup = "Ungroup";

// View section.
inline constexpr const char* kView = "View";
inline constexpr const char* kFreeze = "Freeze view";
inline constexpr const char* kFrozen = "The view is frozen. Press F to go on.";
inline constexpr const char* kMapPoints = "Map points";
inline constexpr const char* kKeyframes = "Keyframes";
inline constexpr const char* kStatus = "Status";
inline constexpr const char* kFromAbove = "Map from above";
inline constexpr const char* kCoverage = "Coverage";
inline constexpr const char* kBoundary = "Boundary";
inline constexpr const char* kBoundaryHelp = "The edges of the box within which a bounded map is extended.";
inline constexpr const char* kCoverageHelp =
    "A small map: visitors will be recognized where it is green; take more images where it is red.";
inline constexpr const char* kFullScreen = "Full screen";
inline constexpr const char* kKeys = "Keys";

// Messages.
inline constexpr const char* kDismiss = "Dismiss";
inline constexpr const char* kDismissAll = "Dismiss all";
inline constexpr const char* kTimes = "%s (%d times)";

// Dialogs.
inline constexpr const char* kQuitTitle = "Quit";
inline constexpr const char* kQuitQuestion = "There are changes that are not saved.";
inline constexpr const char* kSaveAndQuit = "Save and quit";
inline constexpr const char* kQuitWithoutSaving = "Quit without saving";
inline constexpr const char* kCancel = "Cancel";

// Keys and what they do, in the order in which they are listed.
struct KeyHelp {
  const char* key;
  const char* effect;
};
inline constexpr KeyHelp kKeyHelp[] = {
    {"Click", "select; Shift adds"},
    {"Drag", "move over the ground"},
    {"Ctrl (drag)", "in steps"},
    {"Arrows", "move a little"},
    {"Shift-arrows", "move the pointer; Ctrl-arrows slowly"},
    {"Enter", "click"},
    {"1 to 8", "the tools, in their order"},
    {"4, 5, 6, 7, 8", "label, image, sound, trail, occluder"},
    {"Delete", "remove"},
    {"Ctrl-D", "duplicate"},
    {"Ctrl-C, Ctrl-V", "copy, paste"},
    {"Ctrl-Z, Ctrl-Y", "undo, redo"},
    {"F2", "rename what is selected, else the map"},
    {"Escape", "end, close or deselect"},
    {"Tab", "use the panel by keyboard"},
    {"F", "freeze the view"},
    {"Space", "pause a recording"},
    {"C", "swap the cameras"},
    {"M, G", "map from above, coverage"},
    {"P, K, H", "points, keyframes, status"},
    {"F9, F11", "panel, full screen"},
    {"Ctrl-S, Ctrl-Q", "save, quit"},
};

}  // namespace docent::ui::strings
