// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sndfile.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <utility>

#include "content/asset.h"
#include "content/flat_image.h"
#include "content/sound.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/content/media_samples.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(ImageAssets, AnImageBecomesAFlatModelWithItsProportions) {
  const Asset asset = AssetFromBytes("plan.png", PngBytes(4, 2));
  EXPECT_EQ(asset.kind, AssetKind::kImage);
  EXPECT_EQ(asset.id.size(), 64u);
  EXPECT_EQ(asset.bytes, PngBytes(4, 2)) << "the file is stored as it is";
  ASSERT_TRUE(asset.model);
  EXPECT_EQ(asset.model->bounds_min, glm::vec3(-0.5f, -0.25f, 0));
  EXPECT_EQ(asset.model->bounds_max, glm::vec3(0.5f, 0.25f, 0));
  ASSERT_EQ(asset.model->images.size(), 1u);
  EXPECT_EQ(asset.model->images[0].width_px, 4);
  // The image's upper left corner is at -x and +y of the side that is seen from +z.
  const Primitive& front = asset.model->meshes[0].primitives[0];
  for (const Vertex& vertex : front.vertices) {
    EXPECT_EQ(vertex.uv0, glm::vec2(vertex.position.x < 0 ? 0 : 1, vertex.position.y > 0 ? 0 : 1));
    EXPECT_EQ(vertex.normal, glm::vec3(0, 0, 1));
  }
}

TEST(ImageAssets, WhatIsNoWholeImageIsRefused) {
  std::vector<std::uint8_t> bytes = PngBytes(4, 2);
  EXPECT_THAT(ErrorOf([&] {
                FlatImageModel("a.png", std::vector<std::uint8_t>{1, 2, 3});
              }),
              HasSubstr("neither a PNG nor a JPEG"));
  for (std::size_t length = 4; length + 12 < bytes.size(); ++length) {  // The last chunk says nothing.
    const std::vector<std::uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_THROW(FlatImageModel("a.png", cut), Error) << length;
  }
  bytes[16] = 1;  // A width of 16 million pixels.
  EXPECT_THAT(ErrorOf([&] { FlatImageModel("a.png", bytes); }), HasSubstr("at most 8192 a side"));
}

TEST(ImageAssets, DataThatAreFarMoreThanTheHeaderSaysAreNotInflatedToTheirEnd) {
  std::vector<std::uint8_t> rows = PngRows(4, 2);
  const auto refusal = [&] {
    return ErrorOf([&] { FlatImageModel("a.png", PngWith(4, 2, StoredData(rows))); });
  };
  rows.resize(rows.size() + 100, 0);
  EXPECT_EQ(refusal(), "") << "some programs write a few zeros behind the last row";
  rows.resize(1'000'000, 0);
  EXPECT_THAT(refusal(), HasSubstr("cannot be decoded"));
}

TEST(ImageAssets, AnInterlacedImageAndOneWithAWrongChecksumAreShown) {
  // The seven passes of an image of 5 x 5 pixels.
  std::vector<std::uint8_t> rows;
  for (const auto& [width, height] : {std::pair(1, 1), {1, 1}, {2, 1}, {1, 2}, {3, 1}, {2, 3}, {5, 2}}) {
    for (const std::uint8_t byte :
         PngRows(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)))
      rows.push_back(byte);
  }
  const auto interlaced = FlatImageModel("a.png", PngWith(5, 5, StoredData(rows), true));
  EXPECT_EQ(interlaced->images[0].rgba[4 * 24], 200);
  std::vector<std::uint8_t> data = StoredData(PngRows(5, 5));
  data.back() ^= 1;
  EXPECT_EQ(FlatImageModel("a.png", PngWith(5, 5, data))->images[0].rgba[0], 200);
}

TEST(SoundAssets, ASoundKnowsItsLength) {
  for (const int format : {SF_FORMAT_WAV | SF_FORMAT_PCM_16, SF_FORMAT_FLAC | SF_FORMAT_PCM_16,
                           SF_FORMAT_OGG | SF_FORMAT_VORBIS}) {
    const Asset asset = AssetFromBytes("bell", SoundBytesOf(format, 2, 22'050, 11'025));
    EXPECT_EQ(asset.kind, AssetKind::kSound);
    EXPECT_NEAR(asset.seconds, 0.5, 1e-9) << format;
    EXPECT_FALSE(asset.model);
  }
}

TEST(SoundAssets, DecodingGivesTheSamples) {
  const auto bytes = SoundBytesOf(SF_FORMAT_WAV | SF_FORMAT_PCM_16, 2, 8000, 4000);
  const SoundSamples sound = DecodeSound("bell", bytes);
  EXPECT_EQ(sound.format.channels, 2);
  EXPECT_EQ(sound.format.rate, 8000);
  ASSERT_EQ(sound.samples.size(), 8000u);
  for (std::size_t i = 0; i < sound.samples.size(); i += 2) {
    ASSERT_EQ(sound.samples[i], SampleOfTone(i / 2, 8000));
    ASSERT_EQ(sound.samples[i + 1], -SampleOfTone(i / 2, 8000));
  }
}

TEST(SoundAssets, SamplesOf16BitsStayWhatTheyAre) {
  std::vector<std::int16_t> all;
  for (int sample = -32'768; sample < 32'768; ++sample) all.push_back(static_cast<std::int16_t>(sample));
  for (const int format : {SF_FORMAT_WAV | SF_FORMAT_PCM_16, SF_FORMAT_FLAC | SF_FORMAT_PCM_16}) {
    const auto bytes = SoundBytesBy(format, 1, 8000, [&](SNDFILE* file) {
      sf_writef_short(file, all.data(), static_cast<sf_count_t>(all.size()));
    });
    EXPECT_EQ(DecodeSound("all", bytes).samples, all) << format;
  }
}

TEST(SoundAssets, SamplesOfFloatingPointNumbersAreScaledAndClipped) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<float> samples = {0, 0.25f, -0.5f, 1, -1, 1.5f, -7, kNan, kInfinity};
  for (const int format : {SF_FORMAT_WAV | SF_FORMAT_FLOAT, SF_FORMAT_WAV | SF_FORMAT_DOUBLE}) {
    const auto bytes = SoundBytesBy(format, 1, 8000, [&](SNDFILE* file) {
      sf_writef_float(file, samples.data(), static_cast<sf_count_t>(samples.size()));
    });
    EXPECT_THAT(DecodeSound("bell", bytes).samples,
                ElementsAre(0, 8192, -16'384, 32'767, -32'768, 32'767, -32'768, 0, 32'767))
        << format;
  }
}

TEST(SoundAssets, ReadingInPiecesGivesTheSameSamples) {
  for (const int format : {SF_FORMAT_WAV | SF_FORMAT_PCM_16, SF_FORMAT_FLAC | SF_FORMAT_PCM_16,
                           SF_FORMAT_OGG | SF_FORMAT_VORBIS}) {
    const auto bytes = SoundBytesOf(format, 2, 22'050, 50'001);
    SoundReader reader("bell", bytes);
    EXPECT_EQ(reader.format().frames, 50'001u);
    std::vector<std::int16_t> samples;
    for (const std::uint64_t frames : {1u, 2205u, 40'000u}) EXPECT_EQ(reader.Read(frames, &samples), frames);
    EXPECT_EQ(reader.Read(100'000, &samples), 7795u);
    EXPECT_EQ(reader.Read(1, &samples), 0u);
    EXPECT_EQ(samples, DecodeSound("bell", bytes).samples);
  }
}

TEST(SoundAssets, WhatIsNoWholeSoundIsRefused) {
  const auto flac = SoundBytesOf(SF_FORMAT_FLAC | SF_FORMAT_PCM_16, 1, 8000, 80'000);
  EXPECT_THAT(ErrorOf([&] { ReadSoundFormat("a.txt", std::vector<std::uint8_t>(100, 'a')); }),
              HasSubstr("is not a WAV, FLAC or Ogg sound file"));
  const std::vector<std::uint8_t> half(flac.begin(),
                                       flac.begin() + static_cast<std::ptrdiff_t>(flac.size() / 2));
  EXPECT_THAT(ErrorOf([&] { DecodeSound("half.flac", half); }),
              HasSubstr("half.flac: the sound ends too early"));
  const std::vector<std::uint8_t> head(flac.begin(), flac.begin() + 20);
  EXPECT_THROW(ReadSoundFormat("head.flac", head), Error);
  EXPECT_THAT(
      ErrorOf([&] { ReadSoundFormat("a.wav", SoundBytesOf(SF_FORMAT_WAV | SF_FORMAT_PCM_16, 3, 8000, 8)); }),
      HasSubstr("3 channels"));
  EXPECT_THAT(
      ErrorOf([&] { ReadSoundFormat("a.wav", SoundBytesOf(SF_FORMAT_WAV | SF_FORMAT_PCM_16, 1, 4000, 8)); }),
      HasSubstr("a rate that is not between"));
  EXPECT_THAT(ErrorOf([&] {
                ReadSoundFormat("a.wav", SoundBytesOf(SF_FORMAT_WAV | SF_FORMAT_PCM_16, 1, 8000, 4'800'001));
              }),
              HasSubstr("longer than 10 minutes"));
  EXPECT_THAT(
      ErrorOf([&] { ReadSoundFormat("a.wav", SoundBytesOf(SF_FORMAT_WAV | SF_FORMAT_PCM_16, 1, 8000, 0)); }),
      HasSubstr("is empty"));
}

TEST(SoundAssets, AFileIsReadOnlyAsWhatItIsToBe) {
  const app::TemporaryFolder folder;
  WriteBytes(folder / "bell.flac", SoundBytesOf(SF_FORMAT_FLAC | SF_FORMAT_PCM_16, 1, 8000, 800));
  WriteBytes(folder / "plan.png", PngBytes(3, 3));
  EXPECT_EQ(ImportSound(folder / "bell.flac").name, "bell.flac");
  EXPECT_EQ(ImportImage(folder / "plan.png").name, "plan.png");
  EXPECT_THROW(ImportSound(folder / "plan.png"), Error);
  EXPECT_THROW(ImportImage(folder / "bell.flac"), Error);
  EXPECT_THROW(ImportImage(folder / "missing.png"), Error);
}

}  // namespace
}  // namespace docent::content
