// SPDX-License-Identifier: Apache-2.0
#include "ui/gl_objects.h"

#include <algorithm>
#include <vector>

#include "engine/base/error.h"

namespace docent::ui {
namespace {

GLuint CompileShader(const char* name, GLenum kind, const std::string& source) {
  const GLuint shader = glCreateShader(kind);
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return shader;
  std::vector<char> log(4096, '\0');
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
  glDeleteShader(shader);
  throw Error(std::string("The OpenGL driver cannot compile the shader '") + name + "': " + log.data());
}

void CheckFramebuffer(int width_px, int height_px) {
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error("The OpenGL driver cannot draw into an image of " + std::to_string(width_px) + " x " +
                std::to_string(height_px) + " pixels.");
  }
}

}  // namespace

GlProgram::GlProgram(const char* name, const std::string& vertex_source, const std::string& fragment_source) {
  const GLuint vertex = CompileShader(name, GL_VERTEX_SHADER, vertex_source);
  GLuint fragment = 0;
  try {
    fragment = CompileShader(name, GL_FRAGMENT_SHADER, fragment_source);
  } catch (const Error&) {
    glDeleteShader(vertex);
    throw;
  }
  name_ = glCreateProgram();
  glAttachShader(name_, vertex);
  glAttachShader(name_, fragment);
  glLinkProgram(name_);
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  GLint linked = GL_FALSE;
  glGetProgramiv(name_, GL_LINK_STATUS, &linked);
  if (linked == GL_TRUE) return;
  std::vector<char> log(4096, '\0');
  glGetProgramInfoLog(name_, static_cast<GLsizei>(log.size()), nullptr, log.data());
  glDeleteProgram(name_);
  throw Error(std::string("The OpenGL driver cannot link the shader '") + name + "': " + log.data());
}

GlProgram::~GlProgram() {
  glDeleteProgram(name_);
}

GLint GlProgram::Uniform(const char* uniform) const {
  const auto found = locations_.find(uniform);
  if (found != locations_.end()) return found->second;
  const GLint location = glGetUniformLocation(name_, uniform);
  locations_.emplace(uniform, location);
  return location;
}

void GlProgram::AssignTextureUnits(std::initializer_list<const char*> samplers) const {
  Use();
  int unit = 0;
  for (const char* sampler : samplers) glUniform1i(Uniform(sampler), unit++);
}

RenderTarget::RenderTarget(int width_px, int height_px, int samples, bool with_depth)
    : width_px_(width_px), height_px_(height_px) {
  GLint most_samples = 1;
  glGetIntegerv(GL_MAX_SAMPLES, &most_samples);
  samples_ = std::clamp(samples, 1, std::max(1, most_samples));

  glBindTexture(GL_TEXTURE_2D, texture_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width_px, height_px, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_.name(), 0);
  if (samples_ > 1) {
    CheckFramebuffer(width_px, height_px);
    glBindFramebuffer(GL_FRAMEBUFFER, multisampled_framebuffer_.name());
    glBindRenderbuffer(GL_RENDERBUFFER, multisampled_color_.name());
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples_, GL_RGBA8, width_px, height_px);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                              multisampled_color_.name());
  }
  if (samples_ > 1 || with_depth) {
    glBindRenderbuffer(GL_RENDERBUFFER, depth_.name());
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples_ > 1 ? samples_ : 0, GL_DEPTH_COMPONENT24,
                                     width_px, height_px);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_.name());
  }
  CheckFramebuffer(width_px, height_px);
}

void RenderTarget::BindForDrawing() const {
  glBindFramebuffer(GL_FRAMEBUFFER, samples_ > 1 ? multisampled_framebuffer_.name() : framebuffer_.name());
  glViewport(0, 0, width_px_, height_px_);
}

void RenderTarget::Resolve(int x, int y, int width, int height) const {
  if (samples_ <= 1) return;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, multisampled_framebuffer_.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer_.name());
  glBlitFramebuffer(x, y, x + width, y + height, x, y, x + width, y + height, GL_COLOR_BUFFER_BIT,
                    GL_NEAREST);
}

void RenderTarget::CopyDepth(int x, int y, int width, int height, const DepthTarget& target) const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER,
                    samples_ > 1 ? multisampled_framebuffer_.name() : framebuffer_.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer());
  glBlitFramebuffer(x, y, x + width, y + height, x, y, x + width, y + height, GL_DEPTH_BUFFER_BIT,
                    GL_NEAREST);
}

DepthTarget::DepthTarget(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, width_px, height_px, 0, GL_DEPTH_COMPONENT,
               GL_UNSIGNED_INT, nullptr);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  for (const GLenum direction : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTexParameteri(GL_TEXTURE_2D, direction, GL_CLAMP_TO_EDGE);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, texture_.name(), 0);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  CheckFramebuffer(width_px, height_px);
}

void DepthTarget::BindForDrawing() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glViewport(0, 0, width_px_, height_px_);
}

void DepthTarget::CopyTo(const DepthTarget& target) const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer());
  glBlitFramebuffer(0, 0, width_px_, height_px_, 0, 0, width_px_, height_px_, GL_DEPTH_BUFFER_BIT,
                    GL_NEAREST);
}

void DrawFullScreenTriangle() {
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace docent::ui
