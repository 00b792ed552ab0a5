// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/clipped_source.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

class ClippedSource : public FrameSource {
 public:
  ClippedSource(std::unique_ptr<FrameSource> source, Timestamp from, Timestamp until)
      : source_(std::move(source)), from_(from), until_(until) {
    info_ = source_->info();
    info_.frame_count.reset();  // Only known after reading all timestamps.
    if (info_.duration && from_ > *info_.duration) RefuseStart(*info_.duration);
  }

  bool Next(engine::Frame* frame) override {
    return NextInside(frame, [&] { return source_->Next(frame); });
  }
  bool NextLate(engine::Frame* frame) override {
    return NextInside(frame, [&] { return source_->NextLate(frame); });
  }
  std::optional<Timestamp> NextTime() const override { return source_->NextTime(); }
  std::string trouble() const override { return source_->trouble(); }
  Delivery delivery() const override { return source_->delivery(); }
  Head* head() const override { return source_->head(); }

 private:
  template <typename Fetch>
  bool NextInside(engine::Frame* frame, const Fetch& fetch) {
    for (bool skips = SkipsNext(); !ended_ && (skips ? source_->NextLate(frame) : fetch());
         skips = SkipsNext()) {
      if (frame->image.empty() && info_.live) return true;  // The device is disconnected.
      if (!first_) first_ = frame->time;
      const Timestamp since_first = frame->time - *first_;
      last_ = since_first;
      if (until_ > Timestamp{} && since_first >= until_) break;
      if (since_first < from_ || skips) continue;
      is_inside_ = true;
      return true;
    }
    const bool is_first_end = !std::exchange(ended_, true);
    if (is_first_end && !is_inside_ && last_ < from_) RefuseStart(last_);
    return false;
  }

  // Images before the interval are not decoded or rendered, or only those long before it if the time of the
  // next one is not known.
  bool SkipsNext() const {
    if (info_.live || !first_) return false;
    if (const std::optional<Timestamp> next = source_->NextTime()) return *next - *first_ < from_;
    const Timestamp gap = std::max<Timestamp>(std::chrono::seconds(1), FromSeconds(2 / info_.nominal_fps));
    return last_ + gap < from_;
  }

  [[noreturn]] void RefuseStart(Timestamp last) const {
    throw Error("--from " + FormatNumber(ToSeconds(from_)) + " is beyond the end of '" + info_.name +
                "', whose last image is at " + FormatNumber(ToSeconds(last), 6) + " s.");
  }

  std::unique_ptr<FrameSource> source_;
  Timestamp from_, until_;
  Timestamp last_{};        // Of the images so far, relative to the first one.
  bool is_inside_ = false;  // Whether an image of the interval was delivered.
  std::optional<Timestamp> first_;
  bool ended_ = false;
};

class WindowSource : public FrameSource {
 public:
  WindowSource(std::unique_ptr<FrameSource> source, std::uint64_t first_frame, Timestamp duration)
      : source_(std::move(source)), first_frame_(first_frame), duration_(duration) {
    info_ = source_->info();
    if (duration_ > Timestamp{}) {
      info_.frame_count.reset();
    } else if (info_.frame_count) {
      *info_.frame_count -= std::min(*info_.frame_count, first_frame_);
    }
  }

  bool Next(engine::Frame* frame) override {
    return NextInside(frame, [&] { return source_->Next(frame); });
  }
  bool NextLate(engine::Frame* frame) override {
    return NextInside(frame, [&] { return source_->NextLate(frame); });
  }
  std::optional<Timestamp> NextTime() const override { return source_->NextTime(); }
  std::string trouble() const override { return source_->trouble(); }
  Delivery delivery() const override { return source_->delivery(); }
  Head* head() const override { return source_->head(); }

 private:
  template <typename Fetch>
  bool NextInside(engine::Frame* frame, const Fetch& fetch) {
    if (ended_) return false;
    for (; skipped_ < first_frame_; ++skipped_) {
      if (!source_->NextLate(frame)) RefuseStart();
    }
    *frame = engine::Frame();  // Discards data of the skipped images.
    ended_ = !fetch();
    if (ended_ && !begin_) RefuseStart();
    if (ended_) return false;
    if (!begin_) begin_ = {frame->time, frame->index};
    ended_ = duration_ > Timestamp{} && frame->time - begin_->first >= duration_;
    frame->index -= begin_->second;
    return !ended_;
  }

  // Only its end tells how many images a video without times has.
  [[noreturn]] void RefuseStart() {
    ended_ = true;
    throw Error("No window can begin at image " + std::to_string(first_frame_) + " of '" + info_.name +
                "', counted from 0, because it has only " + std::to_string(skipped_) + " images.");
  }

  std::unique_ptr<FrameSource> source_;
  const std::uint64_t first_frame_;
  const Timestamp duration_;
  std::uint64_t skipped_ = 0;
  std::optional<std::pair<Timestamp, std::uint64_t>> begin_;  // Time and index of the first image.
  bool ended_ = false;
};

}  // namespace

std::unique_ptr<FrameSource> WindowOf(std::unique_ptr<FrameSource> source, std::uint64_t first_frame,
                                      Timestamp duration) {
  if (first_frame == 0 && duration <= Timestamp{}) return source;
  return std::make_unique<WindowSource>(std::move(source), first_frame, duration);
}

std::unique_ptr<FrameSource> ClipSource(std::unique_ptr<FrameSource> source, Timestamp from,
                                        Timestamp until) {
  if (from <= Timestamp{} && until <= Timestamp{}) return source;
  return std::make_unique<ClippedSource>(std::move(source), from, until);
}

}  // namespace docent::app
