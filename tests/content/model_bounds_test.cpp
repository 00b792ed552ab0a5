// SPDX-License-Identifier: Apache-2.0
#include "content/model_bounds.h"

#include <gtest/gtest.h>

#include "content/picking.h"
#include "content/warp.h"
#include "tests/support/processor_time.h"

namespace docent::content {
namespace {

// A file of some megabytes can have so many nodes, each of which shows a triangle with the same skin, whose
// joints are all of them. The triangle is at (1, 0, 0), where the first node is.
Model SkinnedByAllNodes(int count) {
  Primitive primitive;
  for (const glm::vec3& corner : {glm::vec3(0, 0, 0), glm::vec3(2, 0, 0), glm::vec3(0, 2, 0)}) {
    Vertex vertex;
    vertex.position = corner;
    vertex.weights = {1, 0, 0, 0};
    primitive.vertices.push_back(vertex);
  }
  primitive.indices = {0, 1, 2};
  Model model;
  model.meshes.push_back({"triangle", {primitive}});
  Skin skin;
  Node node;
  node.mesh = node.skin = 0;
  for (int i = 0; i < count; ++i) {
    model.nodes.push_back(node);
    model.roots.push_back(i);
    skin.joints.push_back(i);
  }
  model.nodes[0].translation = {1, 0, 0};
  skin.inverse_bind.resize(skin.joints.size(), glm::mat4(1));
  model.skins.push_back(std::move(skin));
  model.bounds_min = {1, 0, 0};
  model.bounds_max = {3, 2, 0};
  return model;
}

class ManySkinnedNodes : public ::testing::Test {
 protected:
  // A matrix for each joint of each node takes minutes, one for each joint a moment. What other programs do
  // meanwhile does not count.
  static constexpr double kMoment_s = 15;

  ~ManySkinnedNodes() override { EXPECT_LT(ProcessorTime_s() - begin_s_, kMoment_s); }

  const Model model_ = SkinnedByAllNodes(100'000);
  const double begin_s_ = ProcessorTime_s();
};

TEST_F(ManySkinnedNodes, HaveBoundsAfterFewSecondsOfProcessorTime) {
  const auto bounds = RestBounds(model_);
  ASSERT_TRUE(bounds);
  EXPECT_EQ(bounds->first, glm::vec3(1, 0, 0));
  EXPECT_EQ(bounds->second, glm::vec3(3, 2, 0));
}

TEST_F(ManySkinnedNodes, AreMetByARayAfterFewSecondsOfProcessorTime) {
  const auto distance = IntersectModel({{1.5, 0.5, -5}, {0, 0, 1}}, model_, engine::Sim3(), -1, 0);
  ASSERT_TRUE(distance);
  EXPECT_NEAR(*distance, 5, 1e-9);
}

TEST_F(ManySkinnedNodes, AreBentAfterFewSecondsOfProcessorTime) {
  const auto warped = Warped(model_, Warp());
  EXPECT_EQ(warped->bounds_min, glm::vec3(1, 0, 0));
  EXPECT_EQ(warped->bounds_max, glm::vec3(3, 2, 0));
}

}  // namespace
}  // namespace docent::content
