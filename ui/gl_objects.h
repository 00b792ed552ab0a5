// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <epoxy/gl.h>

#include <initializer_list>
#include <string>
#include <unordered_map>
#include <utility>

// RAII owners of OpenGL objects. They delete their object on destruction, are movable and cannot be copied.
// The context in which they were constructed must be current throughout their lives. This header is private
// to ui/: include it only from source files and from headers that are private to ui/.
namespace docent::ui {

template <void (*Generate)(GLuint*), void (*Delete)(GLuint)>
class GlHandle {
 public:
  GlHandle() { Generate(&name_); }
  ~GlHandle() {
    if (name_ != 0) Delete(name_);
  }
  GlHandle(GlHandle&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlHandle& operator=(GlHandle&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GlHandle(const GlHandle&) = delete;
  GlHandle& operator=(const GlHandle&) = delete;
  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

namespace gl_detail {
inline void GenerateTexture(GLuint* name) {
  glGenTextures(1, name);
}
inline void DeleteTexture(GLuint name) {
  glDeleteTextures(1, &name);
}
inline void GenerateBuffer(GLuint* name) {
  glGenBuffers(1, name);
}
inline void DeleteBuffer(GLuint name) {
  glDeleteBuffers(1, &name);
}
inline void GenerateVertexArray(GLuint* name) {
  glGenVertexArrays(1, name);
}
inline void DeleteVertexArray(GLuint name) {
  glDeleteVertexArrays(1, &name);
}
inline void GenerateFramebuffer(GLuint* name) {
  glGenFramebuffers(1, name);
}
inline void DeleteFramebuffer(GLuint name) {
  glDeleteFramebuffers(1, &name);
}
inline void GenerateRenderbuffer(GLuint* name) {
  glGenRenderbuffers(1, name);
}
inline void DeleteRenderbuffer(GLuint name) {
  glDeleteRenderbuffers(1, &name);
}
}  // namespace gl_detail

using GlTexture = GlHandle<gl_detail::GenerateTexture, gl_detail::DeleteTexture>;
using GlBuffer = GlHandle<gl_detail::GenerateBuffer, gl_detail::DeleteBuffer>;
using GlVertexArray = GlHandle<gl_detail::GenerateVertexArray, gl_detail::DeleteVertexArray>;
using GlFramebuffer = GlHandle<gl_detail::GenerateFramebuffer, gl_detail::DeleteFramebuffer>;
using GlRenderbuffer = GlHandle<gl_detail::GenerateRenderbuffer, gl_detail::DeleteRenderbuffer>;

// A linked vertex and fragment shader. The constructor throws docent::Error with the driver's log when they
// do not compile.
class GlProgram {
 public:
  GlProgram(const char* name, const std::string& vertex_source, const std::string& fragment_source);
  ~GlProgram();
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  void Use() const { glUseProgram(name_); }
  // Returns the location of a uniform, or -1 when the compiler removed it (OpenGL ignores writes to -1).
  GLint Uniform(const char* uniform) const;
  // Assigns the samplers to texture units 0, 1, 2 … in this order. Called once after construction.
  void AssignTextureUnits(std::initializer_list<const char*> samplers) const;

 private:
  GLuint name_ = 0;
  mutable std::unordered_map<std::string, GLint> locations_;
};

class DepthTarget;

// A colour (RGBA8) and depth buffer to draw into, whose result is available as a texture. With samples > 1,
// drawing goes to multisampled buffers and Resolve averages them into the texture.
class RenderTarget {
 public:
  // `samples` is reduced to the driver's maximum; samples > 1 implies with_depth.
  RenderTarget(int width_px, int height_px, int samples, bool with_depth);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  // Binds the framebuffer for drawing and sets the viewport to all of it.
  void BindForDrawing() const;
  // Resolves what was drawn inside this rectangle (OpenGL's origin at the bottom left) into texture().
  void Resolve(int x, int y, int width, int height) const;
  // Copies the depths inside this rectangle; of several samples, one counts. The target has the same size.
  void CopyDepth(int x, int y, int width, int height, const DepthTarget& target) const;
  GLuint texture() const { return texture_.name(); }
  // The framebuffer whose colour attachment is texture().
  GLuint readable_framebuffer() const { return framebuffer_.name(); }

 private:
  int width_px_, height_px_, samples_;
  GlTexture texture_;
  GlFramebuffer framebuffer_;
  GlFramebuffer multisampled_framebuffer_;
  GlRenderbuffer multisampled_color_, depth_;
};

// Depths to draw into, which are available as a texture: 0 at the near plane, 1 at the far plane and where
// nothing was drawn.
class DepthTarget {
 public:
  DepthTarget(int width_px, int height_px);
  // Binds the framebuffer for drawing and sets the viewport to all of it.
  void BindForDrawing() const;
  // Copies all depths. The target has the same size.
  void CopyTo(const DepthTarget& target) const;
  GLuint texture() const { return texture_.name(); }
  GLuint framebuffer() const { return framebuffer_.name(); }

 private:
  int width_px_, height_px_;
  GlTexture texture_;
  GlFramebuffer framebuffer_;
};

// Draws one triangle that covers the whole viewport. Use it with kFullScreenVertexShader.
void DrawFullScreenTriangle();

}  // namespace docent::ui
