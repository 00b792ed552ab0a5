// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

// The shaders that put content into the room: its shadows, and what hides it. As shaders.h.
namespace docent::ui {

// A rectangle in the map from four vertices without attributes.
extern const char* const kPlaneVertexShader;
// How much light the casters take from a surface of the map, and from the plane that a caster stands on where
// no surface is known.
std::string ShadowOnSurfacesShader();
std::string ShadowOnPlaneShader();
// The lens warp of content that surfaces hide and that casts shadows, with the functions of
// degradation_shader.h.
std::string RoomWarpFragmentShader();

}  // namespace docent::ui
