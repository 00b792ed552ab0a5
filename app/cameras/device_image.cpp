// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/device_image.h"

#include <linux/videodev2.h>
#include <turbojpeg.h>

#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "engine/base/error.h"

namespace docent::app {

namespace {

struct DestroyDecoder {
  void operator()(void* handle) const { tjDestroy(handle); }
};

// A decoder serves one thread at a time and is expensive to create, so each thread keeps one.
tjhandle Decoder() {
  thread_local const std::unique_ptr<void, DestroyDecoder> decoder(tjInitDecompress());
  if (!decoder) throw Error("The JPEG decoder cannot be set up.");
  return decoder.get();
}

cv::Mat DecodeJpeg(std::span<const std::uint8_t> bytes, cv::Size size, const std::string& name) {
  const tjhandle decoder = Decoder();
  int width = 0, height = 0, subsampling = 0, colours = 0;
  const auto length = static_cast<unsigned long>(bytes.size());
  if (tjDecompressHeader3(decoder, bytes.data(), length, &width, &height, &subsampling, &colours) < 0) {
    throw Error(name + " is not a JPEG: " + tjGetErrorStr2(decoder) + ".");
  }
  if (cv::Size(width, height) != size) throw Error(name + " does not have the negotiated size.");
  const bool grey = subsampling == TJSAMP_GRAY;
  cv::Mat image(size, grey ? CV_8UC1 : CV_8UC3);
  // Without this flag a truncated image would be filled with grey, which would mislead the tracker.
  if (tjDecompress2(decoder, bytes.data(), length, image.data, width, static_cast<int>(image.step[0]), height,
                    grey ? TJPF_GRAY : TJPF_BGR, TJFLAG_STOPONWARNING) < 0) {
    throw Error(name + " cannot be decoded: " + tjGetErrorStr2(decoder) + ".");
  }
  return image;
}

}  // namespace

bool IsKnownPixelFormat(std::uint32_t pixel_format) {
  return pixel_format == V4L2_PIX_FMT_YUYV || pixel_format == V4L2_PIX_FMT_NV12 ||
         pixel_format == V4L2_PIX_FMT_MJPEG || pixel_format == V4L2_PIX_FMT_JPEG ||
         pixel_format == V4L2_PIX_FMT_GREY;
}

std::size_t RowBytes(std::uint32_t pixel_format, int width_px) {
  const auto width = static_cast<std::size_t>(width_px);
  if (pixel_format == V4L2_PIX_FMT_YUYV) return 2 * width;
  if (pixel_format == V4L2_PIX_FMT_NV12 || pixel_format == V4L2_PIX_FMT_GREY) return width;
  return 0;
}

cv::Mat ConvertDeviceImage(std::uint32_t pixel_format, std::span<const std::uint8_t> bytes, cv::Size size,
                           std::size_t stride_bytes, const std::string& name) {
  if (!IsKnownPixelFormat(pixel_format))
    throw Error(name + " has a pixel format that Docent does not support.");
  const std::size_t row_bytes = RowBytes(pixel_format, size.width);
  if (row_bytes == 0) return DecodeJpeg(bytes, size, name);
  const bool planar = pixel_format == V4L2_PIX_FMT_NV12;
  if (pixel_format != V4L2_PIX_FMT_GREY && (size.width % 2 != 0 || (planar && size.height % 2 != 0))) {
    throw Error(name + " has an odd size, which its pixel format does not allow.");
  }
  const int rows = planar ? size.height + size.height / 2 : size.height;
  if (stride_bytes < row_bytes ||
      bytes.size() < stride_bytes * static_cast<std::size_t>(rows - 1) + row_bytes) {
    throw Error(name + " has only " + std::to_string(bytes.size()) + " bytes.");
  }
  const cv::Mat wrapped(rows, size.width, pixel_format == V4L2_PIX_FMT_YUYV ? CV_8UC2 : CV_8UC1,
                        const_cast<std::uint8_t*>(bytes.data()), stride_bytes);
  cv::Mat image;
  if (pixel_format == V4L2_PIX_FMT_GREY) {
    image = wrapped.clone();
  } else {
    cv::cvtColor(wrapped, image, planar ? cv::COLOR_YUV2BGR_NV12 : cv::COLOR_YUV2BGR_YUY2);
  }
  return image;
}

}  // namespace docent::app
