// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_assets.h"

#include <gtest/gtest.h>

#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";

TEST(SessionAssets, AFileIsReadAgainAfterItWasWrittenAnew) {
  const TemporaryFolder folder;
  SessionAssets assets;
  assets.SetFolder(folder.path());
  folder.Write("fox.obj", kTriangle);
  const auto first = assets.Load("fox.obj");
  EXPECT_EQ(assets.Load("fox.obj"), first);
  folder.Write("fox.obj", kSquare);
  const auto corrected = assets.Load("fox.obj");
  EXPECT_NE(corrected->id, first->id);
  folder.Write("fox.obj", std::string("no model"));
  EXPECT_ANY_THROW(assets.Load("fox.obj"));
  folder.Write("fox.obj", kTriangle);
  EXPECT_EQ(assets.Load("fox.obj"), first) << "equal bytes are kept once";
}

}  // namespace
}  // namespace docent::app
