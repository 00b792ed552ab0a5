// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

// The shader sources, in GLSL 3.30 core. All output colours are sRGB-encoded with premultiplied alpha. An
// image target stores the image's top row in framebuffer row 0, so that it can be read back without a flip;
// the content atlas has OpenGL's usual orientation.
namespace docent::ui {

extern const char* const kFullScreenVertexShader;
extern const char* const kVideoFragmentShader;
extern const char* const kMeshVertexShader;
extern const char* const kMeshFragmentShader;
extern const char* const kSurfaceVertexShader;
extern const char* const kSurfaceFragmentShader;
extern const char* const kCanvasVertexShader;
extern const char* const kCanvasShapeFragmentShader;
extern const char* const kCanvasImageFragmentShader;
// The lens warp of content in the atlas, with the functions of degradation_shader.h.
std::string WarpFragmentShader();

}  // namespace docent::ui
