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

}  // namespace

cv::Mat DecodeImage(std::span<const std::uint8_t> bytes, const std::string& name) {
  if (bytes.empty()) throw Error(name + " is empty; it contains no image.");
  if (IsCutOff(bytes)) throw Error(name + " is truncated before the end of its image.");
  cv::Mat image;
  try {
    const cv::Mat wrapped(1, static_cast<int>(bytes.size()), CV_8UC1,
                          const_cast<std::uint8_t*>(bytes.data()));
    image = cv::imdecode(wrapped, cv::IMREAD_ANYCOLOR);
  } catch (const cv::Exception& error) {
    throw Error(name + " cannot be decoded as an image: " + error.err + ".");
  }
  if (image.empty()) throw Error(name + " cannot be decoded as an image.");
  return image;
}

cv::Mat ReadImage(const std::filesystem::path& path, std::vector<std::uint8_t>* buffer) {
  ReadBytes(path, kMaxImageBytes, buffer);
  return DecodeImage(*buffer, "'" + path.string() + "'");
}

}  // namespace docent::app
