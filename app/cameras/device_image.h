// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

namespace docent::app {

// Whether ConvertDeviceImage reads this V4L2 pixel format: YUYV, NV12, Motion-JPEG (JPEG) or grey.
bool IsKnownPixelFormat(std::uint32_t pixel_format);
// Bytes of a row of the first plane without padding; 0 for compressed formats.
std::size_t RowBytes(std::uint32_t pixel_format, int width_px);

// One image as the device delivered it, to BGR or grey in a buffer of its own, in one pass: the mapped
// memory is read once and can go back to the device at once. `stride_bytes` is the distance between rows; the
// chroma plane of NV12 follows the last row with the same stride. Motion-JPEG may leave its Huffman tables
// out, as many cameras do, but not its end. Any thread. Throws Error when there are too few bytes, the
// image is of another size, or the pixel format is none of these.
cv::Mat ConvertDeviceImage(std::uint32_t pixel_format, std::span<const std::uint8_t> bytes, cv::Size size,
                           std::size_t stride_bytes, const std::string& name);

}  // namespace docent::app
