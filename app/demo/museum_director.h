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

// Acts as the author of a simulated museum: starts a map for each `buildK` part of the trajectory, places a
// model and a signpost at the place given by the simulation, and stops the map at the end of the part.
// Records the world point at which each object was placed. All members are called on the camera's thread.
class MuseumDirector {
 public:
  // The simulation must outlive the director. model_file: the file name used in the commands.
  MuseumDirector(const Simulation& simulation, std::string model_file);

  // Returns the author's commands for this frame, in order; often none.
  std::vector<Command> Direct(const ShownFrame& frame);

  // Name of the map of a place.
  static std::string MapName(const std::string& place) { return "Bay " + place; }
  // First frame of the visit, or the number of frames if there is none.
  int first_visit_frame() const { return first_visit_frame_; }
  // World points, by name of map and name of object.
  using Truths = std::map<std::pair<std::string, std::string>, Eigen::Vector3d>;
  const Truths& truths() const { return truths_; }

 private:
  std::vector<Command> PlaceContent(const ShownFrame& frame, int index, const std::string& place);

  const Simulation& simulation_;
  const std::string model_file_;
  int first_visit_frame_ = 0;
  std::map<std::string, std::pair<int, int>> parts_;  // First and last frame of each label.
  std::string building_;                              // Place whose map is being built; empty for none.
  bool content_placed_ = false;
  Truths truths_;
};

// Compares the pixels at which objects are drawn with the true pixels of the points they were placed at.
class DrawingCheck {
 public:
  DrawingCheck(const Simulation& simulation, MuseumDirector::Truths truths)
      : simulation_(simulation), truths_(std::move(truths)) {}

  void Add(const ShownFrame& frame);

  // Distances between drawn and true pixel, one for each object and frame in which both are in the image.
  const std::vector<double>& errors_px() const { return errors_px_; }
  // Number of frames of `visitK` parts, of those tracked in any map, and of those tracked in the map of place
  // K.
  int visit_frames() const { return visit_frames_; }
  int recognized() const { return recognized_; }
  int recognized_correctly() const { return recognized_correctly_; }

 private:
  const Simulation& simulation_;
  const MuseumDirector::Truths truths_;
  std::vector<double> errors_px_;
  int visit_frames_ = 0, recognized_ = 0, recognized_correctly_ = 0;
};

}  // namespace docent::app
