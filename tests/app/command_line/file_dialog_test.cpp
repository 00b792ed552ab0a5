// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/file_dialog.h"

#include <gio/gio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/types.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <thread>

#include "tests/app/support/temporary_folder.h"
#include "tests/support/must_run.h"
#include "tests/support/wait_until.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

// Polls until the dialog is closed, at most a minute.
template <typename Dialog>
std::optional<std::filesystem::path> AwaitChoice(Dialog* dialog) {
  std::optional<std::filesystem::path> chosen;
  for (int i = 0; i < 6000 && dialog->is_open(); ++i) {
    chosen = dialog->Poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return chosen;
}

// A program called zenity in a folder of its own, which is searched first.
class ZenityProgram : public ::testing::Test {
 protected:
  void SetUp() override { path_ = std::getenv("PATH") != nullptr ? std::getenv("PATH") : ""; }
  void TearDown() override { setenv("PATH", path_.c_str(), 1); }
  void Install(const std::string& script) {
    const auto program = folder_.Write("zenity", "#!/bin/sh\n" + script);
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    setenv("PATH", (program.parent_path().string() + ":" + path_).c_str(), 1);
  }
  const TemporaryFolder folder_;
  std::string path_;
};

TEST_F(ZenityProgram, GivesTheChosenFileWithoutWaitingForIt) {
  const auto chosen = folder_ / "chosen";
  Install("until [ -e '" + chosen.string() + "' ]; do sleep 0.02; done\necho \"/models/red fox.glb\"\n");
  EXPECT_TRUE(ZenityDialog::IsAvailable());
  ZenityDialog dialog;
  ASSERT_TRUE(dialog.Open("Choose a model", "*.glb"));
  EXPECT_FALSE(dialog.Poll()) << "it is still open";
  EXPECT_TRUE(dialog.is_open());
  folder_.Write("chosen", "");
  EXPECT_EQ(AwaitChoice(&dialog), "/models/red fox.glb");
  EXPECT_FALSE(dialog.is_open());
  ASSERT_TRUE(dialog.Open("Again", "*.glb"));
  EXPECT_EQ(AwaitChoice(&dialog), "/models/red fox.glb");
}

TEST_F(ZenityProgram, GivesNothingWhenItIsCancelled) {
  Install("echo /models/fox.glb\nexit 1\n");
  ZenityDialog dialog;
  ASSERT_TRUE(dialog.Open("Choose a model", "*.glb"));
  EXPECT_FALSE(AwaitChoice(&dialog));
  EXPECT_FALSE(dialog.is_open());
}

TEST_F(ZenityProgram, IsClosedWithTheWindow) {
  const auto file = folder_ / "pid";
  Install("echo $$ >'" + file.string() + "'\nexec sleep 60\n");
  pid_t program = 0;
  {
    ZenityDialog dialog;
    ASSERT_TRUE(dialog.Open("Choose a model", "*.glb"));
    ASSERT_TRUE(WaitUntil([&] { return static_cast<bool>(std::ifstream(file) >> program); }));
    ASSERT_EQ(kill(program, 0), 0) << "it still runs";
  }
  EXPECT_TRUE(kill(program, 0) == -1 && errno == ESRCH) << "it has ended";
}

// A session bus of its own with a desktop portal that behaves as told, on a thread of its own.
class DesktopPortal : public ::testing::Test {
 protected:
  enum class Answer { kChoose, kCancel, kNothing, kRefuse };

  void SetUp() override {
    const char* const address = std::getenv("DBUS_SESSION_BUS_ADDRESS");
    if (address != nullptr) address_ = address;
    if (std::system("command -v dbus-daemon >/dev/null") != 0)
      SKIP_OR_FAIL("dbus-daemon is not installed (./bootstrap installs it)");
    daemon_ = g_test_dbus_new(G_TEST_DBUS_NONE);
    g_test_dbus_up(daemon_);  // sets DBUS_SESSION_BUS_ADDRESS
  }
  void TearDown() override {
    if (thread_.joinable()) {
      is_stopped_ = true;
      g_main_context_wakeup(context_);
      thread_.join();
      g_main_context_unref(context_);
    }
    if (daemon_ == nullptr) return;
    g_test_dbus_stop(daemon_);
    g_object_unref(daemon_);
    if (!address_.empty())
      setenv("DBUS_SESSION_BUS_ADDRESS", address_.c_str(), 1);
    else
      unsetenv("DBUS_SESSION_BUS_ADDRESS");
  }

  void StartPortal(Answer answer) {
    answer_ = answer;
    context_ = g_main_context_new();
    thread_ = std::thread([this] { RunPortal(); });
    ASSERT_TRUE(WaitUntil([this] { return is_ready_.load(); }));
  }
  std::string asked() const {
    const std::scoped_lock lock(mutex_);
    return asked_;
  }
  bool is_closed() const { return is_closed_; }

 private:
  void RunPortal() {
    g_main_context_push_thread_default(context_);
    GDBusConnection* const bus = g_dbus_connection_new_for_address_sync(
        g_test_dbus_get_bus_address(daemon_),
        static_cast<GDBusConnectionFlags>(G_DBUS_CONNECTION_FLAGS_AUTHENTICATION_CLIENT |
                                          G_DBUS_CONNECTION_FLAGS_MESSAGE_BUS_CONNECTION),
        nullptr, nullptr, nullptr);
    ASSERT_NE(bus, nullptr);
    GDBusNodeInfo* const info = g_dbus_node_info_new_for_xml(
        "<node><interface name='org.freedesktop.portal.FileChooser'><method name='OpenFile'>"
        "<arg type='s' direction='in'/><arg type='s' direction='in'/><arg type='a{sv}' direction='in'/>"
        "<arg type='o' direction='out'/></method></interface>"
        "<interface name='org.freedesktop.portal.Request'><method name='Close'/></interface></node>",
        nullptr);
    ASSERT_NE(info, nullptr);
    info_ = info;
    static const GDBusInterfaceVTable table = {HandleCall, nullptr, nullptr, {}};
    g_dbus_connection_register_object(bus, "/org/freedesktop/portal/desktop", info->interfaces[0], &table,
                                      this, nullptr, nullptr);
    const guint name = g_bus_own_name_on_connection(
        bus, "org.freedesktop.portal.Desktop", G_BUS_NAME_OWNER_FLAGS_NONE,
        [](GDBusConnection*, const char*, gpointer data) {
          static_cast<DesktopPortal*>(data)->is_ready_ = true;
        },
        nullptr, this, nullptr);
    while (!is_stopped_) g_main_context_iteration(context_, TRUE);
    g_bus_unown_name(name);
    g_dbus_connection_close_sync(bus, nullptr, nullptr);
    while (g_main_context_iteration(context_, FALSE) != FALSE) {
    }
    g_object_unref(bus);
    g_dbus_node_info_unref(info);
    g_main_context_pop_thread_default(context_);
  }

  static void HandleCall(GDBusConnection* bus, const char* sender, const char*, const char*,
                         const char* method, GVariant* parameters, GDBusMethodInvocation* call,
                         gpointer data) {
    auto* const portal = static_cast<DesktopPortal*>(data);
    if (std::string(method) == "Close") {
      portal->is_closed_ = true;
      return g_dbus_method_invocation_return_value(call, nullptr);
    }
    if (portal->answer_ == Answer::kRefuse)
      return g_dbus_method_invocation_return_dbus_error(call, "org.freedesktop.DBus.Error.UnknownMethod",
                                                        "none here");
    char* const printed = g_variant_print(parameters, FALSE);
    {
      const std::scoped_lock lock(portal->mutex_);
      portal->asked_ = printed;
    }
    g_free(printed);
    // As the portal's documentation says: the sender's name without its colon, its points as underscores, the
    // token.
    GVariant* const options = g_variant_get_child_value(parameters, 2);
    const char* token = "";
    g_variant_lookup(options, "handle_token", "&s", &token);
    std::string name = sender + 1;
    std::replace(name.begin(), name.end(), '.', '_');
    const std::string path = "/org/freedesktop/portal/desktop/request/" + name + "/" + token;
    g_variant_unref(options);
    static const GDBusInterfaceVTable table = {HandleCall, nullptr, nullptr, {}};
    g_dbus_connection_register_object(bus, path.c_str(), portal->info_->interfaces[1], &table, data, nullptr,
                                      nullptr);
    g_dbus_method_invocation_return_value(call, g_variant_new("(o)", path.c_str()));
    if (portal->answer_ == Answer::kNothing) return;
    GVariantBuilder results;
    g_variant_builder_init(&results, G_VARIANT_TYPE_VARDICT);
    const char* const uris[] = {"file:///models/red%20fox.glb"};
    const bool chooses = portal->answer_ == Answer::kChoose;
    if (chooses) g_variant_builder_add(&results, "{sv}", "uris", g_variant_new_strv(uris, 1));
    g_dbus_connection_emit_signal(bus, sender, path.c_str(), "org.freedesktop.portal.Request", "Response",
                                  g_variant_new("(ua{sv})", chooses ? 0u : 1u, &results), nullptr);
  }

  std::string address_;
  GTestDBus* daemon_ = nullptr;
  GMainContext* context_ = nullptr;
  GDBusNodeInfo* info_ = nullptr;
  Answer answer_ = Answer::kChoose;
  std::thread thread_;
  std::atomic<bool> is_ready_{false}, is_stopped_{false}, is_closed_{false};
  mutable std::mutex mutex_;
  std::string asked_;
};

TEST_F(DesktopPortal, GivesTheChosenFile) {
  ASSERT_NO_FATAL_FAILURE(StartPortal(Answer::kChoose));
  PortalDialog dialog;
  ASSERT_TRUE(dialog.Open("Choose a model", "*.glb *.obj"));
  EXPECT_TRUE(dialog.is_open());
  EXPECT_EQ(AwaitChoice(&dialog), "/models/red fox.glb");
  EXPECT_FALSE(dialog.TakeRefusal());
  EXPECT_THAT(asked(), HasSubstr("Choose a model"));
  EXPECT_THAT(asked(), HasSubstr("'*.obj'"));
  ASSERT_TRUE(dialog.Open("Again", "*.png"));
  EXPECT_EQ(AwaitChoice(&dialog), "/models/red fox.glb");
}

TEST_F(DesktopPortal, GivesNothingWhenItIsCancelled) {
  ASSERT_NO_FATAL_FAILURE(StartPortal(Answer::kCancel));
  PortalDialog dialog;
  ASSERT_TRUE(dialog.Open("Choose a model", "*.glb"));
  EXPECT_FALSE(AwaitChoice(&dialog));
  EXPECT_FALSE(dialog.is_open());
  EXPECT_FALSE(dialog.TakeRefusal());
}

TEST_F(DesktopPortal, IsAskedToCloseADialogThatIsStillOpen) {
  ASSERT_NO_FATAL_FAILURE(StartPortal(Answer::kNothing));
  {
    PortalDialog dialog;
    ASSERT_TRUE(dialog.Open("Choose a model", "*.glb"));
    const auto is_asked = [&] {
      EXPECT_FALSE(dialog.Poll());
      return !asked().empty();
    };
    ASSERT_TRUE(WaitUntil(is_asked));
  }
  for (int i = 0; i < 6000 && !is_closed(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(is_closed());
}

TEST_F(DesktopPortal, SaysThatItHasNoFileDialog) {
  ASSERT_NO_FATAL_FAILURE(StartPortal(Answer::kRefuse));
  PortalDialog dialog;
  ASSERT_TRUE(dialog.Open("Choose a model", "*.glb"));
  EXPECT_FALSE(AwaitChoice(&dialog));
  EXPECT_TRUE(dialog.TakeRefusal());
  EXPECT_FALSE(dialog.TakeRefusal()) << "said once";
}

TEST_F(DesktopPortal, OpenFailsWithoutAPortalOrABus) {
  PortalDialog dialog;
  EXPECT_FALSE(dialog.Open("Choose a model", "*.glb")) << "nobody has the portal's name on this bus";
  setenv("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nonexistent/bus", 1);
  EXPECT_FALSE(dialog.Open("Choose a model", "*.glb"));
}

}  // namespace
}  // namespace docent::app
