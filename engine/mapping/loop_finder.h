// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "engine/mapping/loop_verification.h"
#include "engine/vision/descriptor.h"

// A camera that walks around something and comes back is, for its map, somewhere else by then: small errors
// have added up, and what was known is mapped a second time (ptamm §6.2, Fig. 15). Here the map finds out:
// keyframes that look like known ones they share nothing with, and proof by geometry that holds for several
// in a row. For the mapper's thread.
namespace docent::engine {

struct LoopFinderOptions {
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
  // An error of less than this (of the depth, radians, logarithm of the scale) active search deals with.
  double least_error = 0.02;
  // Of more than this the place is another one that looks alike: what gathers on a way is small against it.
  double max_shift = 0.1;  // of the way between the two
  double max_turn = 0.35;  // radians
  double max_scale = 0.4;  // logarithm
  // So many keyframes in a row must say the same.
  std::size_t agreeing = 3;
  double max_disagreement = 0.05;  // of the depth, radians, logarithm of the scale
};

// Watches keyframes as they come. Everything it keeps are looks, ids and similarities between keyframes,
// which hold while the map is adjusted.
class LoopFinder {
 public:
  explicit LoopFinder(const LoopFinderOptions& options) : options_(options) {}

  void Clear();
  // Looks at a localized keyframe. When it is the last of enough that agree: all of them, and the finder
  // begins anew. Else empty.
  std::vector<LoopSighting> Look(KeyFrameId keyframe, Map* map, PointSearcher* searcher);

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
  std::optional<LoopSighting> Sight(KeyFrameId keyframe, Map* map, PointSearcher* searcher);
  std::vector<KeyFrameId> Resembling(const KeyFrame& keyframe, const std::set<KeyFrameId>& here, Map* map);
  // A place that looks the same.
  struct Suggestion {
    std::vector<KeyFrameId> group;  // of the place, the one most like the keyframe first
    std::vector<Match> matches;
  };
  std::vector<Suggestion> Compare(KeyFrameId keyframe, Map* map);
  void Describe(KeyFrameId keyframe, Map* map);
  void AddMatches(const std::vector<Described>& own, const std::vector<Described>& known,
                  std::vector<Match>* matches) const;
  // Whether it tells of an error, and of one that may have come about.
  bool IsPlausible(const LoopSighting& sighting, Map* map) const;
  bool Agree(const LoopSighting& a, const LoopSighting& b, Map* map) const;

  const LoopFinderOptions options_;
  std::map<KeyFrameId, std::vector<Described>> described_;  // as far as they were asked for
  std::vector<LoopSighting> sightings_;                     // of keyframes in a row
};

// Where a sighting says that the surroundings of its keyframe are, from where the map has them.
Sim3 KnownFromRecent(const LoopSighting& sighting, Map* map);

}  // namespace docent::engine
