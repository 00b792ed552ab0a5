// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/device_source.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "app/cameras/device_image.h"
#include "app/cameras/device_stream.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

// Latencies of the last 128 images.
class LatencyWindow {
 public:
  void Add(Timestamp latency) { latencies_[count_++ % latencies_.size()] = latency; }
  Timestamp Median() const {
    std::array<Timestamp, kWindow> sorted = latencies_;
    const auto size = static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(count_, kWindow));
    if (size == 0) return {};
    std::nth_element(sorted.begin(), sorted.begin() + size / 2, sorted.begin() + size);
    return sorted[static_cast<std::size_t>(size / 2)];
  }

 private:
  static constexpr std::size_t kWindow = 128;
  std::array<Timestamp, kWindow> latencies_{};
  std::uint64_t count_ = 0;
};

class DeviceSource : public FrameSource {
 public:
  DeviceSource(std::string path, const CameraOptions& options, std::unique_ptr<DeviceSystem> system)
      : path_(std::move(path)), options_(options), system_(std::move(system)) {
    info_.name = path_;
    info_.live = true;
    stream_.emplace(path_, options_.device_format, system_.get());
    info_.nominal_fps = stream_->fps();
    size_ = stream_->size();
  }
  ~DeviceSource() override { Close(); }

  bool Next(engine::Frame* frame) override;
  std::string trouble() const override { return trouble_; }
  Delivery delivery() const override {
    Delivery delivery = delivery_;
    delivery.median_latency = latency_.Median();
    return delivery;
  }

 private:
  // Interval between two attempts to open a disconnected device.
  static constexpr std::chrono::milliseconds kRetry{200};

  void NextFromDevice(engine::Frame* frame);
  DeviceStream::Loan TakeNewest();
  void CountGap(const DeviceStream::Loan& loan);
  bool Deliver(DeviceStream::Loan loan, engine::Frame* frame);
  void Reopen();
  void Close();
  void ReleaseHead();

  const std::string path_;
  const CameraOptions options_;
  const std::unique_ptr<DeviceSystem> system_;
  std::optional<DeviceStream> stream_;  // Empty while the device is disconnected.
  cv::Size size_;                       // Negotiated when the device was first opened.
  std::optional<LockedControls> locked_;
  std::uint64_t since_opened_ = 0;  // Images delivered since the device was opened.
  bool is_reopened_ = false;        // And has delivered no image since.
  std::string trouble_;
  Delivery delivery_;
  LatencyWindow latency_;
  std::uint64_t index_ = 0;                     // Index of the next image that the device captures.
  std::optional<std::uint32_t> last_sequence_;  // Since the device was opened.
  std::optional<Timestamp> last_time_;
};

void DeviceSource::Close() {
  if (stream_ && locked_) UnlockControls(system_.get(), stream_->file(), *locked_);
  locked_.reset();
  stream_.reset();
  last_sequence_.reset();
  since_opened_ = 0;
}

void DeviceSource::ReleaseHead() {
  if (Head* const own = head()) own->Release();
}

// Gaps in the device's sequence numbers are images that it captured without a free buffer. A few drivers let
// the numbers jump, by more than a camera can lose before it counts as silent.
void DeviceSource::CountGap(const DeviceStream::Loan& loan) {
  const std::uint32_t sequence = loan.sequence();
  constexpr std::uint32_t kMostMissed = 10'000;
  if (last_sequence_ && sequence > *last_sequence_) {
    const std::uint32_t gap = sequence - *last_sequence_ - 1;
    if (gap <= kMostMissed) {
      delivery_.missed += gap;
      index_ += gap;
    }
  }
  last_sequence_ = sequence;
}

// Waits for an image, and skips all but the newest available one.
DeviceStream::Loan DeviceSource::TakeNewest() {
  for (;;) {
    if (!stream_->Wait(options_.device_timeout)) {
      throw DeviceGone("The camera " + path_ + " sent no image for " +
                       std::to_string(options_.device_timeout.count()) +
                       " ms; check the cable and that no other program uses the camera.");
    }
    std::optional<DeviceStream::Loan> newest = stream_->Take();
    if (!newest) continue;
    CountGap(*newest);
    // No more images can be available than there are buffers.
    for (std::size_t i = 1; i < stream_->buffer_count() && stream_->Wait(std::chrono::milliseconds(0)); ++i) {
      std::optional<DeviceStream::Loan> newer = stream_->Take();
      if (!newer) break;
      stream_->Return(&*newest);
      ++delivery_.late;
      ++index_;
      newest = newer;
      CountGap(*newest);
    }
    return *newest;
  }
}

// Converts the image into the frame. Returns false when the image is broken. Returns the buffer in any case.
bool DeviceSource::Deliver(DeviceStream::Loan loan, engine::Frame* frame) {
  cv::Mat image;
  if (!loan.broken()) {
    try {
      image = ConvertDeviceImage(stream_->pixel_format(), loan.bytes, size_, stream_->stride_bytes(),
                                 "An image of " + path_);
    } catch (const Error&) {
      image.release();
    }
  }
  const Timestamp stamp = stream_->TimeOf(loan);
  stream_->Return(&loan);
  const std::uint64_t index = index_++;
  if (image.empty()) {
    ++delivery_.broken;
    return false;
  }
  // A few drivers repeat a timestamp or go back in time.
  Timestamp time = stamp;
  if (last_time_ && time <= *last_time_) time = *last_time_ + FromSeconds(1 / info_.nominal_fps);
  last_time_ = time;
  // Timestamps that a driver computes instead of measuring may be in the future.
  latency_.Add(std::max(Timestamp{}, system_->Now() - stamp));
  frame->time = time;
  frame->index = index;
  frame->image = std::move(image);
  ++delivery_.delivered;
  ++since_opened_;
  // A camera that can be opened but sends nothing has not come back.
  if (std::exchange(is_reopened_, false)) ++delivery_.reconnections;
  return true;
}

void DeviceSource::NextFromDevice(engine::Frame* frame) {
  // Cameras occasionally deliver a broken image, especially while they start; many in a row are an error.
  constexpr int kMaxBroken = 30;
  for (int broken = 0; !Deliver(TakeNewest(), frame);) {
    if (++broken < kMaxBroken) continue;
    throw Error("The camera " + path_ + " delivers only broken images; try another cable, port or format.");
  }
  if (options_.lock_controls_after > 0 && !locked_ &&
      since_opened_ >= static_cast<std::uint64_t>(options_.lock_controls_after)) {
    locked_ = LockControls(system_.get(), stream_->file());
  }
}

void DeviceSource::Reopen() {
  try {
    DeviceFormat format = options_.device_format;
    format.width_px = size_.width;
    format.height_px = size_.height;
    stream_.emplace(path_, format, system_.get());
  } catch (const DeviceGone&) {
    return;  // The device is still disconnected.
  } catch (const Error& error) {
    trouble_ =
        error.what();  // Permissions are set shortly after a device appears, so a later attempt may succeed.
    return;
  }
  is_reopened_ = true;
  trouble_.clear();
}

bool DeviceSource::Next(engine::Frame* frame) {
  if (!stream_) {
    system_->Sleep(kRetry);
    ReleaseHead();  // A command for an image before the failure may have opened it again.
    Reopen();
  }
  if (stream_) {
    try {
      NextFromDevice(frame);
      return true;
    } catch (const DeviceGone& error) {
      Close();
      ReleaseHead();
      if (!options_.reconnect) throw;
      trouble_ = std::string(error.what()) + " Docent continues when it is connected again.";
    }
  }
  frame->time = system_->Now();
  frame->index = index_;
  frame->image.release();
  return true;
}

}  // namespace

std::unique_ptr<FrameSource> OpenDevice(const std::string& path, const CameraOptions& options,
                                        std::unique_ptr<DeviceSystem> system) {
  return std::make_unique<DeviceSource>(path, options, std::move(system));
}

}  // namespace docent::app
