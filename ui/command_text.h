// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>

// Formats what a person does in the window as lines of the script language, so that the window and script
// files use the same interpreter. All functions are pure. The lines have no time stamp and no line end.
namespace docent::ui {

// Encloses text in double quotes, escapes quotes and backslashes with a backslash, and writes a line end as
// \n.
std::string Quoted(const std::string& text);

std::string NewMapCommand(const std::string& name);
// Pixel coordinates have two decimals. The scale and the yaw angle (degrees) are left out when they have
// their default values 1 and 0.
std::string PlaceCommand(const std::string& file, const Eigen::Vector2d& pixel, double scale, double yaw_deg);
std::string SignpostCommand(const std::string& text, const Eigen::Vector2d& pixel, const std::string& to_map);

}  // namespace docent::ui
