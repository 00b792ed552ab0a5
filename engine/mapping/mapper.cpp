// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/mapper.h"

#include <algorithm>
#include <optional>
#include <variant>

#include "engine/base/option_check.h"
#include "engine/base/processor_time.h"

namespace docent::engine {

namespace {

// Moves the images of a request to the store (may be null).
void StoreImages(ImageStore* store, MapperQueue::Request* request) {
  if (!store) return;
  const auto keep = [&](std::shared_ptr<const ImageFeatures>* features) {
    *features = store->Store(std::move(*features));
  };
  if (auto* candidate = std::get_if<KeyFrameCandidate>(request)) {
    keep(&candidate->features);
    return;
  }
  if (auto* pair = std::get_if<InitialPair>(request)) {
    keep(&pair->a.features);
    keep(&pair->b.features);
  }
}

}  // namespace

Mapper::Mapper(const MapperOptions& options)
    : options_(Checked(options)),
      queue_(options.max_queue),
      output_(options.lens.lenses),
      workspace_(options.search),
      loops_(options.loops, options.search),
      lens_estimation_(options.lens),
      refinement_(options_, queue_.interrupt(), &workspace_, &output_),
      panoramas_(options_, &workspace_, &output_, &refinement_, &loops_),
      insertion_(options_, &lens_estimation_, &workspace_, &output_, &refinement_, &panoramas_, &loops_),
      creation_(options_, &lens_estimation_, &workspace_, &output_, &refinement_, &panoramas_, &loops_) {}

void Mapper::ResumeFrom(const MapSnapshot* snapshot) {
  workspace_.Reset(snapshot ? Map(*snapshot) : Map());
  loops_.Reset();
  lens_estimation_.Reset();
  refinement_.Reset();
  panoramas_.Reset();
}

void Mapper::FixKeyFrames() {
  for (auto& [id, record] : workspace_.map.keyframes()) record.keyframe.fixed = true;
}

void Mapper::RemoveOldTemporaryKeyFrames() {
  Map& map = workspace_.map;
  auto temporary = static_cast<std::size_t>(
      std::ranges::count_if(map.keyframes(), [](const auto& entry) { return !entry.second.keyframe.fixed; }));
  if (temporary <= options_.max_temporary_keyframes) return;
  const KeyFrameId newest = map.keyframes().rbegin()->first;
  for (; temporary > options_.max_temporary_keyframes; --temporary)
    CullKeyFrame(FindOldestKeyFrame(newest, map), &map);
  workspace_.searcher.Clear();
  output_.Publish(map.Snapshot());
}

void Mapper::Adopt(std::shared_ptr<const MapSnapshot> snapshot) {
  ResumeFrom(snapshot.get());
  refinement_.ForgetReadouts();
  if (options_.temporary) FixKeyFrames();
  queue_.Clear();
  output_.Publish(std::move(snapshot));
}

MapJoinAttempt Mapper::Join(const MapSnapshot& other, const std::atomic<bool>* interrupt) {
  const double start = ProcessorSeconds();
  queue_.BeginOtherWork();
  // Frees memory as before a global adjustment, since this one involves two maps.
  workspace_.searcher.Release();
  if (options_.images) options_.images->EvictAll();
  MapJoinAttempt attempt = JoinMaps(options_.joining, *workspace_.map.Snapshot(), other, interrupt);
  if (attempt.joined) ResumeFrom(attempt.joined->map.get());
  output_.AddTime(&MapperTimes::other, ProcessorSeconds() - start, queue_.EndWork());
  if (attempt.joined) output_.Publish(attempt.joined->map);
  return attempt;
}

MapJoinAttempt Mapper::Join(const MapComparison& comparison, const std::atomic<bool>* interrupt) {
  const double start = ProcessorSeconds();
  queue_.BeginOtherWork();
  MapJoinAttempt attempt = JoinCompared(options_.joining, comparison, *output_.Snapshot(), interrupt);
  if (attempt.joined) {
    ResumeFrom(attempt.joined->map.get());
    refinement_.RequireAdjustmentOfLoop();
  }
  output_.AddTime(&MapperTimes::other, ProcessorSeconds() - start + comparison.seconds, queue_.EndWork());
  if (attempt.joined) output_.Publish(attempt.joined->map);
  return attempt;
}

bool Mapper::Step() {
  const double start = ProcessorSeconds();
  double MapperTimes::*account = &MapperTimes::other;
  if (refinement_.IsAdjustmentOverdue()) {
    queue_.BeginOtherWork();
    account = DoNextTask();
  } else if (auto request = queue_.BeginStep()) {
    Serve(*std::move(request));
  } else {
    account = DoNextTask();
  }
  output_.AddTime(account, ProcessorSeconds() - start, queue_.EndWork());
  return account != nullptr;
}

void Mapper::Serve(MapperQueue::Request request) {
  StoreImages(options_.images.get(), &request);
  if (const auto* pair = std::get_if<InitialPair>(&request)) {
    creation_.CreateFromPair(*pair);
    return;
  }
  if (const auto* corners = std::get_if<TrackedCorners>(&request)) {
    refinement_.EstimateReadout(*corners);
    return;
  }
  const auto& candidate = std::get<KeyFrameCandidate>(request);
  const bool empty = workspace_.map.empty();
  if (candidate.choice == KeyFrameChoice::kFirst) {
    if (empty) creation_.CreateFromPanorama(candidate);
  } else if (!empty) {
    insertion_.Insert(candidate, queue_.TakeReports());
    if (options_.temporary) RemoveOldTemporaryKeyFrames();
  }
}

double MapperTimes::*Mapper::DoNextTask() {
  if (refinement_.HasNewPoints()) {
    refinement_.MatchNewPoints();
    return &MapperTimes::other;
  }
  if (!refinement_.IsLocallyAdjusted()) {
    refinement_.AdjustAroundNewest();
    return &MapperTimes::bundle_adjustment;
  }
  if (options_.temporary) return panoramas_.ConvertOne() ? &MapperTimes::infinite_triangulation : nullptr;
  if (loops_.HasLoop() && WorkOnLoops()) return &MapperTimes::loop_closing;
  if (EstimateLenses()) return &MapperTimes::bundle_adjustment;
  // New points keep the camera tracked, so they come before keyframes that could not be localized so far.
  if (panoramas_.LocalizeNew()) return &MapperTimes::panorama_localization;
  if (panoramas_.ConvertOne()) return &MapperTimes::infinite_triangulation;
  if (panoramas_.LocalizeAgain()) return &MapperTimes::panorama_localization;
  if (refinement_.NeedsGlobalAdjustment()) {
    refinement_.AdjustWholeMap();
    return &MapperTimes::bundle_adjustment;
  }
  if (refinement_.MayHaveRedundantKeyFrames()) {
    refinement_.CullRedundantKeyFrame();
    return &MapperTimes::other;
  }
  if (WorkOnLoops()) return &MapperTimes::loop_closing;
  CheckGivenCalibrations();
  return nullptr;
}

bool Mapper::WorkOnLoops() {
  switch (loops_.Step(&workspace_.map)) {
    case LoopCloser::Progress::kNothing:
      return false;
    case LoopCloser::Progress::kWorked:
      break;
    case LoopCloser::Progress::kMoved: {
      workspace_.searcher.Clear();
      output_.Publish(workspace_.map.Snapshot());
      const ClosedLoop& loop = loops_.last();
      output_.AddEvent(workspace_.map.FindKeyFrame(loop.keyframe)->keyframe.time,
                       MapperEvent::LoopClosed{loop});
      output_.CountLoop();
      break;
    }
    case LoopCloser::Progress::kFused:
      refinement_.RequireAdjustmentOfLoop();
      output_.Publish(workspace_.map.Snapshot());
      break;
  }
  return true;
}

bool Mapper::EstimateLenses() {
  const LensEstimation::Progress progress =
      lens_estimation_.Step(&workspace_.searcher, queue_.interrupt(), &workspace_.map);
  if (progress == LensEstimation::Progress::kNothing) return false;
  if (progress == LensEstimation::Progress::kStepDone) return true;
  output_.SetLenses(lens_estimation_.lenses());
  if (progress == LensEstimation::Progress::kMapChanged) {
    workspace_.searcher.Clear();
    refinement_.RequireGlobalAdjustment();
    output_.Publish(workspace_.map.Snapshot());
  }
  output_.AddEvent(workspace_.NewestTime(), MapperEvent::LensesEstimated{});
  return true;
}

// The check never changes the map, so lockstep runs do not depend on whether it was finished.
void Mapper::CheckGivenCalibrations() {
  if (workspace_.map.empty()) return;
  if (const auto contradiction = lens_estimation_.Check(queue_.interrupt(), workspace_.map))
    output_.AddEvent(workspace_.NewestTime(), MapperEvent::CalibrationContradicted{*contradiction});
}

}  // namespace docent::engine
