// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/device_source.h"

#include <linux/videodev2.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "app/cameras/decode_picture.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

// In the order in which they are tried: YUYV costs no decoding, but the bus may be too narrow for it.
constexpr std::array<std::uint32_t, 3> kPixelFormats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG,
                                                        V4L2_PIX_FMT_GREY};
constexpr int kMaxPicturePixels = 1 << 28;

class DeviceSource : public FrameSource {
 public:
  DeviceSource(std::string path, const CameraOptions& options, std::unique_ptr<DeviceSystem> system)
      : path_(std::move(path)), timeout_(options.device_timeout), system_(std::move(system)) {
    info_.name = path_;
    info_.live = true;
    try {
      Open();
      NegotiateFormat(options.device_format);
      NegotiateRate(options.device_format.fps);
      StartStreaming();
    } catch (...) {
      Stop();  // the destructor of an object that was never complete does not run
      throw;
    }
  }
  ~DeviceSource() override { Stop(); }
  DeviceSource(const DeviceSource&) = delete;
  DeviceSource& operator=(const DeviceSource&) = delete;

  bool Next(engine::Frame* frame) override;

 private:
  struct MappedBuffer {
    void* memory = nullptr;
    std::size_t length_bytes = 0;
  };

  void Open();
  void NegotiateFormat(const DeviceFormat& wanted);
  void NegotiateRate(double fps);
  void StartStreaming();
  void Stop() noexcept;
  void WaitForPicture();
  std::optional<v4l2_buffer> Dequeue();
  void Requeue(v4l2_buffer* buffer);
  Timestamp TimeOf(const v4l2_buffer& buffer) const;
  [[noreturn]] void FailUnplugged() const {
    throw Error("The camera " + path_ + " was unplugged or stopped answering.");
  }
  [[noreturn]] void Fail(const std::string& what, int error) const {
    if (error == ENODEV || error == ENXIO) FailUnplugged();
    throw Error("The camera " + path_ + " " + what + ": " + std::strerror(error) + ".");
  }

  std::string path_;
  std::chrono::milliseconds timeout_;
  std::unique_ptr<DeviceSystem> system_;
  int file_ = -1;
  bool streaming_ = false;
  std::uint32_t pixel_format_ = 0;
  cv::Size size_;
  std::size_t stride_bytes_ = 0;
  std::vector<MappedBuffer> buffers_;
  std::uint64_t index_ = 0;
  std::optional<Timestamp> last_time_;
};

void DeviceSource::Open() {
  file_ = system_->Open(path_);
  if (file_ < 0) {
    if (errno == ENOENT)
      throw Error("There is no camera " + path_ + "; `docent cameras` lists those there are.");
    if (errno == EACCES) {
      throw Error("You may not open the camera " + path_ + "; ask for membership in the group 'video'.");
    }
    if (errno == EBUSY) throw Error("The camera " + path_ + " is in use by another program.");
    Fail("cannot be opened", errno);
  }
  v4l2_capability capability{};
  if (system_->Control(file_, VIDIOC_QUERYCAP, &capability) < 0)
    throw Error(path_ + " is not a video device.");
  const std::uint32_t can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                                  : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
    throw Error(path_ + " is a video device, but not one that streams pictures.");
  }
}

// Keeps the first pixel format that the device takes at the wanted size, or else the first it takes at all;
// with a size that was asked for and cannot be had, an Error.
void DeviceSource::NegotiateFormat(const DeviceFormat& wanted) {
  for (const std::uint32_t pixel_format : kPixelFormats) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = static_cast<std::uint32_t>(wanted.width_px > 0 ? wanted.width_px : 640);
    format.fmt.pix.height = static_cast<std::uint32_t>(wanted.height_px > 0 ? wanted.height_px : 480);
    format.fmt.pix.pixelformat = pixel_format;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (system_->Control(file_, VIDIOC_S_FMT, &format) < 0) {
      if (errno == EBUSY) throw Error("The camera " + path_ + " is in use by another program.");
      if (errno == ENODEV) FailUnplugged();
      continue;
    }
    const v4l2_pix_format& got = format.fmt.pix;
    if (got.pixelformat != pixel_format || got.width == 0 || got.height == 0) continue;
    if (static_cast<std::uint64_t>(got.width) * got.height > kMaxPicturePixels) continue;
    const cv::Size size(static_cast<int>(got.width), static_cast<int>(got.height));
    if (wanted.width_px > 0 && size != cv::Size(wanted.width_px, wanted.height_px)) continue;
    pixel_format_ = pixel_format;
    size_ = size;
    const std::size_t row = pixel_format == V4L2_PIX_FMT_YUYV ? got.width * std::size_t{2} : got.width;
    stride_bytes_ = std::max<std::size_t>(row, got.bytesperline);
    return;
  }
  throw Error(
      "The camera " + path_ + " offers no picture format that Docent reads (YUYV, Motion-JPEG or grey)" +
      (wanted.width_px > 0 ? " at " + std::to_string(wanted.width_px) + "x" + std::to_string(wanted.height_px)
                           : std::string()) +
      "; `docent cameras` lists what it offers.");
}

void DeviceSource::NegotiateRate(double fps) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (system_->Control(file_, VIDIOC_G_PARM, &parameters) < 0) return;  // the rate is the device's own affair
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  if (fps > 0 && (parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) != 0) {
    interval = {1000, static_cast<std::uint32_t>(std::lround(fps * 1000))};
    if (system_->Control(file_, VIDIOC_S_PARM, &parameters) < 0) Fail("refuses this picture rate", errno);
  }
  if (interval.numerator > 0 && interval.denominator > 0) {
    info_.nominal_fps = static_cast<double>(interval.denominator) / interval.numerator;
  }
}

void DeviceSource::StartStreaming() {
  v4l2_requestbuffers request{};
  request.count = 4;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (system_->Control(file_, VIDIOC_REQBUFS, &request) < 0) {
    if (errno == EBUSY) throw Error("The camera " + path_ + " is in use by another program.");
    Fail("gives no buffers", errno);
  }
  if (request.count < 2) throw Error("The camera " + path_ + " has no memory for its pictures.");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = i;
    if (system_->Control(file_, VIDIOC_QUERYBUF, &buffer) < 0) Fail("does not describe its buffers", errno);
    void* memory = system_->Map(file_, buffer.length, static_cast<long>(buffer.m.offset));
    if (!memory) Fail("does not share its buffers", errno);
    buffers_.push_back({memory, buffer.length});
    Requeue(&buffer);
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (system_->Control(file_, VIDIOC_STREAMON, &type) < 0) Fail("does not start", errno);
  streaming_ = true;
}

void DeviceSource::Stop() noexcept {
  if (streaming_) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    system_->Control(file_, VIDIOC_STREAMOFF, &type);  // a device that is gone may refuse; nothing is lost
    streaming_ = false;
  }
  for (const MappedBuffer& buffer : buffers_) system_->Unmap(buffer.memory, buffer.length_bytes);
  buffers_.clear();
  if (file_ >= 0) system_->Close(file_);
  file_ = -1;
}

void DeviceSource::WaitForPicture() {
  const int ready = system_->Wait(file_, static_cast<int>(timeout_.count()));
  if (ready < 0) Fail("cannot be waited for", errno);
  if (ready == 0) {
    throw Error("The camera " + path_ + " sent no picture for " + std::to_string(timeout_.count()) +
                " ms; is it covered by another program or asleep?");
  }
}

// Empty when the device had nothing after all.
std::optional<v4l2_buffer> DeviceSource::Dequeue() {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (system_->Control(file_, VIDIOC_DQBUF, &buffer) < 0) {
    if (errno == EAGAIN) return std::nullopt;
    Fail("stopped sending pictures", errno);
  }
  if (buffer.index >= buffers_.size())
    throw Error("The camera " + path_ + " answers with a buffer it never gave.");
  return buffer;
}

void DeviceSource::Requeue(v4l2_buffer* buffer) {
  if (system_->Control(file_, VIDIOC_QBUF, buffer) < 0) Fail("does not take its buffer back", errno);
}

// The driver's time, which a few drivers leave empty or repeat: then the time just after the one before.
Timestamp DeviceSource::TimeOf(const v4l2_buffer& buffer) const {
  const Timestamp told =
      std::chrono::seconds(buffer.timestamp.tv_sec) + std::chrono::microseconds(buffer.timestamp.tv_usec);
  if (!last_time_ || told > *last_time_) return told;
  return *last_time_ + FromSeconds(1 / info_.nominal_fps);
}

bool DeviceSource::Next(engine::Frame* frame) {
  // Cameras send a broken picture now and then, most of all while they start; many in a row are a fault.
  constexpr int kMaxBroken = 30;
  for (int broken = 0; broken < kMaxBroken;) {
    WaitForPicture();
    std::optional<v4l2_buffer> buffer = Dequeue();
    if (!buffer) continue;
    const MappedBuffer& mapped = buffers_[buffer->index];
    cv::Mat picture;
    if ((buffer->flags & V4L2_BUF_FLAG_ERROR) == 0) {
      const std::size_t used = std::min<std::size_t>(buffer->bytesused, mapped.length_bytes);
      try {
        picture = ConvertDevicePicture(pixel_format_, {static_cast<const std::uint8_t*>(mapped.memory), used},
                                       size_, stride_bytes_, "A picture of " + path_);
      } catch (const Error&) {
        picture.release();
      }
    }
    const Timestamp time = TimeOf(*buffer);
    Requeue(&*buffer);
    if (picture.empty()) {
      ++broken;
      continue;
    }
    last_time_ = time;
    frame->time = time;
    frame->index = index_++;
    frame->picture = std::move(picture);
    return true;
  }
  throw Error("The camera " + path_ +
              " sends nothing but broken pictures; try another cable, port or format.");
}

}  // namespace

cv::Mat ConvertDevicePicture(std::uint32_t pixel_format, std::span<const std::uint8_t> bytes, cv::Size size,
                             std::size_t stride_bytes, const std::string& name) {
  const auto wrap = [&](int type, std::size_t row_bytes) {
    if (stride_bytes < row_bytes ||
        bytes.size() < stride_bytes * static_cast<std::size_t>(size.height - 1) + row_bytes) {
      throw Error(name + " has only " + std::to_string(bytes.size()) + " bytes.");
    }
    return cv::Mat(size, type, const_cast<std::uint8_t*>(bytes.data()), stride_bytes);
  };
  const auto width = static_cast<std::size_t>(size.width);
  switch (pixel_format) {
    case V4L2_PIX_FMT_YUYV: {
      if (size.width % 2 != 0) throw Error(name + " has an odd width, which YUYV cannot have.");
      cv::Mat picture;
      cv::cvtColor(wrap(CV_8UC2, width * 2), picture, cv::COLOR_YUV2BGR_YUY2);
      return picture;
    }
    case V4L2_PIX_FMT_GREY:
      return wrap(CV_8UC1, width).clone();
    case V4L2_PIX_FMT_MJPEG: {
      cv::Mat picture = DecodePicture(bytes, name);
      if (picture.size() != size) throw Error(name + " is of another size than was agreed.");
      return picture;
    }
    default:
      throw Error(name + " is in a pixel format that Docent does not read.");
  }
}

std::unique_ptr<FrameSource> OpenDevice(const std::string& path, const CameraOptions& options,
                                        std::unique_ptr<DeviceSystem> system) {
  return std::make_unique<DeviceSource>(path, options, std::move(system));
}

}  // namespace docent::app
