// SPDX-License-Identifier: Apache-2.0
#include "ui/context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <vector>

#include "engine/base/error.h"

namespace docent::ui {
namespace {

// Displays that need no screen, in the order in which they are tried.
std::vector<EGLDisplay> CandidateDisplays() {
  std::vector<EGLDisplay> displays;
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
    displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) {
    EGLDeviceEXT devices[8];
    EGLint count = 0;
    if (eglQueryDevicesEXT(8, devices, &count) == EGL_TRUE) {
      for (EGLint i = 0; i < count; ++i)
        displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
    }
  }
  displays.push_back(eglGetDisplay(EGL_DEFAULT_DISPLAY));
  return displays;
}

EGLContext CreateCoreContext(EGLDisplay display) {
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return EGL_NO_CONTEXT;
  // Surfaceless displays offer no configuration with a window or pbuffer surface, so any configuration with
  // OpenGL is accepted.
  const EGLint config_attributes[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(display, config_attributes, &config, 1, &count) != EGL_TRUE || count < 1)
    return EGL_NO_CONTEXT;
  const EGLint context_attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                       3,
                                       EGL_CONTEXT_MINOR_VERSION,
                                       3,
                                       EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                       EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                       EGL_NONE};
  return eglCreateContext(display, config, EGL_NO_CONTEXT, context_attributes);
}

}  // namespace

// All contexts of the process share the EGL displays, so a display is never terminated here.
struct OffscreenContext::Impl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;

  ~Impl() {
    if (context == EGL_NO_CONTEXT) return;
    if (eglGetCurrentContext() == context)
      eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display, context);
  }
};

OffscreenContext::OffscreenContext() : impl_(std::make_unique<Impl>()) {
  bool has_display = false;
  for (const EGLDisplay display : CandidateDisplays()) {
    EGLint major = 0, minor = 0;
    if (display == EGL_NO_DISPLAY || eglInitialize(display, &major, &minor) != EGL_TRUE) continue;
    has_display = true;
    const EGLContext context = CreateCoreContext(display);
    if (context == EGL_NO_CONTEXT) continue;
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_TRUE) {
      impl_->display = display;
      impl_->context = context;
      return;
    }
    eglDestroyContext(display, context);
  }
  throw Error(has_display ? "Cannot draw without a window: the graphics driver offers no OpenGL 3.3 core "
                            "context; install Mesa's drivers (libgl1-mesa-dri)."
                          : "Cannot draw without a window: EGL finds no graphics driver; install Mesa "
                            "(libegl-mesa0, libgl1-mesa-dri).");
}

OffscreenContext::~OffscreenContext() = default;

void OffscreenContext::MakeCurrent() {
  if (eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl_->context) != EGL_TRUE)
    throw Error("The graphics driver can no longer use the offscreen OpenGL context.");
}

}  // namespace docent::ui
