// SPDX-License-Identifier: Apache-2.0
#include "app/output/engine_text.h"

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numbers>
#include <variant>

namespace docent::app {

namespace {

using engine::MapperEvent;

[[gnu::format(printf, 1, 2)]] std::string Printed(const char* format, ...) {
  char text[512];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

const char* NameOf(engine::BundleSummary::Outcome outcome) {
  using Outcome = engine::BundleSummary::Outcome;
  switch (outcome) {
    case Outcome::kConverged:
      return "converged";
    case Outcome::kIterationLimit:
      return "stopped at the iteration limit";
    case Outcome::kInterrupted:
      return "interrupted";
    case Outcome::kFailed:
      return "failed";
  }
  return "unknown";
}

std::string ReasonOf(const engine::MapOverlap& overlap) {
  using Outcome = engine::MapOverlap::Outcome;
  switch (overlap.outcome) {
    case Outcome::kOverlap:
      break;
    case Outcome::kNothingToCompare:
      return "one of the maps has too few localized keyframes to be compared";
    case Outcome::kNothingRecognized:
      return "no place of one map is recognized in the other";
    case Outcome::kTooFewConsecutive:
      return Printed("only %zu consecutive keyframes are recognized at the same place", overlap.consecutive);
    case Outcome::kTooFewConfirmed:
      return Printed("they look alike, but only %zu of %zu keyframes that should show the other map match it",
                     overlap.confirmed, overlap.with_view);
    case Outcome::kTooFewPoints:
      return Printed(
          "they look alike, but keyframes that should show the other map find only %.0f %% of its "
          "points",
          100 * overlap.found_ratio);
    case Outcome::kSurfacesDiffer:
      return Printed("they look alike, but their surfaces differ in %zu of %zu image regions",
                     overlap.contradicted, overlap.regions);
    case Outcome::kAmbiguous:
      return "several places in the other map look the same";
    case Outcome::kInterrupted:
      return "the comparison was interrupted";
  }
  return {};
}

std::string KeyFrameText(engine::KeyFrameId keyframe) {
  return "keyframe " + std::to_string(keyframe);
}

// The texts of the mapper's events in the map of a name.
struct MapperEventText {
  const std::string& map;

  std::optional<EventText> operator()(const MapperEvent::MapStarted& what) const {
    return EventText{"map", "started " + map + ": " + std::to_string(what.points) + " points"};
  }
  std::optional<EventText> operator()(const MapperEvent::StartFailed& what) const {
    return EventText{"warning", "could not initialize " + map + ": only " + std::to_string(what.points) +
                                    " points are consistent"};
  }
  std::optional<EventText> operator()(const MapperEvent::KeyFrameAdded& what) const {
    return EventText{"keyframe", "sixdof in " + map + ": " + std::to_string(what.new_points) +
                                     " new points, " + std::to_string(what.points) + " in total"};
  }
  std::optional<EventText> operator()(const MapperEvent::PanoramaOpened& what) const {
    return EventText{"panorama",
                     "opened in " + map + ": " + std::to_string(what.infinite_points) + " infinite points"};
  }
  std::optional<EventText> operator()(const MapperEvent::PanoramaKeyFrameAdded& what) const {
    return EventText{"keyframe", "panorama in " + map + ": " + std::to_string(what.infinite_points) +
                                     " new infinite points"};
  }
  std::optional<EventText> operator()(const MapperEvent::KeyFrameLocalized& what) const {
    return EventText{"keyframe", "localized in " + map + ": " + KeyFrameText(what.keyframe) +
                                     (what.by_descriptors ? ", by its descriptors" : "")};
  }
  std::optional<EventText> operator()(const MapperEvent::InfinitePointsTriangulated& what) const {
    return EventText{"points", map + ": " + std::to_string(what.triangulated) +
                                   " infinite points triangulated, " + std::to_string(what.fused) + " fused"};
  }
  std::optional<EventText> operator()(const MapperEvent::KeyFrameRemoved& what) const {
    return EventText{"keyframe", "removed from " + map + " as redundant: " + KeyFrameText(what.keyframe)};
  }
  std::optional<EventText> operator()(const MapperEvent::GloballyAdjusted& what) const {
    return EventText{"adjustment", map + ": " + TextOf(what.summary)};
  }
  std::optional<EventText> operator()(const MapperEvent::LoopClosed& what) const {
    return EventText{"loop", "closed in " + map + ": " + TextOf(what.loop)};
  }
  // The system reports each lens that changed.
  std::optional<EventText> operator()(const MapperEvent::LensesEstimated&) const { return std::nullopt; }
  std::optional<EventText> operator()(const MapperEvent::CalibrationContradicted& what) const {
    return EventText{"warning", TextOf(what.contradiction)};
  }
};

}  // namespace

std::string TextOf(const engine::BundleSummary& summary) {
  return Printed("%s after %d iterations, cost %.6g -> %.6g, sigma %.3f, %d outliers",
                 NameOf(summary.outcome), summary.iterations, summary.initial_cost, summary.final_cost,
                 summary.sigma, summary.outliers);
}

std::string TextOf(const engine::ClosedLoop& loop) {
  return Printed(
      "drift of %.1f %% of the path, %.2f degrees, %+.1f %% in scale; keyframe %u matches keyframe %u: %zu "
      "of %d map points found, %zu pairs of duplicate points, %d inliers in the reverse check; %d pairs "
      "fused "
      "in total",
      100 * loop.drift, loop.rotation * 180 / std::numbers::pi, 100 * (loop.scale - 1), loop.keyframe,
      loop.place, loop.found, loop.expected, loop.duplicates, loop.reverse_inliers, loop.fused);
}

std::string TextOf(engine::Hint hint) {
  using engine::Hint;
  switch (hint) {
    case Hint::kNone:
      break;
    case Hint::kChooseMap:
      return "Press New map to begin, or look at a mapped place.";
    case Hint::kMoveSideways:
      return "Move sideways.";
    case Hint::kMoveInsteadOfTurning:
      return "Move sideways instead of turning.";
    case Hint::kMoveFurther:
      return "Move further sideways.";
    case Hint::kAvoidPlane:
      return "Move in another direction, or point the camera at something less flat.";
    case Hint::kFindMoreDetail:
      return "Point the camera at something with more detail, and move slowly.";
    case Hint::kWaitUntilStill:
      return "Wait until nothing moves in view, then move sideways.";
    case Hint::kStartWhereThereIsDetail:
      return "Too little detail here: point the camera at the exhibit.";
    case Hint::kFindTarget:
      return "Point the camera at the target.";
    case Hint::kWaitForMap:
      return "Starting the map. Please wait.";
    case Hint::kMoveMoreSlowly:
      return "Move more slowly.";
    case Hint::kLowTexture:
      return "Little detail is in view: turn towards the exhibit.";
    case Hint::kLeftMap:
      return "You have left the known area: look back.";
    case Hint::kLookBack:
      return "Look back at a place you have seen before.";
    case Hint::kFollowOtherCamera:
      return "Point this camera at what the other camera sees.";
  }
  return {};
}

std::string TextOf(const engine::RigEstimate& rig) {
  return Printed("%s, baseline %.4g (sigma %.2g), rotation %.4g degrees (sigma %.2g)",
                 rig.rigid ? "rigid" : "not rigid", rig.Baseline(), rig.position_sigma,
                 rig.second_from_first.rotation.Angle() * 180 / std::numbers::pi, rig.rotation_sigma_deg);
}

std::string TextOf(const engine::MapOverlap& overlap) {
  return Printed(
      "%zu keyframes recognized, %zu consecutive, %zu of %zu with a view of the other map confirm it, median "
      "ratio of points found %.2f, %zu of %zu regions contradict, %zu points in total, %zu for another "
      "hypothesis, scale %.4g",
      overlap.recognized, overlap.consecutive, overlap.confirmed, overlap.with_view, overlap.found_ratio,
      overlap.contradicted, overlap.regions, overlap.points, overlap.second_points, overlap.a_from_b.scale);
}

std::string TextOf(const engine::CalibrationContradiction& contradiction) {
  // A map that was built with a wrong calibration does not know more digits.
  const double unit = std::pow(10, std::floor(std::log10(contradiction.focal_px)) - 1);
  return Printed(
      "The calibration is probably wrong: its focal length is %.0f px, but the map indicates about %.0f px. "
      "Calibrate the camera with `docent calibrate`.",
      contradiction.given_focal_px, unit * std::round(contradiction.focal_px / unit));
}

std::string FormatFocalLength(const engine::EstimatedLens& lens) {
  return Printed("%.1f px (+-%.1f %%)", lens.model->intrinsics().fx, 100 * lens.focal_sigma);
}

std::string TextOf(engine::JoinRefusal refusal, const engine::MapOverlap& overlap) {
  using engine::JoinRefusal;
  switch (refusal) {
    case JoinRefusal::kNone:
      break;
    case JoinRefusal::kTooManyIds:
      return "together they have more ids than one map can hold";
    case JoinRefusal::kNoOverlap:
      return ReasonOf(overlap);
    case JoinRefusal::kTooMuchDrift:
      return "one of the maps has drifted too far to fit the other";
    case JoinRefusal::kInterrupted:
      return "the joining was interrupted";
  }
  return {};
}

std::string TextForAuthors(engine::JoinRefusal refusal, const engine::MapOverlap& overlap) {
  using engine::JoinRefusal;
  using Outcome = engine::MapOverlap::Outcome;
  if (refusal == JoinRefusal::kTooManyIds) return "together they are too large for one map";
  if (refusal == JoinRefusal::kTooMuchDrift) return "one of them is too inaccurate to fit the other";
  if (refusal != JoinRefusal::kNoOverlap) return TextOf(refusal, overlap);
  switch (overlap.outcome) {
    case Outcome::kNothingToCompare:
      return "one of them shows too little to be compared";
    case Outcome::kTooFewConsecutive:
      return "too few views of one are recognized in the other";
    case Outcome::kTooFewConfirmed:
    case Outcome::kTooFewPoints:
    case Outcome::kSurfacesDiffer:
      return "they look alike, but differ in too many places";
    case Outcome::kOverlap:
    case Outcome::kNothingRecognized:
    case Outcome::kAmbiguous:
    case Outcome::kInterrupted:
      break;
  }
  return TextOf(refusal, overlap);
}

std::optional<EventText> TextOf(const engine::MapperEvent& event, const std::string& map_name) {
  return std::visit(MapperEventText{map_name}, event.what);
}

}  // namespace docent::app
