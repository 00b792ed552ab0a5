// SPDX-License-Identifier: Apache-2.0
#include "app/sound/sound_player.h"

#include <gmock/gmock.h>
#include <stdlib.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "app/sound/sound_device.h"
#include "content/asset.h"
#include "engine/base/error.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/content/media_samples.h"
#include "tests/support/wait_until.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

// The device writes what would be heard into a file, in real time.
class SoundPlayerOfAFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "alsoft.conf") << "[general]\nchannels=mono\nsample-type=int16\n[wave]\nfile="
                                           << (folder_ / "device" / "heard.wav").string() << "\n";
    setenv("ALSOFT_DRIVERS", "wave", 1);
    setenv("ALSOFT_CONF", (folder_ / "alsoft.conf").c_str(), 1);
    std::filesystem::create_directory(folder_ / "device");
    try {
      const SoundDevice device;
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
    std::filesystem::remove_all(folder_ / "device");
  }
  static std::shared_ptr<const content::Asset> LongTone() {
    constexpr int kWaveRate = 48'000;
    return std::make_shared<content::Asset>(content::AssetFromBytes(
        "tone",
        content::SoundBytesOf(SF_FORMAT_WAV | SF_FORMAT_PCM_16, 1, kWaveRate, std::size_t{20} * kWaveRate)));
  }
  void Play(const std::string& name) {
    SoundDirector::Orders orders;
    orders.start.emplace_back(SoundDirector::Key{1, name}, LongTone());
    player_.Give(orders);
  }
  // A file that is no sound.
  void PlayDamaged() {
    SoundDirector::Orders orders;
    orders.start.emplace_back(SoundDirector::Key{1, "damaged"}, std::make_shared<content::Asset>());
    player_.Give(orders);
  }
  std::string WaitForProblem() {
    std::string problem;
    WaitUntil([&] { return !(problem = player_.TakeProblem()).empty(); });
    return problem;
  }
  bool IsHeard() {
    return WaitUntil([this] {
      std::error_code error;
      const auto size = std::filesystem::file_size(folder_ / "device" / "heard.wav", error);
      return !error && size > 20'000;
    });
  }

  // Silence is written too.
  bool IsToneHeard() {
    return WaitUntil([this] {
      const std::string bytes = ReadAll(folder_ / "device" / "heard.wav");
      const std::size_t header = bytes.find("data");
      if (header == std::string::npos) return false;
      for (std::size_t at = header + 8; at + 1 < bytes.size(); at += 2) {
        std::int16_t sample = 0;
        std::memcpy(&sample, bytes.data() + at, sizeof(sample));
        if (std::abs(sample) > 1000) return true;
      }
      return false;
    });
  }

  const TemporaryFolder folder_;
  SoundPlayer player_{std::chrono::milliseconds(0)};
};

TEST_F(SoundPlayerOfAFile, PlaysALaterSoundWithADeviceThatWasMissing) {
  Play("first");
  EXPECT_THAT(WaitForProblem(), HasSubstr("Sounds are not heard"));
  std::filesystem::create_directory(folder_ / "device");
  Play("second");
  EXPECT_TRUE(IsHeard());
}

TEST_F(SoundPlayerOfAFile, PlaysASoundThatBeginsTogetherWithADamagedOne) {
  std::filesystem::create_directory(folder_ / "device");
  SoundDirector::Orders orders;
  orders.start.emplace_back(SoundDirector::Key{1, "damaged"}, std::make_shared<content::Asset>());
  orders.start.emplace_back(SoundDirector::Key{1, "tone"}, LongTone());
  player_.Give(orders);
  EXPECT_TRUE(IsToneHeard());
  EXPECT_THAT(WaitForProblem(), HasSubstr("Sounds are not heard"));
}

TEST_F(SoundPlayerOfAFile, SaysOnceWhatIsNotHeardAndGoesOn) {
  std::filesystem::create_directory(folder_ / "device");
  PlayDamaged();
  EXPECT_THAT(WaitForProblem(), HasSubstr("Sounds are not heard: "));
  PlayDamaged();
  Play("tone");
  EXPECT_TRUE(IsToneHeard());
  EXPECT_EQ(player_.TakeProblem(), "");
}

TEST_F(SoundPlayerOfAFile, PlaysALaterSoundAfterItsDeviceWasLost) {
  // OpenAL gives up a device whose file cannot be written.
  std::filesystem::create_directory(folder_ / "device");
  std::filesystem::create_symlink("/dev/full", folder_ / "device" / "heard.wav");
  Play("first");
  EXPECT_THAT(WaitForProblem(), HasSubstr("was lost"));
  std::filesystem::remove(folder_ / "device" / "heard.wav");
  Play("second");
  EXPECT_TRUE(IsHeard());
}

}  // namespace
}  // namespace docent::app
