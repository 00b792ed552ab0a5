// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/decode_image.h"

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

constexpr std::size_t kMaxImageBytes = std::size_t{256} << 20;

bool StartsWith(std::span<const std::uint8_t> bytes, std::initializer_list<std::uint8_t> magic) {
  return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
}

// Whether the last `reach` bytes contain the end marker; some writers pad the end of a file.
bool EndsWithMark(std::span<const std::uint8_t> bytes, std::initializer_list<std::uint8_t> mark,
                  std::size_t reach) {
  const auto tail = bytes.last(std::min(bytes.size(), reach));
  return std::search(tail.begin(), tail.end(), mark.begin(), mark.end()) != tail.end();
}

bool IsCutOff(std::span<const std::uint8_t> bytes) {
  if (StartsWith(bytes, {0xFF, 0xD8})) return !EndsWithMark(bytes, {0xFF, 0xD9}, 4096);
  if (StartsWith(bytes, {0x89, 'P', 'N', 'G'})) return !EndsWithMark(bytes, {'I', 'E', 'N', 'D'}, 4096);
  return false;
}

cv::Mat Decode(std::span<const std::uint8_t> bytes, const std::string& name, int flags) {
  cv::Mat image;
  try {
    const cv::Mat wrapped(1, static_cast<int>(bytes.size()), CV_8UC1,
                          const_cast<std::uint8_t*>(bytes.data()));
    image = cv::imdecode(wrapped, flags);
  } catch (const cv::Exception& error) {
    throw Error(name + " cannot be decoded as an image: " + error.err + ".");
  }
  if (image.empty()) throw Error(name + " cannot be decoded as an image.");
  return image;
}

// 8, 10, 12, 14 or 16, which the largest value of a CV_16U image needs.
int BitsOf(const cv::Mat& image) {
  double largest = 0;
  cv::minMaxLoc(image.reshape(1), nullptr, &largest);
  int bits = 8;
  while (largest >= (1 << bits)) bits += 2;
  return bits;
}

// The upper 8 of `bits` bits of a CV_16U image.
cv::Mat UpperByteOf(const cv::Mat& image, int bits) {
  cv::Mat upper(image.size(), CV_MAKETYPE(CV_8U, image.channels()));
  for (int y = 0; y < image.rows; ++y) {
    const auto* const from = image.ptr<std::uint16_t>(y);
    auto* const to = upper.ptr<std::uint8_t>(y);
    for (int i = 0; i < image.cols * image.channels(); ++i)
      to[i] = static_cast<std::uint8_t>(from[i] >> (bits - 8));
  }
  return upper;
}

}  // namespace

cv::Mat DecodeImage(std::span<const std::uint8_t> bytes, const std::string& name, int* bits) {
  if (bytes.empty()) throw Error(name + " is empty; it contains no image.");
  if (IsCutOff(bytes)) throw Error(name + " is truncated before the end of its image.");
  int bits_of_image = 0;
  if (bits == nullptr) bits = &bits_of_image;
  constexpr int kAllBits = 16;
  if (*bits < kAllBits) {
    const cv::Mat image = Decode(bytes, name, cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH);
    if (image.depth() == CV_8U) return image;
    if (image.depth() == CV_16U) {
      *bits = std::max(*bits, BitsOf(image));
      if (*bits < kAllBits) return UpperByteOf(image, *bits);
    }
  }
  return Decode(bytes, name, cv::IMREAD_ANYCOLOR);
}

cv::Mat ReadImage(const std::filesystem::path& path, std::vector<std::uint8_t>* buffer, int* bits) {
  ReadBytes(path, kMaxImageBytes, buffer);
  return DecodeImage(*buffer, "'" + path.string() + "'", bits);
}

}  // namespace docent::app
