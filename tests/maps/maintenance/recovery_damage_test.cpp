// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "maps/library/library.h"
#include "maps/maintenance/recovery.h"
#include "maps/storage/database.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::IsEmpty;

using Range = std::pair<std::size_t, std::size_t>;  // Bytes of a file, begin and end.

// Eight maps that were built in turns, as an author does who saves now and then, so that their rows lie in
// pages all over the file.
class DamagedLibrary : public ::testing::Test {
 protected:
  static constexpr int kMaps = 8, kKeyFrames = 14;

  DamagedLibrary() {
    {
      Library library = OpenToWrite(file_);
      for (int i = 0; i < kMaps; ++i) {
        maps_[library.NewKey()] =
            MakeSampleMap(static_cast<std::uint64_t>(i) + 1,
                          {.keyframes = kKeyFrames, .points = 900, .width_px = 160, .height_px = 120});
      }
      for (int keyframes = 5; keyframes <= kKeyFrames; keyframes += 3) {
        for (const auto& [key, map] : maps_) {
          library.Save({key, "map " + std::to_string(key), Policy::kOpen, Beginning(*map, keyframes),
                        MakeSampleScene(key * 10, 1)});
        }
      }
    }
    intact_ = ReadWholeFile(file_);
    FindImages();
  }
  // The map when it had so many keyframes.
  static std::shared_ptr<engine::MapSnapshot> Beginning(const engine::MapSnapshot& map, int keyframes) {
    auto part = std::make_shared<engine::MapSnapshot>(map);
    part->keyframes.resize(static_cast<std::size_t>(keyframes));
    part->revision = static_cast<std::uint64_t>(keyframes);
    std::erase_if(part->points,
                  [&](const auto& point) { return !part->FindKeyFrame(point.source_keyframe); });
    std::erase_if(part->observations, [&](const auto& observation) {
      return !part->FindKeyFrame(observation.keyframe) || !part->FindPoint(observation.point);
    });
    return part;
  }
  // Where the bytes of each image lie, which are not found twice because the images are noise.
  void FindImages() {
    constexpr std::size_t kStep = 32;
    const Database database = Database::OpenReadOnly(file_);
    Statement query = database.Prepare("SELECT map_key, keyframe, data FROM pictures");
    while (query.Step()) {
      const Bytes image(query.Blob(2).begin(), query.Blob(2).end());
      std::vector<Range>& ranges = images_[{query.Integer(0), query.Integer(1)}];
      std::size_t at = 0;
      for (std::size_t i = 0; i + kStep <= image.size(); i += kStep) {
        const auto begin = image.begin() + static_cast<std::ptrdiff_t>(i);
        if (i == 0 || at + 2 * kStep > intact_.size() ||
            std::memcmp(&intact_[at + kStep], &image[i], kStep) != 0) {
          const auto found = std::search(intact_.begin(), intact_.end(), begin, begin + kStep);
          if (found == intact_.end()) continue;  // It crosses the end of a page.
          at = static_cast<std::size_t>(found - intact_.begin());
        } else {
          at += kStep;
        }
        ranges.emplace_back(at, at + kStep);
      }
      ASSERT_GT(ranges.size() * kStep, image.size() * 9 / 10);
    }
    ASSERT_EQ(images_.size(), static_cast<std::size_t>(kMaps * kKeyFrames));
  }
  std::size_t IntactImages(const std::vector<Range>& damage) const {
    return static_cast<std::size_t>(std::count_if(images_.begin(), images_.end(), [&](const auto& image) {
      return std::none_of(image.second.begin(), image.second.end(), [&](const Range& piece) {
        return std::any_of(damage.begin(), damage.end(), [&](const Range& hole) {
          return piece.first < hole.second && hole.first < piece.second;
        });
      });
    }));
  }

  struct Saved {
    std::size_t maps = 0, keyframes = 0, points = 0, content = 0;
  };
  // Recovers the file and checks that everything in the new one is right.
  Saved RecoverAndCheck() {
    std::filesystem::remove(target_);
    Saved saved;
    try {
      Recover(file_, target_, SampleSceneTools());
    } catch (const Error&) {
      return saved;
    }
    const Library library = OpenToRead(target_);
    EXPECT_THAT(library.Verify(), IsEmpty());
    for (const MapInfo& info : library.List()) {
      const StoredMap stored = library.Load(info.key);
      const engine::MapSnapshot& original = *maps_.at(info.key);
      saved.maps += stored.snapshot->keyframes.empty() ? 0 : 1;
      saved.content += stored.scene.text == MakeSampleScene(info.key * 10, 1)->text ? 1 : 0;
      for (const engine::KeyFrame& keyframe : stored.snapshot->keyframes) {
        const engine::KeyFrame* const truth = original.FindKeyFrame(keyframe.id);
        EXPECT_TRUE(truth != nullptr &&
                    truth->camera_from_map.translation == keyframe.camera_from_map.translation &&
                    std::equal(truth->features->levels[0].begin<std::uint8_t>(),
                               truth->features->levels[0].end<std::uint8_t>(),
                               keyframe.features->levels[0].begin<std::uint8_t>()));
        ++saved.keyframes;
      }
      for (const engine::MapPoint& point : stored.snapshot->points) {
        const engine::MapPoint* const truth = original.FindPoint(point.id);
        EXPECT_TRUE(truth != nullptr && truth->point_in_map == point.point_in_map);
        ++saved.points;
      }
    }
    return saved;
  }
  // Damages the file in many ways and reports what share of the maps and keyframes is saved.
  template <typename Damager>
  void Measure(const char* name, int rounds, const Damager& damage) {
    std::vector<double> maps, keyframes;
    double saved = 0, intact = 0;
    for (int round = 0; round < rounds; ++round) {
      Random random(static_cast<std::uint64_t>(round) + 1);
      Bytes bytes = intact_;
      const std::vector<Range> ranges = damage(&random, &bytes);
      WriteWholeFile(file_, bytes);
      const Saved result = RecoverAndCheck();
      const std::size_t readable = IntactImages(ranges);
      EXPECT_LE(result.keyframes, readable);
      maps.push_back(static_cast<double>(result.maps) / kMaps);
      keyframes.push_back(static_cast<double>(result.keyframes) / (kMaps * kKeyFrames));
      saved += static_cast<double>(result.keyframes);
      intact += static_cast<double>(readable);
      if (HasFailure()) return;
    }
    std::sort(maps.begin(), maps.end());
    std::sort(keyframes.begin(), keyframes.end());
    const auto middle = static_cast<std::size_t>(rounds / 2);
    std::printf(
        "%s (%d times, %zu bytes): maps %.2f worst %.2f median, keyframes %.2f worst %.2f median, %.3f of "
        "those "
        "with an intact image\n",
        name, rounds, intact_.size(), maps.front(), maps[middle], keyframes.front(), keyframes[middle],
        saved / intact);
    share_of_intact_ = saved / intact;
    worst_maps_ = maps.front();
    median_keyframes_ = keyframes[middle];
  }
  static int Rounds() {
    const char* const rounds = std::getenv("DOCENT_RECOVERIES");
    return rounds ? std::atoi(rounds) : 12;
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent", target_ = folder_ / "b.docent";
  std::map<std::uint64_t, std::shared_ptr<engine::MapSnapshot>> maps_;
  Bytes intact_;
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<Range>> images_;
  double share_of_intact_ = 0, worst_maps_ = 0, median_keyframes_ = 0;
};

TEST_F(DamagedLibrary, IsSavedFromThreeQuartersOfItsFile) {
  Measure("cut to about three quarters", Rounds(), [](Random* random, Bytes* bytes) {
    const std::size_t size = bytes->size();
    bytes->resize(size * 3 / 4 + random->Below(static_cast<std::uint32_t>(size / 20)));
    return std::vector<Range>{{bytes->size(), size}};
  });
  EXPECT_GT(share_of_intact_, 0.75);
  EXPECT_GT(worst_maps_, 0.3);
}

TEST_F(DamagedLibrary, IsSavedFromAFileWithTwelveHoles) {
  Measure("twelve holes of 3 kB", Rounds(), [](Random* random, Bytes* bytes) {
    constexpr std::size_t kHole = 3000;
    std::vector<Range> holes;
    for (int i = 0; i < 12; ++i) {
      const std::size_t at = random->Below(static_cast<std::uint32_t>(bytes->size() - kHole));
      const bool zeros = random->Below(2) == 0;
      for (std::size_t k = 0; k < kHole; ++k)
        (*bytes)[at + k] = zeros ? std::uint8_t{0} : static_cast<std::uint8_t>(random->Next());
      holes.emplace_back(at, at + kHole);
    }
    return holes;
  });
  EXPECT_GT(share_of_intact_, 0.9);
  EXPECT_GT(worst_maps_, 0.7);
  EXPECT_GT(median_keyframes_, 0.7);
}

TEST_F(DamagedLibrary, IsSavedWithoutItsFirstPages) {
  Bytes bytes = intact_;
  std::fill_n(bytes.begin(), 16 * 4096, std::uint8_t{0});
  WriteWholeFile(file_, bytes);
  const Saved saved = RecoverAndCheck();
  EXPECT_GE(saved.keyframes, IntactImages({{0, 16 * 4096}}) * 8 / 10);
  EXPECT_GE(saved.maps, 7u);
}

}  // namespace
}  // namespace docent::maps
