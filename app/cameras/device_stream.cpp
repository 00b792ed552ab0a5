// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/device_stream.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <limits>
#include <system_error>

#include "app/cameras/device_image.h"
#include "app/cameras/device_source.h"

namespace docent::app {

namespace {

// In order of preference: the first two need no decoding, but the bus may be too slow for them.
constexpr std::array<std::uint32_t, 5> kPixelFormats = {
    V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_NV12, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_JPEG, V4L2_PIX_FMT_GREY};
constexpr std::uint64_t kMaxImagePixels = 1 << 28;
constexpr double kDefaultFps = 30;

}  // namespace

DeviceStream::DeviceStream(const std::string& path, const DeviceFormat& wanted, DeviceSystem* system)
    : path_(path), system_(system) {
  try {
    Open();
    NegotiateFormat(wanted);
    NegotiateRate(wanted.fps);
    StartStreaming();
  } catch (...) {
    Stop();  // The destructor does not run when the constructor throws.
    throw;
  }
}

void DeviceStream::Fail(const std::string& what, int error, const std::string& advice) const {
  if (error == ENODEV || error == ENXIO) {
    throw DeviceGone("The camera " + path_ + " was unplugged or stopped answering.");
  }
  if (error == EBUSY) throw Error("The camera " + path_ + " is in use by another program.");
  throw Error("The camera " + path_ + " " + what + ": " + std::generic_category().message(error) + "; " +
              advice + ".");
}

void DeviceStream::Open() {
  file_ = system_->Open(path_);
  if (file_ < 0) {
    if (errno == ENOENT)
      throw DeviceGone("There is no camera " + path_ + "; `docent cameras` lists the available ones.");
    if (errno == EACCES)
      throw Error("You do not have permission to open the camera " + path_ + "; " + PermissionAdvice());
    Fail("cannot be opened", errno);
  }
  v4l2_capability capability{};
  if (system_->Control(file_, VIDIOC_QUERYCAP, &capability) < 0) {
    if (errno == ENODEV) Fail("", errno);
    throw Error(path_ + " is not a video device.");
  }
  const std::uint32_t can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                                  : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
    throw Error(path_ + " is a video device, but it does not stream images.");
  }
}

// Asks the device for a pixel format at the wanted size. Returns the format that the device chose; empty when
// it does not support the request.
std::optional<v4l2_pix_format> DeviceStream::RequestFormat(unsigned long request, std::uint32_t pixel_format,
                                                           const DeviceFormat& wanted) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(wanted.width_px > 0 ? wanted.width_px : 640);
  format.fmt.pix.height = static_cast<std::uint32_t>(wanted.height_px > 0 ? wanted.height_px : 480);
  format.fmt.pix.pixelformat = pixel_format;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (system_->Control(file_, request, &format) < 0) {
    if (errno == EBUSY || errno == ENODEV) Fail("", errno);
    return std::nullopt;
  }
  const v4l2_pix_format& got = format.fmt.pix;
  if (got.pixelformat != pixel_format || got.width == 0 || got.height == 0) return std::nullopt;
  if (static_cast<std::uint64_t>(got.width) * got.height > kMaxImagePixels) return std::nullopt;
  const bool as_wanted =
      static_cast<int>(got.width) == wanted.width_px && static_cast<int>(got.height) == wanted.height_px;
  if (wanted.width_px > 0 && !as_wanted) return std::nullopt;
  return got;
}

// Selects the first pixel format that reaches the wanted rate at the wanted size, or else the fastest one.
void DeviceStream::NegotiateFormat(const DeviceFormat& wanted) {
  const double required_fps = 0.99 * (wanted.fps > 0 ? wanted.fps : kDefaultFps);
  std::uint32_t chosen = 0;
  double chosen_fps = 0;
  for (const std::uint32_t pixel_format : kPixelFormats) {
    if (wanted.pixel_format != 0 && wanted.pixel_format != pixel_format) continue;
    const auto offer = RequestFormat(VIDIOC_TRY_FMT, pixel_format, wanted);
    if (!offer) continue;
    const std::vector<double> rates = DeviceRates(
        system_, file_, pixel_format, static_cast<int>(offer->width), static_cast<int>(offer->height));
    // A device that lists no rates uses its own rate for every format.
    const double fps = rates.empty() ? std::numeric_limits<double>::max() : rates.front();
    if (chosen_fps < required_fps && fps > chosen_fps) {
      chosen = pixel_format;
      chosen_fps = fps;
    }
  }
  const auto got = chosen != 0 ? RequestFormat(VIDIOC_S_FMT, chosen, wanted) : std::nullopt;
  if (!got) {
    throw Error("The camera " + path_ +
                " offers no image format that Docent supports (YUYV, NV12, Motion-JPEG or grey)" +
                (wanted.width_px > 0
                     ? " at " + std::to_string(wanted.width_px) + "x" + std::to_string(wanted.height_px)
                     : std::string()) +
                "; `docent cameras` lists its formats.");
  }
  pixel_format_ = chosen;
  size_ = cv::Size(static_cast<int>(got->width), static_cast<int>(got->height));
  stride_bytes_ = std::max<std::size_t>(RowBytes(chosen, size_.width), got->bytesperline);
}

void DeviceStream::NegotiateRate(double fps) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (system_->Control(file_, VIDIOC_G_PARM, &parameters) < 0) return;  // The device does not report a rate.
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  if ((parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) != 0) {
    const double wanted = fps > 0 ? fps : kDefaultFps;
    interval = {1000, static_cast<std::uint32_t>(std::lround(wanted * 1000))};
    // A failure only matters if a rate was requested.
    if (system_->Control(file_, VIDIOC_S_PARM, &parameters) < 0 && fps > 0)
      Fail("rejects this frame rate", errno, "`docent cameras` lists its rates");
  }
  if (interval.numerator > 0 && interval.denominator > 0) {
    fps_ = static_cast<double>(interval.denominator) / interval.numerator;
  }
}

void DeviceStream::StartStreaming() {
  v4l2_requestbuffers request{};
  request.count = 4;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (system_->Control(file_, VIDIOC_REQBUFS, &request) < 0) Fail("provides no buffers", errno);
  if (request.count < 2)
    throw Error("The camera " + path_ + " has no memory for its images; " + kReplug + ".");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    Loan loan;
    v4l2_buffer& buffer = loan.buffer;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = i;
    if (system_->Control(file_, VIDIOC_QUERYBUF, &buffer) < 0) Fail("does not describe its buffers", errno);
    void* memory = system_->Map(file_, buffer.length, static_cast<long>(buffer.m.offset));
    if (!memory) Fail("does not share its buffers", errno);
    buffers_.push_back({memory, buffer.length});
    Return(&loan);
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (system_->Control(file_, VIDIOC_STREAMON, &type) < 0) Fail("does not start", errno);
  streaming_ = true;
}

void DeviceStream::Stop() noexcept {
  if (streaming_) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    system_->Control(file_, VIDIOC_STREAMOFF,
                     &type);  // May fail for a disconnected device, which does not matter.
    streaming_ = false;
  }
  for (const MappedBuffer& buffer : buffers_) system_->Unmap(buffer.memory, buffer.length_bytes);
  buffers_.clear();
  if (file_ >= 0) system_->Close(file_);
  file_ = -1;
}

bool DeviceStream::Wait(std::chrono::milliseconds timeout) {
  const int ready = system_->Wait(file_, static_cast<int>(timeout.count()));
  if (ready < 0) Fail("cannot be waited for", errno);
  return ready > 0;
}

std::optional<DeviceStream::Loan> DeviceStream::Take() {
  Loan loan;
  loan.buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  loan.buffer.memory = V4L2_MEMORY_MMAP;
  if (system_->Control(file_, VIDIOC_DQBUF, &loan.buffer) < 0) {
    if (errno == EAGAIN) return std::nullopt;
    Fail("stopped sending images", errno);
  }
  if (loan.buffer.index >= buffers_.size())
    throw Error("The camera " + path_ + " returned an unknown buffer; " + kReplug + ".");
  const MappedBuffer& mapped = buffers_[loan.buffer.index];
  loan.bytes = {static_cast<const std::uint8_t*>(mapped.memory),
                std::min<std::size_t>(loan.buffer.bytesused, mapped.length_bytes)};
  return loan;
}

void DeviceStream::Return(Loan* loan) {
  if (system_->Control(file_, VIDIOC_QBUF, &loan->buffer) < 0)
    Fail("does not accept a returned buffer", errno);
}

Timestamp DeviceStream::TimeOf(const Loan& loan) const {
  const v4l2_buffer& buffer = loan.buffer;
  const std::uint32_t clock = buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK;
  if (clock != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) return system_->Now();
  return std::chrono::seconds(buffer.timestamp.tv_sec) + std::chrono::microseconds(buffer.timestamp.tv_usec);
}

}  // namespace docent::app
