// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

namespace docent::app {

// Whether ConvertDeviceImage supports this V4L2 pixel format: YUYV, NV12, Motion-JPEG (JPEG) or grey.
bool IsKnownPixelFormat(std::uint32_t pixel_format);
// Bytes of a row of the first plane without padding; 0 for compressed formats.
std::size_t RowBytes(std::uint32_t pixel_format, int width_px);

// Converts one device image to BGR or grey in a new buffer. The mapped memory is read only once, so it can be
// returned to the device immediately. `stride_bytes` is the distance between rows; the chroma plane of NV12
// follows the last row with the same stride. Motion-JPEG may omit its Huffman tables, as many cameras do, but
// must be complete. Any thread. Throws Error when there are too few bytes, the size differs, or the pixel
// format is not supported.
cv::Mat ConvertDeviceImage(std::uint32_t pixel_format, std::span<const std::uint8_t> bytes, cv::Size size,
                           std::size_t stride_bytes, const std::string& name);

}  // namespace docent::app
