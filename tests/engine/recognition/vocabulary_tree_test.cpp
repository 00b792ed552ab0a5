// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/vocabulary_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <set>

#include "engine/base/error.h"
#include "engine/vision/features.h"
#include "tests/engine/recognition/made_descriptors.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_descriptors::Clustered;
using testing_descriptors::Disturbed;
using testing_descriptors::MadeTree;

std::string ErrorOf(const std::vector<std::uint8_t>& bytes) {
  try {
    VocabularyTree::FromBytes(bytes);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

// The centres of a tree's leaves, read from its bytes.
class LeafCenters {
 public:
  explicit LeafCenters(const VocabularyTree& tree) : bytes_(tree.ToBytes()) {}
  Descriptor Of(std::uint32_t leaf) const {
    constexpr std::size_t kHeader = 8;
    const std::size_t center = VocabularyTree::kCenters - VocabularyTree::kLeaves + leaf;
    Descriptor descriptor;
    std::memcpy(descriptor.values.data(), &bytes_[kHeader + center * kDescriptorSize], kDescriptorSize);
    return descriptor;
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

TEST(VocabularyTree, DistributesTheTrainingDescriptorsOverTheLeaves) {
  const std::vector<Descriptor> training = Clustered(20000, 3000, 1);
  const VocabularyTree tree = VocabularyTree::Train(training, 1);
  std::vector<int> count(VocabularyTree::kLeaves);
  for (const Descriptor& descriptor : training) {
    const std::uint32_t leaf = tree.Leaf(descriptor);
    ASSERT_LT(leaf, VocabularyTree::kLeaves);
    ++count[leaf];
  }
  EXPECT_GT(std::count_if(count.begin(), count.end(), [](int n) { return n > 0; }), 2500);
  EXPECT_LT(*std::max_element(count.begin(), count.end()), 200);
}

TEST(VocabularyTree, AssignsSimilarDescriptorsToTheSameLeaf) {
  Random random(4);
  int same = 0, near = 0, chance = 0;
  const std::vector<Descriptor> descriptors = Clustered(1000, 1000, 9);
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    const std::uint32_t leaf = MadeTree().Leaf(descriptors[i]);
    const Descriptor disturbed = Disturbed(descriptors[i], 4, &random);
    same += MadeTree().Leaf(disturbed) == leaf;
    std::array<std::uint32_t, 8> home, leaves;
    ASSERT_EQ(MadeTree().NearestLeaves(descriptors[i], home), 8u);
    ASSERT_EQ(MadeTree().NearestLeaves(disturbed, leaves), 8u);
    near += std::find(leaves.begin(), leaves.end(), home[0]) != leaves.end();
    chance += MadeTree().Leaf(descriptors[(i + 1) % descriptors.size()]) == leaf;
  }
  EXPECT_GT(same, 500);
  EXPECT_GT(near, 900);
  EXPECT_LT(chance, 20);
}

TEST(VocabularyTree, NearestLeavesOfOneEqualsLeaf) {
  for (const Descriptor& descriptor : Clustered(300, 300, 5)) {
    std::array<std::uint32_t, 1> leaf;
    ASSERT_EQ(MadeTree().NearestLeaves(descriptor, leaf), 1u);
    EXPECT_EQ(leaf[0], MadeTree().Leaf(descriptor));
  }
}

TEST(VocabularyTree, ListsDistinctNearestLeavesInOrder) {
  const LeafCenters made(MadeTree());
  for (const Descriptor& descriptor : Clustered(100, 100, 6)) {
    std::array<std::uint32_t, VocabularyTree::kMaxNearestLeaves> leaves;
    ASSERT_EQ(MadeTree().NearestLeaves(descriptor, leaves), leaves.size());
    EXPECT_EQ(std::set<std::uint32_t>(leaves.begin(), leaves.end()).size(), leaves.size());
    for (std::size_t i = 1; i < leaves.size(); ++i) {
      EXPECT_LE(SquaredDistance(descriptor, made.Of(leaves[i - 1])),
                SquaredDistance(descriptor, made.Of(leaves[i])));
    }
  }
}

TEST(VocabularyTree, IsReproducibleForASeedAndDiffersForAnother) {
  const std::vector<Descriptor> training = Clustered(17000, 2000, 2);
  const VocabularyTree tree = VocabularyTree::Train(training, 7);
  EXPECT_EQ(tree, VocabularyTree::Train(training, 7));
  EXPECT_FALSE(tree == VocabularyTree::Train(training, 8));
}

TEST(VocabularyTree, ReportsTrainingProgress) {
  std::vector<std::size_t> reports;
  VocabularyTree::Train(Clustered(17000, 100, 2), 1,
                        [&](std::size_t finished_centers) { reports.push_back(finished_centers); });
  ASSERT_FALSE(reports.empty());
  EXPECT_TRUE(std::is_sorted(reports.begin(), reports.end()));
  EXPECT_EQ(reports.back(), VocabularyTree::kCenters);
}

TEST(VocabularyTree, NeedsEnoughDescriptorsButAcceptsEqualOnes) {
  EXPECT_THROW(VocabularyTree::Train(Clustered(16383, 1000, 1), 1), Error);
  const std::vector<Descriptor> equal_descriptors(VocabularyTree::kMinTraining, Clustered(1, 1, 3)[0]);
  const VocabularyTree tree = VocabularyTree::Train(equal_descriptors, 1);
  EXPECT_EQ(LeafCenters(tree).Of(tree.Leaf(equal_descriptors[0])), equal_descriptors[0]);
}

TEST(VocabularyBytes, RoundTripToTheSameTree) {
  const std::vector<std::uint8_t> bytes = MadeTree().ToBytes();
  EXPECT_EQ(bytes.size(), VocabularyTree::kBytes);
  EXPECT_EQ(VocabularyTree::FromBytes(bytes), MadeTree());
}

TEST(VocabularyBytes, AreRejectedWhenDamaged) {
  const std::vector<std::uint8_t> bytes = MadeTree().ToBytes();
  EXPECT_THAT(ErrorOf({}), ::testing::HasSubstr("not a vocabulary"));
  for (const std::size_t size : {std::size_t{3}, std::size_t{8}, std::size_t{1000}, bytes.size() - 1}) {
    EXPECT_NE(ErrorOf({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}), "") << size;
  }
  std::vector<std::uint8_t> longer = bytes;
  longer.push_back(0);
  EXPECT_THAT(ErrorOf(longer), ::testing::HasSubstr("instead of"));
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged[random.Below(static_cast<std::uint32_t>(bytes.size()))] ^=
        static_cast<std::uint8_t>(1u << random.Below(8));
    EXPECT_NE(ErrorOf(damaged), "");
  }
}

// Descriptors of a room that the vocabulary was not trained on.
std::vector<Descriptor> DescriptorsOfARoom() {
  const auto camera = testing_world::PinholeCamera(640, 480);
  std::vector<Descriptor> descriptors;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const cv::Mat image =
        testing_world::RenderedWorld::Room(seed).Render(*camera, testing_world::CameraAt({0, 0, 0}), 1.5);
    for (const DescribedKeypoint& place : DescribeCorners(*MakeFeatures(image)))
      descriptors.push_back(place.oriented.descriptor);
  }
  return descriptors;
}

TEST(DefaultVocabulary, DistinguishesTheKeypointsOfAnImage) {
  const LeafCenters centers(DefaultVocabulary());
  std::set<std::uint32_t> leaves;
  double centre_distance = 0;
  const std::vector<Descriptor> descriptors = DescriptorsOfARoom();
  ASSERT_GT(descriptors.size(), 1000u);
  double pair_distance = 0;
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    const std::uint32_t leaf = DefaultVocabulary().Leaf(descriptors[i]);
    leaves.insert(leaf);
    centre_distance += SquaredDistance(descriptors[i], centers.Of(leaf));
    pair_distance += SquaredDistance(descriptors[i], descriptors[(i + 500) % descriptors.size()]);
  }
  EXPECT_GT(leaves.size(), descriptors.size() / 4);
  EXPECT_LT(centre_distance, 0.5 * pair_distance);
}

}  // namespace
}  // namespace docent::engine
