// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "engine/mapping/loop_verification.h"
#include "engine/vision/descriptor.h"

// The search for known places that a keyframe shows although it shares no points with them: candidates by
// appearance, then the proof by geometry. Closing loops within a map and joining two maps both rest on it.
// For one thread at a time.
namespace docent::engine {

struct LoopCandidateSearchOptions {
  // Of its points, that are seen from here too, for a keyframe to be here and no other place; some few are
  // always seen in the wrong place. What is seen from the neighbours counts as well.
  double min_share = 0.2;
  int hops = 2;
  // Places that resemble the keyframe most at first sight, which are compared by what their points look like.
  std::size_t places = 12;
  std::size_t compared = 2;            // keyframes of such a place
  std::size_t new_descriptions = 4;    // keyframes that are described for it at once; more wait for the next
  std::size_t min_matches = 16;        // by looks; fewer come about by chance
  std::size_t proved = 2;              // places, those with most matches
  std::size_t group = 8;               // keyframes that stand for a place in the proof
  std::size_t described_points = 200;  // of a keyframe, the coarser ones first
  int levels_around = 1;               // on which they are described beside their own
  double max_ratio = 0.64;             // of squared distances, to the second best: 0.8 squared (Lowe 2004)
  double inlier_px = 5;                // RANSAC
  int min_pose_inliers = 12;
  LoopVerificationOptions verification;
};

// The keyframe and those that see at least min_share of what it sees, and those that see as much of what
// these see, and so on.
std::set<KeyFrameId> Neighbourhood(KeyFrameId keyframe, double min_share, int hops, Map* map);

// How far a similarity moves a camera: its centre in units of the keyframe's depth, radians, and the absolute
// logarithm of the scale.
struct SimilaritySize {
  double shift = 0, turn = 0, scale = 0;
  double largest() const;
};
SimilaritySize SizeAt(const Sim3& after_from_before, const KeyFrame& keyframe);

// Where a sighting says that the reference_keyframe of its keyframe are, from where the map has them.
Sim3 KnownFromRecent(const LoopCandidate& sighting, Map* map);

// Keeps the descriptors of the keyframes that it was asked about. They hold while the map is adjusted.
class LoopCandidateSearch {
 public:
  explicit LoopCandidateSearch(const LoopCandidateSearchOptions& options) : options_(options) {}

  void Clear() { described_.clear(); }
  // Hands to `take` what is proved of a localized keyframe, the place with most matches first, until `take`
  // answers true. `here`: keyframes that are no candidates, the keyframe itself among them.
  using Take = std::function<bool(LoopCandidate sighting)>;
  void Find(KeyFrameId keyframe, const std::set<KeyFrameId>& here, Map* map, PointSearcher* searcher,
            const Take& take);

 private:
  // A point as a keyframe sees it, on one level.
  struct Described {
    Descriptor descriptor;
    MapPointId point = kNoId;
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
    bool own_level = false;  // on which the keyframe saw it
  };
  struct Match {
    Eigen::Vector2f pixel;  // of the keyframe that is looked at
    MapPointId point;       // of the place
  };
  std::vector<KeyFrameId> Resembling(const KeyFrame& keyframe, const std::set<KeyFrameId>& here, Map* map);
  // A place that looks the same.
  struct Suggestion {
    std::vector<KeyFrameId> group;  // of the place, the one most like the keyframe first
    std::vector<Match> matches;
  };
  std::vector<Suggestion> Compare(KeyFrameId keyframe, const std::set<KeyFrameId>& here, Map* map);
  void Describe(KeyFrameId keyframe, Map* map);
  void AddMatches(const std::vector<Described>& own, const std::vector<Described>& known,
                  std::vector<Match>* matches) const;

  const LoopCandidateSearchOptions options_;
  std::map<KeyFrameId, std::vector<Described>> described_;  // as far as they were asked for
};

}  // namespace docent::engine
