// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

namespace docent::ui {

// An OpenGL 3.3 core context. Its constructor makes it current on the calling thread, and it belongs to that
// thread. Objects that draw (Renderer, MapView) must be destroyed before their context.
class GraphicsContext {
 public:
  virtual ~GraphicsContext() = default;
  // Makes this context current on its thread, which is needed when several contexts exist. Throws
  // docent::Error when the driver fails to (for instance because the display has gone).
  virtual void MakeCurrent() = 0;
};

// A context without a window or display, created with EGL: on Mesa's surfaceless platform if possible, else
// on any EGL device, else on the default display. It can only draw into framebuffer objects. The constructor
// throws docent::Error with a one-sentence message when the machine has no OpenGL 3.3.
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
