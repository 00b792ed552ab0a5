// SPDX-License-Identifier: Apache-2.0
#pragma once

// The shader texts, GLSL 3.30 core. Colours leave every shader sRGB-encoded with premultiplied alpha.
// A "image" target keeps the image's top row at the framebuffer's row 0, so that reading it back needs no
// flip; the content atlas has OpenGL's usual orientation.
namespace docent::ui {

extern const char* const kFullScreenVertexShader;
extern const char* const kVideoFragmentShader;
extern const char* const kWarpFragmentShader;
extern const char* const kMeshVertexShader;
extern const char* const kMeshFragmentShader;
extern const char* const kCanvasVertexShader;
extern const char* const kCanvasFragmentShader;

}  // namespace docent::ui
