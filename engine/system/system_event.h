// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>

#include "engine/base/time.h"
#include "engine/mapping/calibration/lens_estimation.h"
#include "engine/mapping/loops/map_joining.h"
#include "engine/mapping/mapper.h"
#include "engine/system/calibration_monitor.h"
#include "engine/system/camera_rig.h"
#include "engine/system/initialization_monitor.h"

// What happens in a System, as values: words are made of them where a person reads them.
namespace docent::engine {

// A camera was tracked in another map than before; the map is the current one of all cameras now.
struct MapEntered {};
// A camera found the pose in its map again.
struct Relocalized {};
// The pose of a frame was rejected: while it was tracked, another camera relocalized in another map, or the
// application chose another one.
struct PoseRejected {};
// The map is no longer extended. forgotten: it had never been initialized.
struct MapLeft {
  bool forgotten = false;  // the system no longer knows the map
};
// The snapshot of the active map was replaced by a newer one.
struct MapUpdated {
  std::shared_ptr<const MapSnapshot> snapshot;  // never null
};
// A map was discarded, because it was not initialized well enough to be kept.
struct MapDiscarded {
  // Why.
  enum class Reason : std::uint8_t {
    kFalseDepth,            // most points of a new map were not found again, or it contradicted itself
    kLostWhileProvisional,  // tracking was lost soon after initialization
    kLostWithoutDepth,      // tracking was lost before the map had finite points
    kRelocalizedElsewhere,  // the map had no finite points yet when the camera relocalized in `other`
  };
  Reason reason = Reason::kFalseDepth;  // why
  std::uint64_t replacement = 0;        // key of the map that is started instead; 0 for none
  std::uint64_t other = 0;              // of kRelocalizedElsewhere: key of the map that the camera is in now
  InitializationMonitor::Fault fault;   // of kFalseDepth
  Timestamp tracked_for{};              // of kLostWhileProvisional: from initialization to the loss
  std::size_t keyframes = 0;            // of kLostWhileProvisional: that the map had
};
// A new map was started as the camera was lost in `lost_in`.
struct MapStartedAfterLoss {
  std::uint64_t lost_in = 0;  // key of the map
};
// A keyframe or an initial pair was offered to the mapper. accepted: false when it was busy.
struct KeyFrameOffered {
  bool accepted = false;  // whether the mapper will use it
};
// The mapper was asked to join another map into this one.
struct JoinRequested {
  std::uint64_t from = 0;  // key of the other map
};
// Another map was joined into this one; MapUpdated came before.
struct MapsJoined {
  std::uint64_t from = 0;                   // key of the other map, which does not exist any more
  std::shared_ptr<const JoinedMap> joined;  // how its coordinates and ids changed; never null
};
// Two maps were not joined; it is attempted again when they have more keyframes.
struct JoinRefused {
  std::uint64_t from = 0;                    // key of the other map
  JoinRefusal refusal = JoinRefusal::kNone;  // why
  MapOverlap overlap;                        // what the comparison found; without candidates
  bool asked = false;                        // whether a person had asked for it
};
// The relative pose of the first two cameras became rigid, or is no longer rigid.
struct RigChanged {
  RigEstimate estimate;  // with `rigid`, whether it is rigid now
};
// The calibration does not describe the lens; see CalibrationMonitor.
struct CalibrationMismatch {
  CalibrationMonitor::Mismatch mismatch;  // how far off, and where in the image
};
// The estimate of an unknown calibration became more precise or changed; the camera is tracked with it from
// now on.
struct LensEstimated {
  EstimatedLens lens;  // the new estimate
};
// The mapper's thread ended by an exception. Tracking continues; the map is no longer extended.
struct MapperFailed {
  std::string what;  // the exception's message
};

// One of the above, with its time and what it concerns.
struct SystemEvent {
  Timestamp time{};        // image time
  std::uint64_t map = 0;   // key of the map that it concerns; 0 for none
  std::size_t camera = 0;  // index of the camera, where one is concerned
  std::variant<MapEntered, Relocalized, PoseRejected, MapLeft, MapUpdated, MapDiscarded, MapStartedAfterLoss,
               LensEstimated, KeyFrameOffered, JoinRequested, MapsJoined, JoinRefused, RigChanged,
               CalibrationMismatch, MapperFailed, MapperEvent>
      what;  // the event itself
};

}  // namespace docent::engine
