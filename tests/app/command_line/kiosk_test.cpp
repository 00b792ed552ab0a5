// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/kiosk.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

TEST(KioskCode, IsReadFromTheFirstLineOfAFile) {
  const TemporaryFolder folder;
  EXPECT_EQ(ReadKioskCode(folder.Write("code", "0042\n")), "0042");
  EXPECT_EQ(ReadKioskCode(folder.Write("code", "123456789012\r\n")), "123456789012");
  for (const char* text : {"", "\n", "123", "1234567890123", "12a4", " 1234", "1234\n5678\n", "12\n34"})
    EXPECT_THROW(ReadKioskCode(folder.Write("code", text)), Error) << text;
  EXPECT_THROW(ReadKioskCode(folder / "none"), Error);
}

class Typing {
 public:
  explicit Typing(const std::string& code) : lock_(code) {}
  // Types the characters one after another; returns whether the last one completed the code.
  bool Type(const std::string& keys, std::chrono::milliseconds pause = std::chrono::milliseconds(300)) {
    bool opens = false;
    for (const char key : keys) opens = lock_.Add({key}, now_ += pause);
    return opens;
  }

 private:
  KioskLock lock_;
  KioskLock::Clock::time_point now_{};
};

TEST(KioskLock, OpensByTheCodeOnly) {
  EXPECT_TRUE(Typing("1234").Type("1234"));
  EXPECT_TRUE(Typing("1212").Type("121212")) << "wrong digits before it do no harm";
  EXPECT_FALSE(Typing("1234").Type("123"));
  EXPECT_FALSE(Typing("1234").Type("12n34")) << "another key in between";
  EXPECT_FALSE(Typing("1234").Type("1234", std::chrono::seconds(6))) << "a child that plays with the keys";
  Typing typing("1234");
  EXPECT_TRUE(typing.Type("1234"));
  EXPECT_FALSE(typing.Type("5"));
  KioskLock none("");
  EXPECT_FALSE(none.is_locked());
  EXPECT_FALSE(none.Add("1", {}));
}

}  // namespace
}  // namespace docent::app
