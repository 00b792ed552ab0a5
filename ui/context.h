// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

namespace docent::ui {

// An OpenGL 3.3 core context. It is made current on the thread that constructs it and stays with that thread;
// whatever draws (Renderer, MapView) must be destroyed before its context.
class GraphicsContext {
 public:
  virtual ~GraphicsContext() = default;
  // Makes this context the thread's current one, where several exist. Throws docent::Error when the driver
  // refuses (the display has gone).
  virtual void MakeCurrent() = 0;
  // The driver in words ("llvmpipe (LLVM 15.0.6, 256 bits)"). Needs to be current.
  std::string DriverName() const;
};

// A context without window or display, by EGL: Mesa's surfaceless platform first, then any EGL device, then
// the default display. Draws into framebuffer objects only. Throws docent::Error with one sentence when the
// machine has no OpenGL 3.3.
class OffscreenContext : public GraphicsContext {
 public:
  OffscreenContext();
  ~OffscreenContext() override;
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;
  void MakeCurrent() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui
