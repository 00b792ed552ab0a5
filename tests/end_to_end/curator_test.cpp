// SPDX-License-Identifier: Apache-2.0
// A curator furnishes three maps in the author's window by mouse and keyboard alone, and a visitor sees each
// thing where it belongs.
#include <gmock/gmock.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

#include "app/evaluation/simulated_truth.h"
#include "app/session/library_scene.h"
#include "content/scene.h"
#include "content/warp.h"
#include "tests/end_to_end/curator_window.h"
#include "tests/end_to_end/museum_places.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

constexpr const char* kCamera = "sim:museum:3";

// A point of the content, and where it belongs in the room.
struct PlacedPoint {
  std::string map, entity;
  std::optional<Eigen::Vector3d> in_model;  // Model axes, metres; empty: the place of the entity.
  Eigen::Vector3d in_world;
};

// Distances between where things are and where they belong.
struct Errors {
  double sum_px = 0;
  int count = 0;
  void Add(double error_px) {
    sum_px += error_px;
    ++count;
  }
  double mean_px() const { return count > 0 ? sum_px / count : 1e9; }
};

class CuratorAtWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("DOCENT_LONG_TESTS") == nullptr)
      GTEST_SKIP() << "this test takes minutes at a window; set DOCENT_LONG_TESTS to run it";
    window_.emplace(folder_.path());
    if (const std::string missing = window_->MissingTool(); !missing.empty()) GTEST_SKIP() << missing;
    segments_ = SegmentsOf(*simulation_);
  }

  std::string library() const { return (folder_ / "museum.docent").string(); }
  // The time at which a segment of the camera's way begins or ends, for --from and --until.
  std::string BeginOf(const std::string& label) const { return TimeOf(label, 0); }
  std::string EndOf(const std::string& label) const { return TimeOf(label, 1); }
  std::string TimeOf(const std::string& label, std::size_t after) const {
    for (std::size_t i = 0; i + after < segments_.size(); ++i) {
      if (segments_[i].label == label) return FormatSeconds(segments_[i + after].time - simulation_->time(0));
    }
    return FormatSeconds(simulation_->time(simulation_->frame_count() - 1) - simulation_->time(0) +
                         std::chrono::seconds(1));
  }

  // Opens the library for a segment of the camera's way, whose first image waits.
  void Open(const std::string& segment) {
    std::vector<std::string> arguments = {"author", "--library", library(),     "--camera", kCamera,
                                          "--pace", "eager",     "--occlusion", "off",      "--sound",
                                          "off",    "--until",   EndOf(segment)};
    if (segment != "build0") arguments.insert(arguments.end(), {"--from", BeginOf(segment)});
    window_->Open(arguments, folder_ / ("author-" + segment));
  }
  // Waits for the last image and freezes the view.
  void AwaitLastImage() {
    const std::string event = window_->WaitForEvent("The images have ended");
    frame_ = FrameAt(*simulation_, event.substr(0, event.find(',')));
    ASSERT_GE(frame_, 0) << event;
    window_->Key("f");
    window_->WaitForText("The view is frozen");
    good_places_ = GoodPlaces(*simulation_, frame_);
    ASSERT_GE(good_places_.size(), 8u);
  }
  // Builds a map of a bay by its part of the camera's way.
  void BuildMap(const std::string& name, const std::string& segment) {
    Open(segment);
    window_->ClickText("Name of the new map");
    window_->Type(name);
    window_->Key("Return");
    window_->WaitForEvent("map new");
    map_ = name;
    AwaitLastImage();
  }

  // The point of the window that is nearest to a place, and what the camera saw there.
  MuseumPlace AtWindow(const MuseumPlace& place, cv::Point* point) const {
    *point = CuratorWindow::PointOf(place.pixel);
    const Eigen::Vector2d pixel = CuratorWindow::PixelOf(*point);
    return {pixel, *simulation_->SurfaceAt(frame_, pixel)};
  }
  // Clicks a place and returns where it is in the room.
  Eigen::Vector3d ClickPlace(const MuseumPlace& place) {
    cv::Point point;
    const MuseumPlace clicked = AtWindow(place, &point);
    window_->Click(point);
    return clicked.in_world;
  }
  // Drags a file to a place and remembers the place for what is named so.
  void DropAt(const std::filesystem::path& file, const MuseumPlace& place, const std::string& event) {
    cv::Point point;
    const MuseumPlace dropped = AtWindow(place, &point);
    window_->Drop(file, point);
    window_->WaitForEvent(event);
    Remember(file.stem().string(), dropped.in_world);
  }
  void Remember(const std::string& entity, const Eigen::Vector3d& in_world) {
    placed_.push_back({map_, entity, std::nullopt, in_world});
  }

  // A place with room for a model above it.
  const MuseumPlace& MiddlePlace() const {
    constexpr double kLow = 200, kMiddle = 320;
    return *std::min_element(good_places_.begin(), good_places_.end(), [](const auto& a, const auto& b) {
      const auto distance = [](const MuseumPlace& place) {
        return std::abs(place.pixel.x() - kMiddle) + (place.pixel.y() < kLow ? 1000 : 0);
      };
      return distance(a) < distance(b);
    });
  }
  // Drags a model to the window and brings it into place by its marks: roughly, while it is small and a click
  // on it is worth several pixels of the room, and then exactly, with this button.
  void FitModel(const std::string& name, const std::vector<Eigen::Vector3d>& marks,
                const std::vector<MuseumPlace>& places, const std::string& button) {
    const std::vector<std::uint8_t> glb = MarksGlb(marks);
    const auto file = folder_.Write(name + ".glb", {glb.begin(), glb.end()});
    const cv::Mat before = window_->Capture();
    const int actions = window_->actions();
    window_->Drop(file, CuratorWindow::PointOf(MiddlePlace().pixel));
    window_->WaitForEvent("place /");
    ASSERT_NO_FATAL_FAILURE(PairMarks(before, places));
    window_->ClickText("Fit", 5);
    window_->WaitForEvent("align ");
    // As docs/authoring-tasks.md counts them: the file, and a button, each point and its place, and a button.
    EXPECT_EQ(window_->actions() - actions, 1 + 1 + 2 * static_cast<int>(marks.size()) + 1);
    window_->ClickText("Done", 5);
    ASSERT_NO_FATAL_FAILURE(PairMarks(before, places));
    window_->ClickText(button, 5);
    window_->WaitForEvent(button == "Fit" ? "align " : "bend ", button == "Fit" ? 2 : 1);
    window_->ClickText("Done", 5);
    for (std::size_t i = 0; i < marks.size(); ++i) {
      cv::Point point;
      placed_.push_back({map_, name, marks[i], AtWindow(places[i], &point).in_world});
    }
  }

  // Clicks each mark of the selected model and then where it belongs. `before`: the window without the model.
  void PairMarks(const cv::Mat& before, const std::vector<MuseumPlace>& places) {
    window_->ClickText("Fit by points");
    window_->WaitForText("Click a point on the object.");
    std::vector<std::optional<cv::Point2d>> seen(places.size());
    const bool all_seen = window_->Wait("the marks of the model", [&] {
      const cv::Mat now = window_->Capture();
      for (std::size_t i = 0; i < seen.size(); ++i) seen[i] = FindNewColor(before, now, MarkColors()[i]);
      return std::all_of(seen.begin(), seen.end(), [](const auto& point) { return point.has_value(); });
    });
    ASSERT_TRUE(all_seen);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      // The middle of a pixel of the screen lies half a unit beyond the point of the window with its index.
      window_->Click(*seen[i] + cv::Point2d(0.5, 0.5));
      window_->WaitForText("Now click the place");
      ClickPlace(places[i]);
      window_->WaitForText("Click a point on the object.");
    }
  }

  // Chooses a tool that has a text, and writes it into the field above this text of the panel.
  void WriteText(const std::string& key, const std::string& below, int above_px, const std::string& text) {
    window_->Key(key);
    const auto place = window_->WaitForText(below);
    if (!place) return;
    window_->Click(*place - cv::Point(0, above_px));
    window_->Type(text);
  }

  // What `docent content list` says of a map: the names.
  std::vector<std::string> Listed(const std::string& map) const {
    const Outcome outcome = RunDocent({"content", "list", "--json", "--library", library(), "--map", map});
    std::vector<std::string> names;
    if (outcome.exit_status != 0) return {outcome.errors};
    const nlohmann::json list = nlohmann::json::parse(outcome.output);
    for (const auto& entry : list.at("content")) names.push_back(entry.at("name"));
    return names;
  }
  // Saves, and waits until the library has this content.
  void SaveAndExpect(const std::string& map, const std::vector<std::string>& names) {
    window_->ControlKey("s");
    window_->Wait("the saved content: " + testing::PrintToString(names),
                  [&] { return Listed(map) == names; });
  }

  void FurnishElephants();
  void FurnishMasks();
  void FurnishLions();
  void UndoInAnotherSession();
  std::string Tour();
  std::map<std::string, Errors> Measure(const std::filesystem::path& output);

  const TemporaryFolder folder_;
  const std::unique_ptr<Simulation> simulation_ = MakeSimulation("museum:3");
  std::vector<TimedLabel> segments_;
  std::optional<CuratorWindow> window_;
  std::string map_;  // The current one.
  int frame_ = -1;   // That of the frozen view.
  std::vector<MuseumPlace> good_places_;
  std::vector<PlacedPoint> placed_;
};

// A model is fitted by three points, and a label says something about a place.
void CuratorAtWindow::FurnishElephants() {
  ASSERT_NO_FATAL_FAILURE(BuildMap("Elephants", "build0"));
  const std::vector<MuseumPlace> places = Spread(good_places_, 3);
  ASSERT_NO_FATAL_FAILURE(FitModel("vase", ScanOf(*simulation_, frame_, places), places, "Fit"));
  WriteText("4", "Write its text first.", 31, "Asian elephant");
  window_->WaitForText("Click on what the label is about.");
  Remember("label-1", ClickPlace(good_places_[1]));
  window_->WaitForEvent("label ");
  window_->Key("1");
  SaveAndExpect("Elephants", {"vase", "label-1"});
  EXPECT_EQ(window_->Quit(), 0);
}

// A model that was measured badly is bent, and an image hangs on a wall.
void CuratorAtWindow::FurnishMasks() {
  ASSERT_NO_FATAL_FAILURE(BuildMap("Masks", "build1"));
  const std::vector<MuseumPlace> places = Spread(good_places_, 4);
  std::vector<Eigen::Vector3d> marks = ScanOf(*simulation_, frame_, places);
  const double error = 0.12 * (marks[1] - marks[0]).norm();
  marks[0] += error * Eigen::Vector3d(1, 0.3, 0);
  marks[3] += error * Eigen::Vector3d(-0.4, 0.6, 0.5);
  ASSERT_NO_FATAL_FAILURE(FitModel("mask", marks, places, "Bend to fit"));
  cv::imwrite((folder_ / "poster.png").string(), cv::Mat(64, 48, CV_8UC3, cv::Scalar(0, 140, 255)));
  DropAt(folder_ / "poster.png", good_places_[1], "image /");
  SaveAndExpect("Masks", {"mask", "poster"});
  EXPECT_EQ(window_->Quit(), 0);
}

// A signpost leads to another map, and a sound is heard; everything is undone and done again.
void CuratorAtWindow::FurnishLions() {
  ASSERT_NO_FATAL_FAILURE(BuildMap("Lions", "build2"));
  const int actions = window_->actions();
  WriteText("3", "(nowhere)", 42, "To the elephants");
  window_->ClickText("(nowhere)");
  window_->ClickText("Elephants");
  window_->WaitForText("Click in the image to place the");
  Remember("sign-1", ClickPlace(good_places_[0]));
  window_->WaitForEvent("signpost ");
  EXPECT_EQ(window_->actions() - actions, 6) << "as docs/authoring-tasks.md counts them";
  window_->Key("1");
  DropAt(folder_.Write("roar.wav", ToneWav()), good_places_[2], "sound /");
  SaveAndExpect("Lions", {"sign-1", "roar"});
  window_->ControlKey("z");
  window_->WaitForEvent("command,undo", 1);
  window_->ControlKey("z");
  window_->WaitForEvent("command,undo", 2);
  SaveAndExpect("Lions", {});
  window_->ControlKey("y");
  window_->WaitForEvent("command,redo", 1);
  window_->ControlKey("y");
  window_->WaitForEvent("command,redo", 2);
  SaveAndExpect("Lions", {"sign-1", "roar"});
  EXPECT_EQ(window_->Quit(), 0);
}

// Comes back to the lions another day, when the camera recognizes them, and undoes what was done before.
void CuratorAtWindow::UndoInAnotherSession() {
  Open("visit2");
  window_->Key("space");
  window_->WaitForEvent("entered Lions");
  window_->WaitForEvent("The images have ended");
  window_->ControlKey("z");
  window_->WaitForEvent("command,undo", 1);
  SaveAndExpect("Lions", {"sign-1"});
  window_->ControlKey("z");
  window_->WaitForEvent("command,undo", 2);
  SaveAndExpect("Lions", {});
  window_->ControlKey("y");
  window_->WaitForEvent("command,redo", 1);
  window_->ControlKey("y");
  window_->WaitForEvent("command,redo", 2);
  SaveAndExpect("Lions", {"sign-1", "roar"});
  EXPECT_EQ(window_->Quit(), 0);
}

// Visits all maps with a library that stays as it is; returns the folder with the results.
std::string CuratorAtWindow::Tour() {
  const std::string before = ReadAll(library()), output = (folder_ / "tour").string();
  const Outcome toured = RunDocent({"tour", "--library", library(), "--camera", kCamera, "--from",
                                    BeginOf("visit1"), "--headless", "--occlusion", "off", "--output", output,
                                    "--record", (folder_ / "tour.mp4").string()});
  EXPECT_EQ(toured.exit_status, 0) << toured.errors;
  EXPECT_EQ(before, ReadAll(library())) << "a tour changes nothing";
  return output;
}

// The pose in a row of frames.csv.
engine::Rigid3 CameraFromMapOf(const Row& row) {
  const auto number = [&](const char* column) { return *ParseNumber(row.at(column)); };
  const Eigen::Quaterniond rotation(number("qw"), number("qx"), number("qy"), number("qz"));
  const engine::Rigid3 map_from_camera(engine::Rotation3(rotation),
                                       Eigen::Vector3d(number("tx"), number("ty"), number("tz")));
  return map_from_camera.inverse();
}

// Where a point of the content is in its map.
Eigen::Vector3d InMap(const PlacedPoint& placed, const content::Entity& entity) {
  if (!placed.in_model) return content::PlaceOf(entity);
  const content::PlacedModel& model = entity.model;
  return model.map_from_model * (model.warp ? (*model.warp)(*placed.in_model) : *placed.in_model);
}

// The pixels in augmentations.csv, by time and name.
std::map<std::pair<std::string, std::string>, Eigen::Vector2d> LoggedPixels(
    const std::filesystem::path& file) {
  std::map<std::pair<std::string, std::string>, Eigen::Vector2d> pixels;
  for (const Row& row : ReadFrames(file))
    pixels[{row.at("timestamp"), row.at("name")}] = {*ParseNumber(row.at("u")), *ParseNumber(row.at("v"))};
  return pixels;
}

// More than half a mark in the images of the tour.
constexpr int kMarkReach_px = 60;
// The first row of the images of the tour that the sentence for visitors may cover.
constexpr int kSentence_px = 400;

// The middle of what has this colour around a pixel.
std::optional<Eigen::Vector2d> FindMark(const cv::Mat& image, const Eigen::Vector2d& near,
                                        const cv::Scalar& color) {
  constexpr int kSide_px = 2 * kMarkReach_px + 1;
  const cv::Rect around = cv::Rect(static_cast<int>(near.x()) - kMarkReach_px,
                                   static_cast<int>(near.y()) - kMarkReach_px, kSide_px, kSide_px) &
                          cv::Rect(0, 0, image.cols, image.rows);
  const cv::Mat part = image(around);
  const auto found = FindNewColor(cv::Mat(part.size(), CV_8UC3, cv::Scalar::all(128)), part, color);
  if (!found) return std::nullopt;
  return Eigen::Vector2d(found->x + around.x, found->y + around.y);
}

// How far from its true place each thing is in the images of a tour, by name. What is "drawn" is found in the
// recorded video.
std::map<std::string, Errors> CuratorAtWindow::Measure(const std::filesystem::path& output) {
  const maps::Library library = OpenLibrary(this->library(), maps::Access::kReadOnly);
  AssetCache assets;
  std::map<std::string, content::Scene> scenes;
  for (const maps::MapInfo& info : library.List())
    scenes[info.name] = SceneFromRecord(library.LoadScene(info.key), info.name, &assets);
  const auto logged = LoggedPixels(output / "augmentations.csv");
  const engine::CameraModel& lens = simulation_->camera();
  std::map<std::string, Errors> errors;
  cv::VideoCapture video((folder_ / "tour.mp4").string());
  cv::Mat image;
  for (const Row& row : ReadFrames(output / "frames.csv")) {
    video.read(image);
    const int frame = FrameAt(*simulation_, row.at("timestamp"));
    std::size_t mark = 0;
    for (const PlacedPoint& placed : placed_) {
      const std::size_t number = placed.entity == "vase" ? mark++ : 0;
      if (frame < 0 || placed.map != row.at("map")) continue;
      const auto truth = lens.Project(simulation_->world_from_camera(frame).inverse() * placed.in_world);
      if (!truth || !lens.IsInside(*truth, 30)) continue;
      const content::Entity& entity = *scenes.at(placed.map).Find(placed.entity);
      const auto seen = lens.Project(CameraFromMapOf(row) * InMap(placed, entity));
      errors[placed.entity].Add(seen ? (*seen - *truth).norm() : 640);
      if (const auto found = logged.find({row.at("timestamp"), placed.entity});
          found != logged.end() && !content::HasModel(entity))
        errors[placed.entity + " (logged)"].Add((found->second - *truth).norm());
      if (placed.entity != "vase" || image.empty() || !lens.IsInside(*truth, kMarkReach_px)) continue;
      if (truth->y() + kMarkReach_px > kSentence_px) continue;
      if (const auto drawn = FindMark(image, *truth, MarkColors()[number]))
        errors[placed.entity + " (drawn)"].Add((*drawn - *truth).norm());
    }
  }
  return errors;
}

TEST_F(CuratorAtWindow, FurnishesThreeMapsThatAVisitorSeesInTheirPlaces) {
  ASSERT_NO_FATAL_FAILURE(FurnishElephants());
  ASSERT_NO_FATAL_FAILURE(FurnishMasks());
  ASSERT_NO_FATAL_FAILURE(FurnishLions());
  ASSERT_NO_FATAL_FAILURE(UndoInAnotherSession());
  if (HasFailure()) return;
  const nlohmann::json list =
      nlohmann::json::parse(RunDocent({"content", "list", "--json", "--library", library()}).output);
  for (const auto& entry : list.at("content")) {
    if (entry.at("name") == "sign-1") {
      EXPECT_EQ(entry.at("to_map"), "Elephants");
    }
    if (entry.at("kind") == "model") {
      EXPECT_EQ(entry.at("bent"), entry.at("name") == "mask") << entry;
    }
  }
  const std::filesystem::path output = Tour();
  std::map<std::string, Errors> errors = Measure(output);
  for (const char* name : {"vase", "vase (drawn)", "label-1", "label-1 (logged)", "mask", "poster", "sign-1",
                           "sign-1 (logged)", "roar"}) {
    EXPECT_GE(errors[name].count, 20) << name;
    EXPECT_LT(errors[name].mean_px(), 3) << name;
    std::printf("%s: mean error %.2f px in %d images\n", name, errors[name].mean_px(), errors[name].count);
  }
  EXPECT_THAT(ReadAll(output / "events.csv"), HasSubstr(",sound,'roar' begins"));
}

}  // namespace
}  // namespace docent::app
