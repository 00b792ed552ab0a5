// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/clipped_source.h"

#include <optional>
#include <utility>

namespace docent::app {

namespace {

class ClippedSource : public FrameSource {
 public:
  ClippedSource(std::unique_ptr<FrameSource> source, Timestamp from, Timestamp until)
      : source_(std::move(source)), from_(from), until_(until) {
    info_ = source_->info();
    info_.frame_count.reset();  // how many of them lie between is not known before they are read
  }

  bool Next(engine::Frame* frame) override {
    return NextInside(frame, [&] { return source_->Next(frame); });
  }
  bool NextLate(engine::Frame* frame) override {
    return NextInside(frame, [&] { return source_->NextLate(frame); });
  }
  std::string trouble() const override { return source_->trouble(); }
  Delivery delivery() const override { return source_->delivery(); }
  Head* head() const override { return source_->head(); }

 private:
  template <typename Fetch>
  bool NextInside(engine::Frame* frame, const Fetch& fetch) {
    while (!ended_ && fetch()) {
      if (frame->picture.empty() && info_.live) return true;  // a device that is away
      if (!first_) first_ = frame->time;
      const Timestamp since_first = frame->time - *first_;
      if (until_ > Timestamp{} && since_first >= until_) break;
      if (since_first >= from_) return true;
    }
    ended_ = true;
    return false;
  }

  std::unique_ptr<FrameSource> source_;
  Timestamp from_, until_;
  std::optional<Timestamp> first_;
  bool ended_ = false;
};

}  // namespace

std::unique_ptr<FrameSource> ClipSource(std::unique_ptr<FrameSource> source, Timestamp from,
                                        Timestamp until) {
  if (from <= Timestamp{} && until <= Timestamp{}) return source;
  return std::make_unique<ClippedSource>(std::move(source), from, until);
}

}  // namespace docent::app
