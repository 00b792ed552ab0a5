// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>

#include "engine/base/time.h"
#include "engine/mapping/lens_estimation.h"
#include "engine/mapping/map_joining.h"
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
  bool forgotten = false;
};
// The snapshot of the active map was replaced by a newer one.
struct MapUpdated {
  std::shared_ptr<const MapSnapshot> snapshot;
};
struct MapDiscarded {
  enum class Reason : std::uint8_t {
    kFalseDepth,            // the map was provisional, and most of its points were not found again
    kLostWhileProvisional,  // tracking was lost soon after initialization
    kLostWithoutDepth,      // tracking was lost before the map had finite points
    kRelocalizedElsewhere,  // the map had no finite points yet when the camera relocalized in `other`
  };
  Reason reason = Reason::kFalseDepth;
  std::uint64_t replacement = 0;  // key of the map that is started instead; 0 for none
  std::uint64_t other = 0;
  InitializationMonitor::Fault fault;  // of kFalseDepth
  Timestamp tracked_for{};             // of kLostWhileProvisional: from initialization to the loss
  std::size_t keyframes = 0;
};
// A new map was started as the camera was lost in `lost_in`.
struct MapStartedAfterLoss {
  std::uint64_t lost_in = 0;
};
// A keyframe or an initial pair was offered to the mapper. accepted: false when it was busy.
struct KeyFrameOffered {
  bool accepted = false;
};
struct JoinRequested {
  std::uint64_t from = 0;
};
// Another map was joined into this one; MapUpdated came before.
struct MapsJoined {
  std::uint64_t from = 0;
  std::shared_ptr<const JoinedMap> joined;
};
struct JoinRefused {
  std::uint64_t from = 0;
  std::string reason;  // a sentence without full stop; see ReasonNotToJoin
};
// The relative pose of the first two cameras became rigid, or is no longer rigid.
struct RigChanged {
  RigEstimate estimate;
};
// The calibration does not describe the lens; see CalibrationMonitor.
struct CalibrationMismatch {
  CalibrationMonitor::Mismatch mismatch;
};
// The estimate of an unknown calibration became more precise or changed; the camera is tracked with it from
// now on.
struct LensEstimated {
  EstimatedLens lens;
};
// The mapper's thread ended by an exception. Tracking continues; the map is no longer extended.
struct MapperFailed {
  std::string what;
};

struct SystemEvent {
  Timestamp time{};        // image time
  std::uint64_t map = 0;   // key of the map that it concerns; 0 for none
  std::size_t camera = 0;  // index of the camera, where one is concerned
  std::variant<MapEntered, Relocalized, PoseRejected, MapLeft, MapUpdated, MapDiscarded, MapStartedAfterLoss,
               LensEstimated, KeyFrameOffered, JoinRequested, MapsJoined, JoinRefused, RigChanged,
               CalibrationMismatch, MapperFailed, MapperEvent>
      what;
};

}  // namespace docent::engine
