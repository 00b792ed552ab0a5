// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/source_with_size.h"

#include <optional>
#include <utility>

#include "engine/base/error.h"

namespace docent::app {

namespace {

class ReplayingSource : public FrameSource {
 public:
  ReplayingSource(std::unique_ptr<FrameSource> source, engine::Frame first)
      : source_(std::move(source)), first_(std::move(first)) {
    info_ = source_->info();
  }
  bool Next(engine::Frame* frame) override { return Replay(frame) || source_->Next(frame); }
  bool NextLate(engine::Frame* frame) override { return Replay(frame) || source_->NextLate(frame); }
  std::optional<Timestamp> NextTime() const override { return first_ ? first_->time : source_->NextTime(); }
  std::string trouble() const override { return source_->trouble(); }
  Delivery delivery() const override { return source_->delivery(); }
  Head* head() const override { return source_->head(); }

 private:
  bool Replay(engine::Frame* frame) {
    if (!first_) return false;
    frame->time = first_->time;
    frame->index = first_->index;
    frame->image = first_->image;
    first_.reset();
    return true;
  }

  const std::unique_ptr<FrameSource> source_;
  std::optional<engine::Frame> first_;
};

}  // namespace

SourceWithSize ReadSize(std::unique_ptr<FrameSource> source) {
  // A disconnected device returns an empty image a few times a second, so this takes some ten seconds.
  constexpr int kTries = 30;
  engine::Frame frame;
  for (int i = 0; i < kTries; ++i) {
    if (!source->Next(&frame)) break;
    if (frame.image.empty()) continue;
    const cv::Size size = frame.image.size();
    return {std::make_unique<ReplayingSource>(std::move(source), std::move(frame)), size};
  }
  throw Error("'" + source->info().name + "' delivers no image, so the image size is unknown.");
}

}  // namespace docent::app
