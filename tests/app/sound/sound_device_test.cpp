// SPDX-License-Identifier: Apache-2.0
#include "app/sound/sound_device.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <chrono>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "content/asset.h"
#include "engine/base/error.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/content/media_samples.h"

namespace docent::app {
namespace {

constexpr int kRate = 48'000;

// The device writes what would be heard into a file, in real time.
class SoundDeviceOfAFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "alsoft.conf")
        << "[general]\nchannels=mono\nsample-type=int16\nfrequency=" << kRate
        << "\n[wave]\nfile=" << (folder_ / "heard.wav").string() << "\n";
    setenv("ALSOFT_DRIVERS", "wave", 1);
    setenv("ALSOFT_CONF", (folder_ / "alsoft.conf").c_str(), 1);
    try {
      device_ = std::make_unique<SoundDevice>();
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
  }
  // Closes the device and returns how many samples are not silent.
  std::size_t CountHeard() {
    device_.reset();
    std::ifstream file(folder_ / "heard.wav", std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    const std::size_t begin = bytes.find("data") + 8;
    std::size_t count = 0;
    for (std::size_t at = begin; at + 1 < bytes.size(); at += 2) {
      std::int16_t sample = 0;
      std::memcpy(&sample, bytes.data() + at, sizeof(sample));
      count += sample != 0;
    }
    return count;
  }
  static std::shared_ptr<const content::Asset> Tone(int format, std::size_t frames) {
    return std::make_shared<content::Asset>(
        content::AssetFromBytes("tone", content::SoundBytesOf(format, 1, kRate, frames)));
  }

  const TemporaryFolder folder_;
  std::unique_ptr<SoundDevice> device_;
};

TEST_F(SoundDeviceOfAFile, PlaysASoundOfSeveralPiecesToItsEnd) {
  constexpr std::size_t kFrames = 4 * kRate;  // More than the device is given at once.
  device_->Start({1, "tone"}, Tone(SF_FORMAT_OGG | SF_FORMAT_VORBIS, kFrames));
  EXPECT_TRUE(device_->is_playing());
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (device_->is_playing() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    device_->Update();
  }
  EXPECT_FALSE(device_->is_playing());
  // A tone is 0 for a moment now and then.
  EXPECT_NEAR(static_cast<double>(CountHeard()), kFrames, 0.03 * kFrames);
}

TEST_F(SoundDeviceOfAFile, ADamagedSoundEndsWithASentence) {
  auto bytes = content::SoundBytesOf(SF_FORMAT_FLAC | SF_FORMAT_PCM_16, 1, kRate, 30 * kRate);
  bytes.resize(bytes.size() / 30);
  content::Asset asset;
  asset.name = "half.flac";
  asset.bytes = bytes;
  EXPECT_THROW(device_->Start({1, "half"}, std::make_shared<content::Asset>(asset)), Error);
  EXPECT_FALSE(device_->is_playing());
}

}  // namespace
}  // namespace docent::app
