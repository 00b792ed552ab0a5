// SPDX-License-Identifier: Apache-2.0
// Drags files onto a window of the X server and drops them there, as a file manager does (version 5 of the
// XDND protocol). Tests use it, because xdotool cannot drag files.
//
//   drag_files X Y FILE...
//
// X and Y are the point on the screen where the files are dropped. Exit status 0 if the window took them.
#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/Xutil.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

namespace {

constexpr long kProtocolVersion = 5;

class Drag {
 public:
  Drag(Display* display, std::string uris)
      : display_(display), uris_(std::move(uris)), root_(DefaultRootWindow(display)) {
    source_ = XCreateSimpleWindow(display_, root_, 0, 0, 1, 1, 0, 0, 0);
    XSetSelectionOwner(display_, Named("XdndSelection"), source_, CurrentTime);
  }
  Drag(const Drag&) = delete;
  Drag& operator=(const Drag&) = delete;
  ~Drag() { XDestroyWindow(display_, source_); }

  // Moves the pointer with the files to this point and drops them. Returns whether they were taken.
  bool To(int x, int y) {
    target_ = TargetAt(x, y);
    if (target_ == None) return Fail("there is no window that takes files at this point");
    Send("XdndEnter", kProtocolVersion << 24, static_cast<long>(Named("text/uri-list")), 0, 0);
    constexpr int kSteps = 5, kWayPx = 60;
    for (int i = kSteps; i >= 0; --i) {
      const int from = x - i * kWayPx / kSteps;
      XWarpPointer(display_, None, root_, 0, 0, 0, 0, from, y);
      Send("XdndPosition", 0, (static_cast<long>(from) << 16) | y, CurrentTime,
           static_cast<long>(Named("XdndActionCopy")));
      const auto status = Await("XdndStatus");
      if (!status) return Fail("the window does not answer");
      if ((status->data.l[1] & 1) == 0) return Fail("the window refuses the files");
    }
    Send("XdndDrop", 0, CurrentTime, 0, 0);
    const auto finished = Await("XdndFinished");
    if (!finished) return Fail("the window did not finish");
    return (finished->data.l[1] & 1) != 0 || Fail("the window did not take the files");
  }

 private:
  static bool Fail(const char* reason) {
    std::fprintf(stderr, "drag_files: %s\n", reason);
    return false;
  }
  Atom Named(const char* name) const { return XInternAtom(display_, name, False); }

  bool TakesFiles(Window window) const {
    Atom type = None;
    int format = 0;
    unsigned long count = 0, rest = 0;
    unsigned char* data = nullptr;
    XGetWindowProperty(display_, window, Named("XdndAware"), 0, 1, False, XA_ATOM, &type, &format, &count,
                       &rest, &data);
    if (data != nullptr) XFree(data);
    return type == XA_ATOM && count == 1;
  }

  // The window below the point that takes files; a window manager may have put it into another one.
  Window TargetAt(int x, int y) const {
    Window window = root_, child = None;
    int inside_x = x, inside_y = y;
    while (XTranslateCoordinates(display_, root_, window, x, y, &inside_x, &inside_y, &child) == True &&
           child != None) {
      if (TakesFiles(child)) return child;
      window = child;
    }
    return None;
  }

  void Send(const char* message, long second, long third, long fourth, long fifth) {
    XEvent event = {};
    event.xclient.type = ClientMessage;
    event.xclient.window = target_;
    event.xclient.message_type = Named(message);
    event.xclient.format = 32;
    event.xclient.data.l[0] = static_cast<long>(source_);
    event.xclient.data.l[1] = second;
    event.xclient.data.l[2] = third;
    event.xclient.data.l[3] = fourth;
    event.xclient.data.l[4] = fifth;
    XSendEvent(display_, target_, False, NoEventMask, &event);
    XFlush(display_);
  }

  // Answers requests for the files until a message of this kind has come, at most half a minute.
  std::optional<XClientMessageEvent> Await(const char* message) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (std::chrono::steady_clock::now() < end) {
      if (XPending(display_) == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        continue;
      }
      XEvent event;
      XNextEvent(display_, &event);
      if (event.type == SelectionRequest) Answer(event.xselectionrequest);
      if (event.type == ClientMessage && event.xclient.message_type == Named(message)) return event.xclient;
    }
    return std::nullopt;
  }

  void Answer(const XSelectionRequestEvent& request) {
    XChangeProperty(display_, request.requestor, request.property, request.target, 8, PropModeReplace,
                    reinterpret_cast<const unsigned char*>(uris_.data()), static_cast<int>(uris_.size()));
    XEvent answer = {};
    answer.xselection.type = SelectionNotify;
    answer.xselection.requestor = request.requestor;
    answer.xselection.selection = request.selection;
    answer.xselection.target = request.target;
    answer.xselection.property = request.property;
    answer.xselection.time = request.time;
    XSendEvent(display_, request.requestor, False, NoEventMask, &answer);
    XFlush(display_);
  }

  Display* const display_;
  const std::string uris_;  // A list in the form of text/uri-list.
  const Window root_;
  Window source_ = None, target_ = None;
};

// RFC 8089; all bytes but letters, digits and those of a path are encoded.
std::string UriOf(const std::filesystem::path& file) {
  std::string uri = "file://";
  for (const char c : std::filesystem::absolute(file).string()) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '/' || c == '.' || c == '-' || c == '_' || c == '~';
    char encoded[4];
    std::snprintf(encoded, sizeof encoded, "%%%02X", static_cast<unsigned>(static_cast<unsigned char>(c)));
    uri += plain ? std::string(1, c) : std::string(encoded);
  }
  return uri;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "Usage: drag_files X Y FILE...\n");
    return 2;
  }
  Display* const display = XOpenDisplay(nullptr);
  if (display == nullptr) {
    std::fprintf(stderr, "drag_files: there is no display\n");
    return 1;
  }
  std::string uris;
  for (int i = 3; i < argc; ++i) uris += UriOf(argv[i]) + "\r\n";
  const bool taken = Drag(display, uris).To(std::atoi(argv[1]), std::atoi(argv[2]));
  XCloseDisplay(display);
  return taken ? 0 : 1;
}
