// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/portal_dialog.h"

#include <gio/gio.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <utility>

namespace docent::app {

namespace {

constexpr const char* kPortal = "org.freedesktop.portal.Desktop";
constexpr const char* kPortalPath = "/org/freedesktop/portal/desktop";
constexpr int kBusTimeout_ms = 2000;  // The bus itself answers at once, also on a busy machine.

template <auto kFree>
struct FreedBy {
  template <typename T>
  void operator()(T* pointer) const {
    kFree(pointer);
  }
};
using Variant = std::unique_ptr<GVariant, FreedBy<g_variant_unref>>;
using Text = std::unique_ptr<char, FreedBy<g_free>>;

// The address of the session bus. Starts none: without a session there is no portal either.
std::string SessionBusAddress() {
  if (const char* const address = std::getenv("DBUS_SESSION_BUS_ADDRESS")) return address;
  const char* const folder = std::getenv("XDG_RUNTIME_DIR");
  if (folder == nullptr) return "";
  const std::string socket = std::string(folder) + "/bus";
  return access(socket.c_str(), R_OK | W_OK) == 0 ? "unix:path=" + socket : "";
}

// Whether a program has this name on the bus, or the bus knows how to start one that has.
bool IsOnBus(GDBusConnection* bus, const char* name) {
  for (const char* list : {"ListNames", "ListActivatableNames"}) {
    const Variant reply(g_dbus_connection_call_sync(
        bus, "org.freedesktop.DBus", "/org/freedesktop/DBus", "org.freedesktop.DBus", list, nullptr,
        G_VARIANT_TYPE("(as)"), G_DBUS_CALL_FLAGS_NONE, kBusTimeout_ms, nullptr, nullptr));
    if (!reply) continue;
    GVariantIter* names = nullptr;
    g_variant_get(reply.get(), "(as)", &names);
    bool found = false;
    for (const char* each = nullptr; g_variant_iter_next(names, "&s", &each);)
      found |= g_str_equal(each, name) != FALSE;
    g_variant_iter_free(names);
    if (found) return true;
  }
  return false;
}

// The options of OpenFile: the token by which the portal names its request, and what the dialog lists.
GVariant* OptionsOf(const std::string& token, const std::string& patterns) {
  GVariantBuilder globs, filters, options;
  g_variant_builder_init(&globs, G_VARIANT_TYPE("a(us)"));
  std::istringstream words(patterns);
  for (std::string pattern; words >> pattern;) g_variant_builder_add(&globs, "(us)", 0u, pattern.c_str());
  g_variant_builder_init(&filters, G_VARIANT_TYPE("a(sa(us))"));
  g_variant_builder_add(&filters, "(s@a(us))", patterns.c_str(), g_variant_builder_end(&globs));
  g_variant_builder_init(&globs, G_VARIANT_TYPE("a(us)"));
  g_variant_builder_add(&globs, "(us)", 0u, "*");
  g_variant_builder_add(&filters, "(s@a(us))", "*", g_variant_builder_end(&globs));
  g_variant_builder_init(&options, G_VARIANT_TYPE_VARDICT);
  g_variant_builder_add(&options, "{sv}", "handle_token", g_variant_new_string(token.c_str()));
  g_variant_builder_add(&options, "{sv}", "filters", g_variant_builder_end(&filters));
  return g_variant_builder_end(&options);
}

}  // namespace

// A dialog that was asked for: its own connection to the bus, whose messages are handled where it is polled.
struct PortalDialog::Request {
  Request() : context(g_main_context_new()) {}
  ~Request() {
    if (bus != nullptr) {
      // Without the connection, the portal closes the dialog too, but not every portal at once.
      if (!is_done && !path.empty())
        g_dbus_connection_call(bus, kPortal, path.c_str(), "org.freedesktop.portal.Request", "Close", nullptr,
                               nullptr, G_DBUS_CALL_FLAGS_NO_AUTO_START, kBusTimeout_ms, nullptr, nullptr,
                               nullptr);
      if (subscription != 0) g_dbus_connection_signal_unsubscribe(bus, subscription);
      g_cancellable_cancel(cancellable);
      g_dbus_connection_flush_sync(bus, nullptr, nullptr);
      g_dbus_connection_close_sync(bus, nullptr, nullptr);
      while (g_main_context_iteration(context, FALSE) != FALSE) {
      }
      g_object_unref(bus);
    }
    g_object_unref(cancellable);
    g_main_context_unref(context);
  }
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;

  // The portal's answer to OpenFile: an error if it has no file dialog.
  static void HandleReply(GObject* source, GAsyncResult* result, gpointer data) {
    GError* error = nullptr;
    const Variant reply(g_dbus_connection_call_finish(G_DBUS_CONNECTION(source), result, &error));
    if (error == nullptr) return;
    // The request may be gone when it was cancelled.
    if (g_error_matches(error, G_IO_ERROR, G_IO_ERROR_CANCELLED) == FALSE) {
      auto* const request = static_cast<Request*>(data);
      request->is_done = request->is_refused = true;
    }
    g_error_free(error);
  }

  // The dialog was closed: response 0 is a choice.
  static void HandleResponse(GDBusConnection*, const char*, const char*, const char*, const char*,
                             GVariant* parameters, gpointer data) {
    auto* const request = static_cast<Request*>(data);
    request->is_done = true;
    if (g_variant_is_of_type(parameters, G_VARIANT_TYPE("(ua{sv})")) == FALSE) return;
    guint32 response = 0;
    GVariant* results = nullptr;
    g_variant_get(parameters, "(u@a{sv})", &response, &results);
    const Variant owned(results);
    const Variant uris(g_variant_lookup_value(results, "uris", G_VARIANT_TYPE_STRING_ARRAY));
    if (response != 0 || !uris || g_variant_n_children(uris.get()) == 0) return;
    const char* uri = nullptr;
    g_variant_get_child(uris.get(), 0, "&s", &uri);
    const Text file(g_filename_from_uri(uri, nullptr, nullptr));
    if (file) request->chosen = file.get();
  }

  GMainContext* const context;
  GCancellable* const cancellable = g_cancellable_new();
  GDBusConnection* bus = nullptr;
  guint subscription = 0;
  std::string path;  // Of the portal's object for this request.
  bool is_done = false, is_refused = false;
  std::optional<std::filesystem::path> chosen;
};

PortalDialog::PortalDialog() = default;
PortalDialog::~PortalDialog() = default;

bool PortalDialog::is_open() const {
  return request_ != nullptr;
}

bool PortalDialog::Open(const std::string& title, const std::string& patterns) {
  if (is_open()) return true;
  refused_ = false;
  const std::string address = SessionBusAddress();
  if (address.empty()) return false;
  auto request = std::make_unique<Request>();
  g_main_context_push_thread_default(request->context);
  request->bus = g_dbus_connection_new_for_address_sync(
      address.c_str(),
      static_cast<GDBusConnectionFlags>(G_DBUS_CONNECTION_FLAGS_AUTHENTICATION_CLIENT |
                                        G_DBUS_CONNECTION_FLAGS_MESSAGE_BUS_CONNECTION),
      nullptr, nullptr, nullptr);
  if (request->bus != nullptr) g_dbus_connection_set_exit_on_close(request->bus, FALSE);
  const bool is_known = request->bus != nullptr && IsOnBus(request->bus, kPortal);
  if (is_known) {
    // The portal derives the path of its object from the caller's name and the token, so that its answer can
    // be subscribed to before the dialog is shown.
    const std::string token = "docent";
    std::string sender = g_dbus_connection_get_unique_name(request->bus);
    std::erase(sender, ':');
    std::replace(sender.begin(), sender.end(), '.', '_');
    request->path = std::string(kPortalPath) + "/request/" + sender + "/" + token;
    request->subscription = g_dbus_connection_signal_subscribe(
        request->bus, kPortal, "org.freedesktop.portal.Request", "Response", request->path.c_str(), nullptr,
        G_DBUS_SIGNAL_FLAGS_NONE, Request::HandleResponse, request.get(), nullptr);
    g_dbus_connection_call(
        request->bus, kPortal, kPortalPath, "org.freedesktop.portal.FileChooser", "OpenFile",
        g_variant_new("(ss@a{sv})", "", title.c_str(), OptionsOf(token, patterns)), G_VARIANT_TYPE("(o)"),
        G_DBUS_CALL_FLAGS_NONE, G_MAXINT, request->cancellable, Request::HandleReply, request.get());
  }
  g_main_context_pop_thread_default(request->context);
  if (is_known) request_ = std::move(request);
  return is_known;
}

std::optional<std::filesystem::path> PortalDialog::Poll() {
  if (!is_open()) return std::nullopt;
  while (!request_->is_done && g_main_context_iteration(request_->context, FALSE) != FALSE) {
  }
  if (!request_->is_done && g_dbus_connection_is_closed(request_->bus) != FALSE)
    request_->is_done = request_->is_refused = true;
  if (!request_->is_done) return std::nullopt;
  refused_ = request_->is_refused;
  const std::optional<std::filesystem::path> chosen = request_->chosen;
  request_.reset();
  return chosen;
}

bool PortalDialog::TakeRefusal() {
  return std::exchange(refused_, false);
}

}  // namespace docent::app
