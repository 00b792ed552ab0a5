// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/map_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "maps/index/thumbnail_rows.h"
#include "maps/storage/checksum.h"
#include "maps/storage/envelope.h"
#include "maps/storage/panorama_codec.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::HasSubstr;

std::span<const std::uint8_t> AsBytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// Writes `value` at `offset` and updates the checksum, as a forger would.
template <typename Number>
Bytes Forged(Bytes bytes, std::size_t offset, Number value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(value));
  const std::uint64_t checksum = Checksum(std::span(bytes).first(bytes.size() - 8));
  std::memcpy(bytes.data() + bytes.size() - 8, &checksum, 8);
  return bytes;
}

TEST(Checksum, MatchesPublishedValuesOfXxh64) {
  EXPECT_EQ(Checksum({}), 0xEF46DB3751D8E999ull);
  EXPECT_EQ(Checksum(AsBytes("a")), 0xD24EC4F1A98C6E5Bull);
  EXPECT_EQ(Checksum(AsBytes("abc")), 0x44BC2CF5AD770999ull);
  EXPECT_EQ(Checksum(AsBytes("Nobody inspects the spammish repetition")), 0xFBCEA83C8A378BF1ull);
}

TEST(MapCodec, EveryFlippedBitOfATableIsDetected) {
  const auto map = MakeSampleMap(1, {.keyframes = 2, .points = 3});
  const Bytes points = EncodePoints(7, map->points);
  for (std::size_t bit = 0; bit < points.size() * 8; ++bit) {
    Bytes damaged = points;
    damaged[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    EXPECT_THROW(DecodePoints(7, damaged), Error) << bit;
  }
  for (std::size_t size = 0; size < points.size(); ++size) {
    EXPECT_THROW(DecodePoints(7, std::span(points).first(size)), Error) << size;
  }
  EXPECT_THAT(ErrorOf([&] { DecodePoints(8, points); }), HasSubstr("belongs to another map"));
  EXPECT_THAT(ErrorOf([&] { DecodeObservations(7, points); }), HasSubstr("its header is not valid"));
}

TEST(MapCodec, ACountMustMatchTheNumberOfBytes) {
  const Bytes points = EncodePoints(7, MakeSampleMap(1)->points);
  for (const std::uint64_t count :
       {std::uint64_t{0}, std::uint64_t{41}, std::uint64_t{1} << 60, ~std::uint64_t{0}}) {
    EXPECT_THAT(ErrorOf([&] { DecodePoints(7, Forged(points, 16, count)); }), HasSubstr("its header gives"));
  }
  const Bytes scene = EncodeScene(7, {"text", {"a", "b"}});
  EXPECT_THROW(DecodeScene(7, Forged(scene, 16, ~std::uint64_t{0})), Error);
  EXPECT_THROW(DecodeScene(7, Forged(scene, 24, ~std::uint32_t{0})), Error);
}

TEST(MapCodec, ReturnsTheRollingShutterOfEachImage) {
  const auto camera = MakeCameraTable(MakeStoredKeyFrames(*MakeSampleMap(1))).front();
  const auto image = [&](double rate, double readout_s) {
    return std::make_shared<const engine::CameraModel>(
        engine::CameraModel::WithReadout(camera, {{rate, -0.25, 1.5}, {0, readout_s}}));
  };
  const CameraTable cameras = {image(0.5, 0.02), camera, image(-0.5, 0.02)};
  const Bytes bytes = EncodeCameras(7, cameras);
  const CameraTable read = DecodeCameras(7, bytes);
  ASSERT_EQ(read.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(*read[i] == *cameras[i]) << i;
  EXPECT_EQ(read[0]->lens_of_image(), read[2]->lens_of_image()) << "two images of one camera";
  EXPECT_EQ(EncodeCameras(7, {camera}).size(), EncodeCameras(7, {image(0.5, 0)}).size())
      << "without a readout time there is no rolling shutter to store";

  EXPECT_THROW(EncodeCameras(7, {image(0.5, 2)}), Error) << "what could not be read is not written";
  constexpr std::size_t kRate = 24 + 81;  // of the first camera
  EXPECT_THAT(ErrorOf([&] { DecodeCameras(7, Forged(bytes, kRate, std::nan(""))); }),
              HasSubstr("rolling shutter"));
  EXPECT_THAT(ErrorOf([&] { DecodeCameras(7, Forged(bytes, kRate, 1e9)); }), HasSubstr("rolling shutter"));
  for (const std::uint64_t count : {std::uint64_t{1}, std::uint64_t{4}, ~std::uint64_t{0}})
    EXPECT_THROW(DecodeCameras(7, Forged(bytes, 16, count)), Error) << count;
}

TEST(MapCodec, ForgedNumbersOfCamerasAndKeyframesAreRejected) {
  const auto keyframes = MakeStoredKeyFrames(*MakeSampleMap(1));
  const CameraTable cameras = MakeCameraTable(keyframes);
  const Bytes camera_bytes = EncodeCameras(7, cameras);
  EXPECT_EQ(DecodeCameras(7, camera_bytes).size(), 2u);
  EXPECT_THAT(ErrorOf([&] { DecodeCameras(7, Forged(camera_bytes, 24, std::uint8_t{3})); }),
              HasSubstr("lens"));
  EXPECT_THAT(ErrorOf([&] { DecodeCameras(7, Forged(camera_bytes, 25, std::uint32_t{1} << 31)); }),
              HasSubstr("impossible image size"));
  EXPECT_THROW(DecodeCameras(7, Forged(camera_bytes, 33, std::nan(""))), Error);
  EXPECT_THROW(DecodeCameras(7, Forged(camera_bytes, 33, -1.0)), Error);
  const Bytes bytes = EncodeKeyFrames(7, keyframes, cameras);
  EXPECT_EQ(DecodeKeyFrames(7, bytes, cameras).size(), 3u);
  EXPECT_THAT(ErrorOf([&] { DecodeKeyFrames(7, Forged(bytes, 28, std::uint8_t{2}), cameras); }),
              HasSubstr("kind"));
  EXPECT_THAT(ErrorOf([&] { DecodeKeyFrames(7, Forged(bytes, 29, std::uint8_t{2}), cameras); }),
              HasSubstr("flags"));
  EXPECT_THAT(ErrorOf([&] { DecodeKeyFrames(7, Forged(bytes, 30, std::uint32_t{2}), cameras); }),
              HasSubstr("camera"));
  EXPECT_THAT(ErrorOf([&] { DecodeKeyFrames(7, Forged(bytes, 42, 5.0), cameras); }), HasSubstr("rotation"));
  EXPECT_THAT(ErrorOf([&] { DecodeKeyFrames(7, Forged(bytes, 42, std::nan("")), cameras); }),
              HasSubstr("rotation"));
}

TEST(MapCodec, AnImageOfAnotherSizeOrContentIsRejected) {
  const auto map = MakeSampleMap(1);
  const auto keyframes = MakeStoredKeyFrames(*map);
  const Bytes bytes = EncodeImage(7, 0, map->keyframes[0].features->levels[0]);
  EXPECT_EQ(ImageHash(DecodeImage(7, keyframes[0], bytes)), keyframes[0].image_hash);
  EXPECT_THAT(ErrorOf([&] { DecodeImage(7, keyframes[1], bytes); }),
              HasSubstr("belongs to another keyframe"));
  const std::size_t width_at = kEnvelopeBytes - 8 + 4 + 16;
  EXPECT_THAT(
      ErrorOf([&] { DecodeImage(7, keyframes[0], Forged(bytes, width_at, std::uint32_t{0xFFFFFF7F})); }),
      HasSubstr("camera's size"));
  StoredKeyFrame other = keyframes[0];
  other.image_hash ^= 1;
  EXPECT_THAT(ErrorOf([&] { DecodeImage(7, other, bytes); }), HasSubstr("not the one that was saved"));
}

TEST(MapCodec, PanoramaMapsMustReferToExistingMembers) {
  const auto map = MakeSampleMap(1, {.keyframes = 6, .points = 40});
  const MapParts parts = {MakeStoredKeyFrames(*map), map->points, map->observations, map->panoramas,
                          map->next_panorama};
  MapParts without = parts;
  without.panoramas.clear();
  without.next_panorama = 0;
  for (StoredKeyFrame& stored : without.keyframes) stored.keyframe.panorama = engine::kNoId;
  for (engine::MapPoint& point : without.points) {
    point.panorama = engine::kNoId;
    point.was_infinite = false;
  }
  const Bytes bytes = EncodePanoramas(7, parts);
  MapParts decoded = without;
  DecodePanoramas(7, bytes, &decoded);
  EXPECT_TRUE(SameStructure(decoded, parts));
  EXPECT_FALSE(SameStructure(without, parts));
  for (const std::uint64_t count : {std::uint64_t{7}, std::uint64_t{1} << 60, ~std::uint64_t{0}}) {
    decoded = without;
    EXPECT_THROW(DecodePanoramas(7, Forged(bytes, 16, count), &decoded), Error);
  }
  MapParts fewer = without;
  fewer.points.pop_back();  // The last one is infinite.
  EXPECT_THAT(ErrorOf([&] { DecodePanoramas(7, bytes, &fewer); }),
              HasSubstr("refers to something that does not exist"));
}

TEST(MapCodec, ThumbnailsMustMatchTheNumberOfBytes) {
  const std::vector<engine::KeyFrameThumbnail> thumbnails = {
      {2, {6, 3, {1, -2, 3, -4, 5, -6, 7, -8, 9, 1, -2, 3, -4, 5, -6, 7, -8, 9}}},
      {5, {4, 4, std::vector<std::int8_t>(16, 127)}}};
  const Bytes bytes = EncodeThumbnails(7, thumbnails);
  EXPECT_EQ(DecodeThumbnails(7, bytes), thumbnails);
  for (const std::uint64_t count : {std::uint64_t{1}, std::uint64_t{3}, ~std::uint64_t{0}})
    EXPECT_THROW(DecodeThumbnails(7, Forged(bytes, 16, count)), Error);
  EXPECT_THROW(DecodeThumbnails(7, Forged(bytes, 24, std::uint32_t{5})), Error) << "the same keyframe twice";
  EXPECT_THROW(
      DecodeThumbnails(7, EncodeThumbnails(7, std::vector<engine::KeyFrameThumbnail>{{2, {1, 1, {127}}}})),
      Error)
      << "smaller than any image's";
  EXPECT_THROW(DecodeThumbnails(7, Forged(bytes, 28, std::uint16_t{0})), Error);
  EXPECT_THROW(DecodeThumbnails(7, Forged(bytes, 28, std::uint16_t{0xFFFF})), Error);
}

TEST(MapCodec, RepeatedReadingAndWritingDoesNotChangeAMap) {
  Random random(3);
  const engine::MapSnapshot sample = *MakeSampleMap(1, {.keyframes = 1});
  const StoredKeyFrame pattern = [&] {
    StoredKeyFrame keyframe = MakeStoredKeyFrames(sample)[0];
    keyframe.keyframe.panorama = engine::kNoId;  // It is stored elsewhere.
    return keyframe;
  }();
  MapParts first;
  for (int i = 0; i < 20'000; ++i) {
    StoredKeyFrame stored = pattern;
    stored.keyframe.id = static_cast<engine::KeyFrameId>(i);
    stored.keyframe.camera_from_map.rotation =
        engine::Rotation3::Exp({random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-3, 3)});
    first.keyframes.push_back(stored);
  }
  const CameraTable cameras = MakeCameraTable(first.keyframes);
  MapParts again = first;
  for (int round = 0; round < 20; ++round) {
    again.keyframes = DecodeKeyFrames(7, EncodeKeyFrames(7, again.keyframes, cameras), cameras);
    ASSERT_TRUE(SameStructure(first, again)) << round;
  }
  again.keyframes[5].keyframe.camera_from_map.rotation =
      again.keyframes[5].keyframe.camera_from_map.rotation * engine::Rotation3::Exp({1e-9, 0, 0});
  EXPECT_FALSE(SameStructure(first, again)) << "a small rotation is a change";
}

}  // namespace
}  // namespace docent::maps
