// SPDX-License-Identifier: Apache-2.0
#include "app/files/guarded_pages.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

namespace docent::app {
namespace {

// A mapped file of some pages of sevens, the last of which are cut off: they cannot be read.
class MappedFile {
 public:
  MappedFile(std::size_t pages, std::size_t kept)
      : page_bytes_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))), bytes_(pages * page_bytes_) {
    std::FILE* const file = std::tmpfile();
    const std::vector<unsigned char> sevens(bytes_, 7);
    EXPECT_EQ(std::fwrite(sevens.data(), 1, bytes_, file), bytes_);
    std::fflush(file);
    data_ = mmap(nullptr, bytes_, PROT_READ, MAP_SHARED, fileno(file), 0);
    EXPECT_NE(data_, MAP_FAILED);
    EXPECT_EQ(ftruncate(fileno(file), static_cast<off_t>(kept * page_bytes_)), 0);
    std::fclose(file);
  }
  ~MappedFile() { munmap(data_, bytes_); }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  const void* data() const { return data_; }
  std::size_t bytes() const { return bytes_; }
  int Read(std::size_t page, std::size_t offset = 5) const {
    return static_cast<const volatile unsigned char*>(data_)[page * page_bytes_ + offset];
  }

 private:
  const std::size_t page_bytes_, bytes_;
  void* data_ = nullptr;
};

TEST(GuardedPages, APageThatTheDiskCannotReturnReadsAsZeros) {
  const MappedFile file(4, 2);
  const GuardedPages guard(file.data(), file.bytes());
  const std::uint64_t before = GuardedPages::Lost();
  EXPECT_EQ(file.Read(1), 7);
  EXPECT_EQ(GuardedPages::Lost(), before);
  EXPECT_EQ(file.Read(3), 0);
  EXPECT_EQ(file.Read(3, 900), 0);
  EXPECT_EQ(GuardedPages::Lost(), before + 1) << "one page";
  EXPECT_EQ(file.Read(2), 0);
  EXPECT_EQ(GuardedPages::Lost(), before + 2);
  EXPECT_EQ(file.Read(0), 7) << "the others are as they were";
}

TEST(GuardedPages, ThreadsThatReadTheSamePageGoOn) {
  const MappedFile file(64, 0);
  const GuardedPages guard(file.data(), file.bytes());
  std::vector<std::thread> threads;
  std::vector<int> sums(4, 0);
  for (int& sum : sums)
    threads.emplace_back([&file, &sum] {
      for (std::size_t page = 0; page < 64; ++page) sum += file.Read(page);
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(sums, std::vector<int>(4, 0));
}

TEST(GuardedPages, OnlyWhatIsGuardedIsReplaced) {
  const MappedFile file(2, 0);
  const std::size_t first_page = file.bytes() / 2;
  std::optional<GuardedPages> guard(std::in_place, file.data(), first_page);
  EXPECT_TRUE(GuardedPages::IsGuarded(file.data()));
  EXPECT_FALSE(GuardedPages::IsGuarded(static_cast<const char*>(file.data()) + first_page));
  guard.reset();
  EXPECT_FALSE(GuardedPages::IsGuarded(file.data()));
}

TEST(GuardedPagesDeathTest, AFaultElsewhereEndsTheProgram) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto read_unguarded = [] {
    const MappedFile guarded(1, 1), file(2, 0);
    const GuardedPages guard(guarded.data(), guarded.bytes());
    std::exit(file.Read(1));
  };
  EXPECT_DEATH(read_unguarded(), "");
}

TEST(GuardedPages, MoreRangesThanTheTableHoldsAreNoError) {
  const MappedFile file(1, 1);
  std::vector<std::unique_ptr<GuardedPages>> guards;
  for (std::size_t i = 0; i < GuardedPages::kMost + 3; ++i)
    guards.push_back(std::make_unique<GuardedPages>(file.data(), file.bytes()));
  EXPECT_TRUE(GuardedPages::IsGuarded(file.data()));
  guards.clear();
  EXPECT_FALSE(GuardedPages::IsGuarded(file.data()));
}

}  // namespace
}  // namespace docent::app
