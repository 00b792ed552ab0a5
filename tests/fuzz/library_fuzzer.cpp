// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>

#include "engine/base/error.h"
#include "maps/checksum.h"
#include "maps/envelope.h"
#include "maps/map_codec.h"

// Feeds the decoders of a library's binary columns. The first byte chooses the decoder; the rest is the
// records, put into an envelope whose magic and checksum are right, because what is behind them is to be
// reached. What is decoded must encode to the same bytes again: a decoder that ignores something would break
// that.
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

void Expect(bool condition) {
  if (!condition) std::abort();
}

void DecodeTable(int which, std::span<const std::uint8_t> records) {
  using namespace docent::maps;
  constexpr std::array kKinds = {kCameraTableKind, kKeyFrameTableKind, kPointTableKind,
                                 kObservationTableKind};
  const EnvelopeKind& kind = kKinds[static_cast<std::size_t>(which)];
  const Bytes bytes = Enveloped(kind, records.size() / kind.record_bytes, records);
  if (which == 0) {
    DecodeCameras(kMapKey, bytes);
  } else if (which == 1) {
    DecodeKeyFrames(kMapKey, bytes, OneCamera());
  } else if (which == 2) {
    Expect(EncodePoints(kMapKey, DecodePoints(kMapKey, bytes)) == bytes);
  } else {
    Expect(EncodeObservations(kMapKey, DecodeObservations(kMapKey, bytes)) == bytes);
  }
}

void DecodeOther(int which, std::span<const std::uint8_t> data) {
  using namespace docent::maps;
  if (which == 4 && data.size() >= 8) {
    std::uint64_t count = 0;
    std::memcpy(&count, data.data(), sizeof(count));
    const Bytes bytes = Enveloped(kSceneKind, count, data.subspan(8));
    Expect(EncodeScene(kMapKey, DecodeScene(kMapKey, bytes)) == bytes);
  } else if (which == 5) {
    StoredKeyFrame keyframe;
    keyframe.keyframe.id = 0;
    keyframe.keyframe.camera = OneCamera()[0];
    DecodePicture(kMapKey, keyframe, Enveloped(kPictureKind, 1, data));
  } else {
    DecodePoints(kMapKey, data);  // nothing made right: the envelope itself
    DecodeScene(kMapKey, data);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const int which = data[0] % 7;
  const std::span<const std::uint8_t> rest(data + 1, size - 1);
  try {
    if (which < 4) {
      DecodeTable(which, rest);
    } else {
      DecodeOther(which, rest);
    }
  } catch (const docent::Error&) {
    // The right answer to most inputs.
  }
  return 0;
}
