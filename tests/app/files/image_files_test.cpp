// SPDX-License-Identifier: Apache-2.0
#include "app/files/image_files.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/files/guarded_pages.h"
#include "engine/vision/features.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using engine::ImageFeatures;

constexpr int kNoDisk = 77;

std::shared_ptr<const ImageFeatures> NoisyFeatures(std::uint64_t seed = 1) {
  cv::Mat gray(241, 323, CV_8UC1);  // odd size at every level
  cv::RNG random(seed);
  random.fill(gray, cv::RNG::UNIFORM, 0, 256);
  return engine::MakeFeatures(gray);
}

bool Same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

void ExpectSame(const ImageFeatures& a, const ImageFeatures& b) {
  for (std::size_t i = 0; i < engine::kPyramidLevels; ++i) {
    EXPECT_TRUE(Same(a.levels[i], b.levels[i])) << "level " << i;
    EXPECT_EQ(a.row_begin[i], b.row_begin[i]);
    ASSERT_EQ(a.corners[i].size(), b.corners[i].size());
    for (std::size_t k = 0; k < a.corners[i].size(); ++k) {
      EXPECT_EQ(a.corners[i][k].x, b.corners[i][k].x);
      EXPECT_EQ(a.corners[i][k].y, b.corners[i][k].y);
    }
  }
  EXPECT_EQ(a.fast_threshold, b.fast_threshold);
  EXPECT_TRUE(Same(a.small_blurry.pixels, b.small_blurry.pixels));
  EXPECT_EQ(a.small_blurry.scale, b.small_blurry.scale);
}

// Resident size of the mapping that contains the address; -1 where nothing is mapped.
long ResidentKilobytes(const void* address) {
  const auto wanted = reinterpret_cast<std::uintptr_t>(address);
  std::ifstream maps("/proc/self/smaps");
  bool inside = false;
  for (std::string line; std::getline(maps, line);) {
    unsigned long begin = 0, end = 0;
    char after = 0;
    if (std::sscanf(line.c_str(), "%lx-%lx%c", &begin, &end, &after) == 3 && after == ' ')
      inside = begin <= wanted && wanted < end;
    long kilobytes = 0;
    if (inside && std::sscanf(line.c_str(), "Rss: %ld kB", &kilobytes) == 1) return kilobytes;
  }
  return -1;
}

TEST(ImageFiles, StoresAnEqualCopyThatSharesNothing) {
  const TemporaryFolder folder;
  ImageFiles files(folder.path());
  const auto features = NoisyFeatures();
  const auto kept = files.Store(features);
  ASSERT_NE(kept, features);
  ExpectSame(*kept, *features);
  EXPECT_NE(kept->levels[0].data, features->levels[0].data);
  EXPECT_NE(kept->small_blurry.pixels.data, features->small_blurry.pixels.data);
  EXPECT_EQ(files.Store(kept), kept);
}

TEST(ImageFiles, EvictedImagesUseNoMemoryAndAreUnchangedAfterwards) {
  const TemporaryFolder folder;
  ImageFiles files(folder.path());
  const auto features = NoisyFeatures();
  const auto kept = files.Store(features);
  kept->MarkInUse();
  ExpectSame(*kept, *features);
  const std::uint8_t* const address = kept->levels[0].data;
  EXPECT_GE(ResidentKilobytes(address), 323 * 241 / 1024);
  files.EvictAll();
  EXPECT_EQ(ResidentKilobytes(address), 0);
  EXPECT_EQ(kept->levels[0].data, address);
  ExpectSame(*kept, *features);
}

TEST(ImageFiles, FewImagesAreResidentWhenManyAreUsedInTurn) {
  const TemporaryFolder folder;
  constexpr long kBytes = 323 * 241 * 4 / 3;  // size of one pyramid
  ImageFiles files(folder.path(), 3 * kBytes);
  std::vector<std::shared_ptr<const ImageFeatures>> kept;
  for (std::uint64_t i = 0; i < 8; ++i) kept.push_back(files.Store(NoisyFeatures(i)));
  for (int round = 0; round < 2; ++round) {
    for (std::uint64_t i = 0; i < kept.size(); ++i) {
      kept[i]->MarkInUse();
      ExpectSame(*kept[i], *NoisyFeatures(i));
      long resident = 0;
      for (const auto& features : kept) resident += ResidentKilobytes(features->levels[0].data);
      EXPECT_LE(resident, 4 * kBytes / 1024);
      EXPECT_GE(resident, round * 2 * kBytes / 1024);
    }
  }
}

TEST(ImageFiles, ImagesInOrdinaryMemoryCanBeUsedTheSameWay) {
  const auto features = NoisyFeatures();
  features->MarkInUse();
  ExpectSame(*features, *NoisyFeatures());
}

TEST(ImageFiles, AnImageThatTheDiskCannotReturnDoesNotEndTheProgram) {
  const TemporaryFolder folder;
  const void* pixels = nullptr;
  {
    const auto kept = ImageFiles(folder.path()).Store(NoisyFeatures());
    pixels = kept->levels[0].data;
    EXPECT_TRUE(GuardedPages::IsGuarded(pixels));
    EXPECT_TRUE(GuardedPages::IsGuarded(kept->levels.back().data + kept->levels.back().total() - 1));
  }
  EXPECT_FALSE(GuardedPages::IsGuarded(pixels)) << "the file is no longer mapped";
}

TEST(ImageFiles, LeavesNothingInTheFolder) {
  const TemporaryFolder folder;
  ImageFiles files(folder.path());
  const auto kept = files.Store(NoisyFeatures());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(ImageFiles, ImagesOutliveTheStoreAndThenFreeTheirMemory) {
  const TemporaryFolder folder;
  auto files = std::make_unique<ImageFiles>(folder.path());
  const auto features = NoisyFeatures();
  auto kept = files->Store(features);
  cv::Mat image = kept->levels[1];
  const std::uint8_t* const address = image.data;
  kept.reset();
  files.reset();
  EXPECT_TRUE(Same(image, features->levels[1]));
  image.release();
  EXPECT_EQ(ResidentKilobytes(address), -1);
}

// Memory that a cv::Mat allocates after it held a stored image must not come from the store.
TEST(ImageFiles, AReallocatedImageIsInOrdinaryMemory) {
  const TemporaryFolder folder;
  ImageFiles files(folder.path());
  const auto kept = files.Store(NoisyFeatures());
  cv::Mat image = kept->levels[0];
  image.create(100, 100, CV_8UC1);
  image.setTo(7);
  EXPECT_EQ(cv::countNonZero(image == 7), 100 * 100);
  ExpectSame(*kept, *NoisyFeatures());
}

TEST(ImageFiles, ImagesStayInMemoryWithoutAFolder) {
  const TemporaryFolder folder;
  ImageFiles files(folder / "missing");
  const auto features = NoisyFeatures();
  EXPECT_EQ(files.Store(features), features);
}

TEST(ImageFiles, ImagesStayInMemoryAtTheFileSizeLimit) {
  const TemporaryFolder folder;
  ImageFiles files(folder.path());
  const auto features = NoisyFeatures();
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  rlimit little = limit;
  little.rlim_cur = features->levels[0].total() + 100;  // the limit is reached within the second level
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
  const auto kept = files.Store(features);
  setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, before);
  EXPECT_EQ(kept, features);
  EXPECT_NE(files.Store(features), features);  // there is space again
}

// Runs in a process of its own, on a file system of a quarter of a megabyte. Accessing a mapped file without
// space for its pages kills the process.
int FillADisk(const std::string& folder) {
  const std::string same_user = "0 " + std::to_string(geteuid()) + " 1";
  const std::string same_group = "0 " + std::to_string(getegid()) + " 1";
  if (unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return kNoDisk;
  if (!(std::ofstream("/proc/self/uid_map") << same_user << std::flush)) return kNoDisk;
  if (!(std::ofstream("/proc/self/setgroups") << "deny" << std::flush)) return kNoDisk;
  if (!(std::ofstream("/proc/self/gid_map") << same_group << std::flush)) return kNoDisk;
  if (mount("none", folder.c_str(), "tmpfs", 0, "size=256k") != 0) return kNoDisk;
  ImageFiles files(folder);
  std::vector<std::shared_ptr<const ImageFeatures>> all;
  int in_files = 0;
  for (std::uint64_t i = 0; i < 5; ++i) {
    all.push_back(files.Store(NoisyFeatures(i)));
    in_files += all.back()->stored ? 1 : 0;
  }
  for (std::uint64_t i = 0; i < 5; ++i)
    if (!Same(all[i]->levels[0], NoisyFeatures(i)->levels[0])) return 1;
  return in_files == 2 ? 0 : 2;
}

TEST(ImageFiles, ImagesStayInMemoryOnAFullDisk) {
  const TemporaryFolder folder;
  const pid_t child = fork();
  if (child == 0) _exit(FillADisk(folder.path().string()));
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status);
  if (WEXITSTATUS(status) == kNoDisk) GTEST_SKIP() << "cannot mount a file system here";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace docent::app
