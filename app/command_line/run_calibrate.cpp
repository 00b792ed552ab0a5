// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "app/calibration/calibrate.h"
#include "app/command_line/calibration_window.h"
#include "app/command_line/interruption.h"
#include "app/command_line/progress.h"
#include "app/command_line/runs.h"
#include "app/files/checked_file.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

// Views after which a live camera without a window stops; CalibrationOptions uses at most 30 of them.
constexpr std::size_t kMaxLiveViews = 40;

// Detects the board in each image and keeps views that differ from those kept before.
class ViewCollector {
 public:
  ViewCollector(const CalibrateOptions& options, const BoardSpec& board, FrameSource* source)
      : options_(options), detector_(board), source_(source) {}

  void Run(Progress* progress) {
    engine::Frame frame;
    while (!Interruption::requested() && source_->Next(&frame)) {
      if (frame.image.empty()) {
        shown_.message = source_->trouble();
        if (!Present()) return;
        continue;
      }
      shown_.image = frame.image;
      CheckSize();
      progress->Update(++images_);
      const BoardView before = std::exchange(
          shown_.now, detector_.Detect(shown_.image, options_.headless || !source_->info().live));
      if (!shown_.now.pixels.empty() && IsStill(before) && IsNewView(shown_.now, shown_.kept, size_.width))
        Keep();
      shown_.message = Message();
      if (!Present()) return;
      if (source_->info().live && options_.headless && shown_.kept.size() >= kMaxLiveViews) return;
    }
  }

  const std::vector<BoardView>& views() const { return shown_.kept; }
  cv::Size size() const { return size_; }
  std::uint64_t images() const { return images_; }

 private:
  void CheckSize() {
    if (!coverage_) {
      size_ = shown_.image.size();
      coverage_.emplace(size_.width, size_.height);
    }
    if (shown_.image.size() == size_) return;
    throw Error("The images of '" + source_->info().name +
                "' have different sizes; a calibration needs images of one size.");
  }
  // A live board must be held still for a moment, because motion blurs its corners and a rolling shutter
  // displaces them. Recorded images are all used.
  bool IsStill(const BoardView& before) const {
    constexpr double kMaxMovement = 0.003;  // Ratio of the image width.
    return !source_->info().live || Movement(before, shown_.now) < kMaxMovement * size_.width;
  }
  void Keep() {
    shown_.kept.push_back(shown_.now);
    coverage_->Add(shown_.now);
    constexpr std::size_t kSolveInterval = 4, kMinViews = 8;
    if (options_.headless || shown_.kept.size() < kMinViews || shown_.kept.size() % kSolveInterval != 0)
      return;
    solution_ = SolveLens(options_.lens.value_or(engine::LensModel::kKannalaBrandt), size_.width,
                          size_.height, shown_.kept);
    shown_.residuals.clear();
    if (solution_) shown_.residuals = Residuals(*solution_, shown_.kept);
  }
  std::string Message() const {
    const std::size_t count = shown_.kept.size();
    std::string text = std::to_string(count) + (count == 1 ? " view" : " views");
    if (solution_) text += ", error " + FormatNumber(solution_->rms_px, 2) + " px";
    if (shown_.now.pixels.empty()) return text + "; show the board";
    const std::string advice = coverage_->Advice();
    if (!advice.empty()) return text + "; " + advice;
    constexpr double kMaxFocalSigma = 0.001;
    if (!solution_ || solution_->FocalSigma() > kMaxFocalSigma)
      return text + "; tilt the board in all directions";
    return text + "; these views are sufficient; press Enter";
  }
  // Returns whether to go on. Throws Error if the person cancels.
  bool Present() {
    using Answer = CalibrationWindow::Answer;
    if (options_.headless || shown_.image.empty()) return true;
    if (!window_) window_.emplace(size_.width, size_.height);
    const Answer answer = window_->Show(shown_, *coverage_);
    if (answer == Answer::kCancel) throw Error("The calibration was cancelled; nothing was written.");
    return answer == Answer::kGoOn;
  }

  const CalibrateOptions& options_;
  const BoardDetector detector_;
  FrameSource* const source_;
  std::optional<CalibrationWindow> window_;
  std::optional<Coverage> coverage_;
  CalibrationWindow::Shown shown_;
  std::optional<LensSolution> solution_;
  cv::Size size_;
  std::uint64_t images_ = 0;
};

// Collects views until they are sufficient and computes the calibration. Throws Error.
Calibration CalibrateFrom(const CalibrateOptions& options, ViewCollector* collector, const SourceInfo& info,
                          Verbosity verbosity) {
  {
    Progress progress(info.name, info.frame_count, verbosity);
    collector->Run(&progress);
  }
  // A calibration from a part of the views must not replace an older, better one.
  if (Interruption::requested()) throw Error("Interrupted; nothing was written.");
  CalibrationOptions calibration_options;
  calibration_options.lens = options.lens;
  return Calibrate(collector->views(), collector->size().width, collector->size().height,
                   calibration_options);
}

}  // namespace

void RunCalibrate(const CalibrateOptions& options, Verbosity verbosity) {
  const BoardSpec board = ParseBoard(options.board);
  if (options.print) {
    PrintBoard(board, *options.print);
    if (verbosity != Verbosity::kQuiet) {
      std::printf("%s is in %s; print it at 100 %%.\n", FormatBoard(board).c_str(), options.print->c_str());
    }
  }
  if (options.source.empty()) return;
  const Interruption interruption;
  CameraOptions camera = options.camera;
  camera.reconnect = !options.headless;
  camera.lock_controls_after = kImagesUntilSettled;  // Automatic focus would change the lens between views.
  const auto source = OpenCamera(options.source, camera);
  // A file that cannot be written must not cost the views that a person has collected.
  if (std::filesystem::is_directory(options.output))
    throw Error("'" + options.output.string() + "' is a folder, not a file.");
  CheckedFile file(options.output);
  ViewCollector collector(options, board, source.get());
  Calibration calibration;
  try {
    calibration = CalibrateFrom(options, &collector, source->info(), verbosity);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(options.output.string() + ".part", ignored);
    throw;
  }
  file.Write(FormatCalibration(calibration, board));
  file.Close();
  if (verbosity == Verbosity::kQuiet) return;
  std::printf("%zu of %zu views from %llu images used, RMS error %.3f px\n%s\n", calibration.views_used,
              calibration.views_found, static_cast<unsigned long long>(collector.images()),
              calibration.rms_px, calibration.assessment.c_str());
}

}  // namespace docent::app
