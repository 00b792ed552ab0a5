// SPDX-License-Identifier: Apache-2.0
#include "ui/command_text.h"

#include <charconv>
#include <cmath>

namespace docent::ui {
namespace {

// Formats a number independently of the user's locale, unlike printf, and without trailing zeros.
std::string Number(double value) {
  char text[64];
  const double rounded = std::round(value * 100.0) / 100.0;
  const std::to_chars_result end = std::to_chars(text, text + sizeof text, rounded);
  return {text, end.ptr};
}

std::string AtPixel(const Eigen::Vector2d& pixel) {
  return " at pixel " + Number(pixel.x()) + " " + Number(pixel.y());
}

}  // namespace

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '\n') {
      quoted += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

std::string NewMapCommand(const std::string& name) {
  return "map new " + Quoted(name);
}

std::string PlaceCommand(const std::string& file, const Eigen::Vector2d& pixel, double scale,
                         double yaw_deg) {
  std::string command = "place " + Quoted(file) + AtPixel(pixel);
  if (scale != 1.0) {
    char text[64];
    command +=
        " scale " +
        std::string(text, std::to_chars(text, text + sizeof text, scale, std::chars_format::general, 6).ptr);
  }
  if (yaw_deg != 0.0) command += " yaw " + Number(yaw_deg);
  return command;
}

std::string SignpostCommand(const std::string& text, const Eigen::Vector2d& pixel,
                            const std::string& to_map) {
  return "signpost " + Quoted(text) + AtPixel(pixel) +
         (to_map.empty() ? std::string() : " to " + Quoted(to_map));
}

}  // namespace docent::ui
