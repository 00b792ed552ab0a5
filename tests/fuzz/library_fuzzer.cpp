// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <span>

#include "engine/base/error.h"
#include "maps/index/thumbnail_rows.h"
#include "maps/index/word_rows.h"
#include "maps/storage/checksum.h"
#include "maps/storage/envelope.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/mesh_rows.h"
#include "maps/storage/panorama_codec.h"
#include "tests/fuzz/allocation_limit.h"

// Feeds the decoders of a library's binary columns. The first byte chooses the decoder. The rest are the
// records, put into an envelope with a valid magic number and checksum, so that the input reaches the record
// decoder. The decoded data must encode to the same bytes again, so that no decoder can ignore part of its
// input. No allocation may be larger than four times the column's bytes or a small fixed overhead.
namespace {

using docent::maps::Bytes;

constexpr std::uint64_t kMapKey = 7;

docent::maps::CameraTable OneCamera() {
  docent::engine::CameraModel::Intrinsics intrinsics{64, 64, 60, 60, 32, 32};
  return {std::make_shared<const docent::engine::CameraModel>(docent::engine::LensModel::kRadialTangential,
                                                              intrinsics, std::array<double, 5>{})};
}

Bytes Enveloped(const docent::maps::EnvelopeKind& kind, std::uint64_t count,
                std::span<const std::uint8_t> records) {
  docent::maps::ByteWriter writer = docent::maps::BeginEnvelope(kind, kMapKey, count);
  writer.PutBytes(records);
  return docent::maps::FinishEnvelope(std::move(writer));
}

// An error message, for which a stream first allocates 513 bytes; and zlib's workspace, including its window
// of 32 KiB.
constexpr std::size_t kFixedOverhead = 1024, kImageWorkspace = 40 << 10;

// Runs a decoder whose allocations are limited to four times its input or `at_least`.
template <typename Decode>
auto Limited(std::size_t bytes, std::size_t at_least, const Decode& decode) {
  const AllocationLimit limit(std::max(4 * bytes, at_least));
  return decode();
}

void Expect(bool condition) {
  if (!condition) std::abort();
}

// The number of records: those of cameras with the motion of a rolling shutter, which a bit of their first
// byte says, have five more numbers.
std::size_t CountCameras(std::span<const std::uint8_t> records) {
  constexpr std::size_t kWithoutMotion = 81, kWithMotion = kWithoutMotion + 5 * sizeof(double);
  constexpr std::uint8_t kHasMotion = 0x80;
  std::size_t count = 0;
  for (std::size_t at = 0; at < records.size(); ++count)
    at += (records[at] & kHasMotion) != 0 ? kWithMotion : kWithoutMotion;
  return count;
}

void DecodeTable(int which, std::span<const std::uint8_t> records) {
  using namespace docent::maps;
  constexpr std::array kKinds = {kCameraTableKind, kKeyFrameTableKind, kPointTableKind,
                                 kObservationTableKind};
  const EnvelopeKind& kind = kKinds[static_cast<std::size_t>(which)];
  const std::size_t count =
      kind.record_bytes > 0 ? records.size() / kind.record_bytes : CountCameras(records);
  const Bytes bytes = Enveloped(kind, count, records);
  if (which == 0) {
    Limited(bytes.size(), kFixedOverhead, [&] { return DecodeCameras(kMapKey, bytes); });
  } else if (which == 1) {
    const CameraTable cameras = OneCamera();
    Limited(bytes.size(), kFixedOverhead, [&] { return DecodeKeyFrames(kMapKey, bytes, cameras); });
  } else if (which == 2) {
    const auto decoded = Limited(bytes.size(), kFixedOverhead, [&] { return DecodePoints(kMapKey, bytes); });
    Expect(EncodePoints(kMapKey, decoded) == bytes);
  } else {
    const auto decoded =
        Limited(bytes.size(), kFixedOverhead, [&] { return DecodeObservations(kMapKey, bytes); });
    Expect(EncodeObservations(kMapKey, decoded) == bytes);
  }
}

void DecodeOther(int which, std::span<const std::uint8_t> data) {
  using namespace docent::maps;
  if (which == 4 && data.size() >= 8) {
    std::uint64_t count = 0;
    std::memcpy(&count, data.data(), sizeof(count));
    const Bytes bytes = Enveloped(kSceneKind, count, data.subspan(8));
    const auto decoded = Limited(bytes.size(), kFixedOverhead, [&] { return DecodeScene(kMapKey, bytes); });
    Expect(EncodeScene(kMapKey, decoded) == bytes);
  } else if (which == 7 && data.size() >= 8) {
    std::uint64_t count = 0;
    std::memcpy(&count, data.data(), sizeof(count));
    const Bytes bytes = Enveloped(kThumbnailTableKind, count, data.subspan(8));
    const auto decoded =
        Limited(bytes.size(), kFixedOverhead, [&] { return DecodeThumbnails(kMapKey, bytes); });
    Expect(EncodeThumbnails(kMapKey, decoded) == bytes);
  } else if (which == 8 && data.size() >= 8) {
    std::uint64_t count = 0;
    std::memcpy(&count, data.data(), sizeof(count));
    MapParts parts;
    for (std::uint32_t id = 0; id < 8; ++id) {
      parts.keyframes.push_back({});
      parts.keyframes.back().keyframe.id = id;
      parts.points.push_back({});
      parts.points.back().id = id;
    }
    const Bytes bytes = Enveloped(kPanoramaTableKind, count, data.subspan(8));
    Limited(bytes.size(), kFixedOverhead, [&] { DecodePanoramas(kMapKey, bytes, &parts); });
  } else if (which == 9 && data.size() >= 8) {
    std::uint64_t count = 0;
    std::memcpy(&count, data.data(), sizeof(count));
    const Bytes bytes = Enveloped(kWordTableKind, count, data.subspan(8));
    const auto decoded = Limited(bytes.size(), kFixedOverhead, [&] { return DecodeWords(kMapKey, bytes); });
    Expect(EncodeWords(kMapKey, decoded) == bytes);
  } else if (which == 10 && data.size() >= 8) {
    std::uint64_t count = 0;
    std::memcpy(&count, data.data(), sizeof(count));
    const Bytes bytes = Enveloped(kMeshKind, count, data.subspan(8));
    const auto decoded = Limited(bytes.size(), kFixedOverhead, [&] { return DecodeMesh(kMapKey, bytes); });
    // Positions are rounded again, so that only the triangles are the same.
    const Bytes again = EncodeMesh(kMapKey, decoded);
    Expect(DecodeMesh(kMapKey, again).mesh.triangles == decoded.mesh.triangles);
  } else if (which == 5) {
    StoredKeyFrame keyframe;
    keyframe.keyframe.id = 0;
    keyframe.keyframe.camera = OneCamera()[0];
    const Bytes bytes = Enveloped(kImageKind, 1, data);
    Limited(bytes.size(), kImageWorkspace, [&] { return DecodeImage(kMapKey, keyframe, bytes); });
  } else {
    DecodePoints(kMapKey, data);  // without a valid envelope, to test the envelope itself
    DecodeScene(kMapKey, data);
  }
}

}  // namespace

// OpenCV registers its image decoders when it decodes the first image, which allocates memory.
extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", cv::Mat(8, 8, CV_8UC1, cv::Scalar(0)), png);
  cv::imdecode(png, cv::IMREAD_GRAYSCALE);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const int which = data[0] % 11;
  const std::span<const std::uint8_t> rest(data + 1, size - 1);
  try {
    if (which < 4) {
      DecodeTable(which, rest);
    } else {
      DecodeOther(which, rest);
    }
  } catch (const docent::Error&) {
    // An error is the expected result for most inputs.
  }
  return 0;
}
