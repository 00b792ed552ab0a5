// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "app/script/commands.h"
#include "app/session/guided_view.h"
#include "app/simulator/simulation.h"

namespace docent::app {

// Plays the author of a simulated museum: a map for each `buildK` part of the way, in it a model and a
// signpost where the simulation says that something is worth showing, and the end of the map with the end of
// the part. It remembers which point of the world each thing was put at. On the camera's thread.
class MuseumDirector {
 public:
  // The simulation must outlive the director. model_file: as the commands are to name it.
  MuseumDirector(const Simulation& simulation, std::string model_file);

  // What the author does on seeing this frame, in order; often nothing.
  std::vector<Command> Direct(const ShownFrame& frame);

  // The name of the map of place K.
  static std::string MapName(const std::string& place) { return "Bay " + place; }
  // The first frame that is not for building, or the number of frames.
  int first_visit_frame() const { return first_visit_frame_; }
  // Points of the world, by names of map and thing.
  using Truths = std::map<std::pair<std::string, std::string>, Eigen::Vector3d>;
  const Truths& truths() const { return truths_; }

 private:
  std::vector<Command> Furnish(const ShownFrame& frame, int index, const std::string& place);

  const Simulation& simulation_;
  const std::string model_file_;
  int first_visit_frame_ = 0;
  std::map<std::string, std::pair<int, int>> parts_;  // first and last frame of each label
  std::string building_;                              // the place whose map is open; empty for none
  bool furnished_ = false;
  Truths truths_;
};

// Compares where things are drawn with where the simulation sees the points that they were put at.
class DrawingCheck {
 public:
  DrawingCheck(const Simulation& simulation, MuseumDirector::Truths truths)
      : simulation_(simulation), truths_(std::move(truths)) {}

  void Add(const ShownFrame& frame);

  // Pixels from the truth, one a thing and frame in which both are in the image.
  const std::vector<double>& errors_px() const { return errors_px_; }
  // Frames of `visitK` parts; those that named a map; and those that named K's.
  int visit_frames() const { return visit_frames_; }
  int named() const { return named_; }
  int named_rightly() const { return named_rightly_; }

 private:
  const Simulation& simulation_;
  const MuseumDirector::Truths truths_;
  std::vector<double> errors_px_;
  int visit_frames_ = 0, named_ = 0, named_rightly_ = 0;
};

}  // namespace docent::app
