// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/inverted_file.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <latch>
#include <thread>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

// A bag of `words` different words from a range of leaves, each once.
WordBag RandomBag(std::uint64_t seed, std::size_t words, std::uint32_t first_leaf, std::uint32_t leaves) {
  Random random(seed);
  std::vector<std::uint32_t> chosen;
  while (chosen.size() < words) {
    const std::uint32_t leaf = first_leaf + random.Below(leaves);
    if (std::find(chosen.begin(), chosen.end(), leaf) == chosen.end()) chosen.push_back(leaf);
  }
  return MakeWordBag(chosen);
}

std::vector<std::pair<KeyFrameId, double>> Answer(const InvertedFile& file, const WordBag& wanted) {
  std::vector<std::pair<KeyFrameId, double>> answer;
  for (const InvertedFile::Hit& hit : file.Search(wanted, 10))
    answer.emplace_back(hit.owner.keyframe, hit.score);
  return answer;
}

TEST(InvertedFile, ScoresByTermFrequencyAndInverseDocumentFrequency) {
  // Leaf 5 is in both keyframes, leaves 7 and 9 are in one each.
  InvertedFile file;
  file.Add(MakeWordBag({5, 5, 5, 7}), {1, 10});
  file.Add(MakeWordBag({5, 9}), {1, 20});
  const double common = std::log(1 + 2.0 / 2), rare = std::log(1 + 2.0 / 1);
  const auto hits = file.Search(MakeWordBag({5, 7}), 5);
  ASSERT_EQ(hits.size(), 2u);
  const double wanted = common + rare;
  EXPECT_EQ(hits[0].owner.keyframe, 10u);
  EXPECT_NEAR(hits[0].score,
              std::min(common / wanted, 3 * common / (3 * common + rare)) +
                  std::min(rare / wanted, rare / (3 * common + rare)),
              1e-6);
  EXPECT_EQ(hits[1].owner.keyframe, 20u);
  EXPECT_NEAR(hits[1].score, common / wanted, 1e-6);
  // One minus half the L1 distance of the normalized vectors (Nister and Stewenius 2006).
  const double distance = std::abs(common / wanted - 3 * common / (3 * common + rare)) +
                          std::abs(rare / wanted - rare / (3 * common + rare));
  EXPECT_NEAR(hits[0].score, 1 - distance / 2, 1e-6);
}

TEST(InvertedFile, AKeyframeScoresOneWithItselfAndUnrelatedOnesAreNoHits) {
  InvertedFile file;
  const auto own = file.Add(MakeWordBag({1, 2, 2, 3}), {4, 1});
  const auto other = file.Add(MakeWordBag({100, 200}), {4, 2});
  const auto hits = file.Search(MakeWordBag({1, 2, 2, 3}), 5);
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_EQ(hits[0].owner.map_key, 4u);
  EXPECT_EQ(hits[0].slot, own);
  EXPECT_NEAR(hits[0].score, 1, 1e-6);
  const std::vector<InvertedFile::Slot> slots = {other, own, InvertedFile::kNoSlot};
  const auto scores = file.Scores(MakeWordBag({1, 2, 2, 3}), slots);
  EXPECT_EQ(scores[0], 0);
  EXPECT_NEAR(scores[1], 1, 1e-6);
  EXPECT_EQ(scores[2], 0);
  EXPECT_TRUE(file.Search({}, 5).empty());
  EXPECT_TRUE(file.Search(MakeWordBag({7}), 5).empty());
  EXPECT_TRUE(InvertedFile().Search(MakeWordBag({7}), 5).empty());
}

TEST(InvertedFile, ARareWordCountsMoreThanACommonOne) {
  InvertedFile file;
  for (KeyFrameId i = 0; i < 50; ++i) file.Add(MakeWordBag({1, 1000 + i}), {1, i});
  file.Add(MakeWordBag({2, 3000}), {1, 50});
  const auto hits = file.Search(MakeWordBag({1, 2}), 51);
  ASSERT_EQ(hits.size(), 51u);
  EXPECT_EQ(hits[0].owner.keyframe, 50u);
  EXPECT_GT(hits[0].score, 2 * hits[1].score);
}

TEST(InvertedFile, RemovingAddedKeyframesRestoresTheResults) {
  InvertedFile file, never_touched;
  for (KeyFrameId i = 0; i < 40; ++i) {
    file.Add(RandomBag(i, 30, 0, 200), {1, i});
    never_touched.Add(RandomBag(i, 30, 0, 200), {1, i});
  }
  std::vector<InvertedFile::Slot> others;
  for (KeyFrameId i = 0; i < 25; ++i) others.push_back(file.Add(RandomBag(100 + i, 30, 0, 200), {2, i}));
  const WordBag wanted = RandomBag(7, 30, 0, 200);
  EXPECT_NE(Answer(file, wanted), Answer(never_touched, wanted));
  for (const InvertedFile::Slot slot : others) file.Remove(slot);
  EXPECT_EQ(file.size(), 40u);
  EXPECT_EQ(file.postings(), never_touched.postings());
  EXPECT_EQ(Answer(file, wanted), Answer(never_touched, wanted));
  // Slots are reused.
  EXPECT_EQ(file.Add(RandomBag(7, 30, 0, 200), {3, 9}), others.back());
  EXPECT_EQ(file.Search(wanted, 2)[1].owner.map_key, 3u)
      << "it must score like the first, which has the same words";
}

TEST(InvertedFile, ReadsNoMoreWhenKeyframesWithOtherWordsAreAdded) {
  InvertedFile file;
  for (KeyFrameId i = 0; i < 100; ++i) file.Add(RandomBag(i, 50, 0, 500), {1, i});
  const WordBag wanted = RandomBag(3, 50, 0, 500);
  InvertedFile::Cost before, after;
  file.Search(wanted, 5, &before);
  EXPECT_EQ(before.words, 50u);
  EXPECT_GT(before.postings, 50u);
  for (KeyFrameId i = 0; i < 2000; ++i) file.Add(RandomBag(1000 + i, 50, 500, 3000), {2, i});
  const auto hits = file.Search(wanted, 5, &after);
  EXPECT_EQ(hits[0].owner.keyframe, 3u);
  EXPECT_EQ(after.words, before.words);
  EXPECT_EQ(after.postings, before.postings);
}

TEST(InvertedFile, SkipsTooFrequentWordsAndFindsTheSame) {
  InvertedFile file;
  // 20,000 keyframes share the same 40 words and have ten unique words each.
  WordBag common = RandomBag(1, 40, 0, 40);
  for (KeyFrameId i = 0; i < 20'000; ++i) {
    WordBag bag = common;
    for (const VisualWord& word : RandomBag(i, 10, 40, 4000)) bag.push_back(word);
    file.Add(bag, {1, i});
  }
  WordBag wanted = common;
  for (const VisualWord& word : RandomBag(777, 10, 40, 4000)) wanted.push_back(word);
  InvertedFile::Cost cost;
  const auto hits = file.Search(wanted, 3, &cost);
  EXPECT_EQ(hits[0].owner.keyframe, 777u);
  EXPECT_NEAR(hits[0].score, 1, 1e-6) << "the final comparison uses all words";
  EXPECT_GE(cost.words, 10u);
  EXPECT_LT(cost.words, 50u);
  EXPECT_LE(cost.postings, 300'000u);
}

TEST(InvertedFile, CanBeSearchedWhileKeyframesAreAddedAndRemoved) {
  InvertedFile file;
  for (KeyFrameId i = 0; i < 100; ++i) file.Add(RandomBag(i, 30, 0, 300), {1, i});
  std::atomic<bool> done = false;
  std::atomic<int> wrong = 0;
  std::latch reading(2);  // without it, the changes may be over before the first search
  std::vector<std::jthread> readers;
  for (int r = 0; r < 2; ++r) {
    readers.emplace_back([&] {
      reading.count_down();
      do {
        const auto hits = file.Search(RandomBag(42, 30, 0, 300), 1);
        if (hits.size() != 1 || hits[0].owner.keyframe != 42 || std::abs(hits[0].score - 1) > 1e-6) ++wrong;
      } while (!done);
    });
  }
  reading.wait();
  for (KeyFrameId i = 0; i < 300; ++i) {
    const auto slot = file.Add(RandomBag(1000 + i, 30, 0, 300), {2, i});
    if (i % 3 != 0) file.Remove(slot);
  }
  done = true;
  readers.clear();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(file.size(), 200u);
}

}  // namespace
}  // namespace docent::engine
