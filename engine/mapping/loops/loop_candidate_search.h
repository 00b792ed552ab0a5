// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/mapping/loops/loop_verification.h"
#include "engine/vision/descriptor.h"

// Finds known places that a keyframe shows although it shares no points with them: candidates are retrieved
// by appearance and then verified by geometry. Used for closing loops within a map and for joining two maps.
// For one thread at a time.
namespace docent::engine {

struct LoopCandidateSearchOptions {
  // Keyframes that share at least this ratio of their points with the keyframe, or with its neighbours over
  // so many steps, belong to its own neighbourhood and are no loop candidates. Smaller ratios occur by
  // chance, since some points are always matched in the wrong place.
  double min_covisibility_ratio = 0.2;
  int hops = 2;
  // Places with the most similar thumbnails, whose descriptors are compared.
  std::size_t max_places = 12;
  std::size_t max_compared = 2;  // keyframes of each such place that are compared
  // Keyframes that are described in one call; further ones are skipped in this call.
  std::size_t max_new_descriptions = 4;
  std::size_t min_matches = 16;            // descriptor matches of a place; fewer occur by chance
  std::size_t max_verified = 2;            // places with most matches that are verified by geometry
  std::size_t max_group = 8;               // keyframes that represent a place in the verification
  std::size_t max_described_points = 200;  // of a keyframe; coarse levels first
  int levels_around = 1;                   // points are described on so many levels above and below their own
  double max_ratio = 0.64;  // of squared distances, best to second best: 0.8 squared (Lowe 2004)
  double inlier_px = 5;     // RANSAC, level 0
  int min_pose_inliers = 12;
  LoopVerificationOptions verification;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The neighbourhoods of keyframes: the keyframe, the keyframes that share at least the ratio
// min_covisibility_ratio of their finite points with it, those that share as much with these, and so on for
// `hops` steps. Each is computed once, so that the map must not change.
class Neighbourhoods {
 public:
  Neighbourhoods(double min_covisibility_ratio, Map* map)
      : min_covisibility_ratio_(min_covisibility_ratio), map_(*map) {}

  // The reference stays valid.
  const std::set<KeyFrameId>& Of(KeyFrameId keyframe, int hops);
  Map& map() const { return map_; }

 private:
  void AddStep(std::set<KeyFrameId>* known);
  std::ptrdiff_t FinitePointsOf(KeyFrameId keyframe);

  const double min_covisibility_ratio_;
  Map& map_;
  std::map<std::pair<KeyFrameId, int>, std::set<KeyFrameId>> known_;
  std::map<KeyFrameId, std::ptrdiff_t> finite_points_;
};

// How far a similarity moves a camera: the displacement of its centre as a ratio of the keyframe's median
// depth, the rotation in radians, and the absolute logarithm of the scale.
struct SimilarityMagnitude {
  double translation = 0, rotation = 0, log_scale = 0;
  double largest() const;
};
SimilarityMagnitude MagnitudeAt(const Sim3& after_from_before, const KeyFrame& keyframe);

// The correction that a loop candidate implies for the neighbourhood of its keyframe: maps the current map
// coordinates to those in which the known place lies.
Sim3 KnownFromRecent(const LoopCandidate& candidate, Map* map);

// Caches the descriptors of the keyframes that were searched. They stay valid while the map is adjusted.
class LoopCandidateSearch {
 public:
  explicit LoopCandidateSearch(const LoopCandidateSearchOptions& options) : options_(Checked(options)) {}

  void Clear() { described_.clear(); }
  // Passes each verified candidate of a localized keyframe to `take`, the place with most matches first,
  // until `take` returns true. here: keyframes that are not considered, the keyframe itself among them.
  // neighbourhoods: of the map in its present state.
  using Take = std::function<bool(LoopCandidate candidate)>;
  void Find(KeyFrameId keyframe, const std::set<KeyFrameId>& here, Neighbourhoods* neighbourhoods,
            PointSearcher* searcher, const Take& take);

 private:
  // The descriptor of a point in a keyframe on one level.
  struct Described {
    Descriptor descriptor;
    MapPointId point = kNoId;
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
    bool own_level = false;  // the level on which the keyframe observes the point
  };
  struct Match {
    Eigen::Vector2f pixel;  // in the keyframe that is searched
    MapPointId point;       // of the known place
  };
  std::vector<KeyFrameId> RankByThumbnail(const KeyFrame& keyframe, const std::set<KeyFrameId>& here,
                                          Neighbourhoods* neighbourhoods);
  // A place that resembles the keyframe.
  struct PlaceMatches {
    std::vector<KeyFrameId> group;  // keyframes of the place, the one most similar to the keyframe first
    std::vector<Match> matches;
  };
  std::vector<PlaceMatches> Compare(KeyFrameId keyframe, const std::set<KeyFrameId>& here,
                                    Neighbourhoods* neighbourhoods);
  void Describe(KeyFrameId keyframe, Map* map);
  void AddMatches(const std::vector<Described>& own, const std::vector<Described>& known,
                  std::vector<Match>* matches) const;

  const LoopCandidateSearchOptions options_;
  std::map<KeyFrameId, std::vector<Described>> described_;  // cache of the keyframes described so far
};

}  // namespace docent::engine
