// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>

// What a person does in the window, as lines of the script language: the window and a script file are then
// carried out alike. Pure functions; a line has no time and no line end.
namespace docent::ui {

// In double quotes, with backslashes before quotes and backslashes, and \n for a line end.
std::string Quoted(const std::string& text);

std::string NewMapCommand(const std::string& name);
// Pixels with two decimals, the scale and the angle (degrees) only where they say something.
std::string PlaceCommand(const std::string& file, const Eigen::Vector2d& pixel, double scale, double yaw_deg);
std::string SignpostCommand(const std::string& text, const Eigen::Vector2d& pixel, const std::string& to_map);

}  // namespace docent::ui
