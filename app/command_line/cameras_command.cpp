// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cameras/device_source.h"
#include "app/command_line/program.h"
#include "app/files/text_file.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

void PrintJson(const std::vector<DeviceDescription>& devices) {
  Json json = {{"cameras", Json::array()}};
  for (const DeviceDescription& device : devices) {
    Json entry = {{"path", device.path},       {"card", device.card},      {"driver", device.driver},
                  {"trouble", device.trouble}, {"formats", Json::array()}, {"controls", Json::array()}};
    for (const DevicePixelFormat& format : device.formats) {
      Json sizes = Json::array();
      for (const DeviceSize& size : format.sizes) {
        sizes.push_back({{"width", size.width_px}, {"height", size.height_px}, {"fps", size.fps}});
      }
      entry["formats"].push_back(
          {{"fourcc", format.fourcc}, {"description", format.description}, {"sizes", sizes}});
    }
    for (const DeviceControl& control : device.controls) {
      entry["controls"].push_back({{"name", control.name},
                                   {"minimum", control.minimum},
                                   {"maximum", control.maximum},
                                   {"step", control.step},
                                   {"default", control.default_value},
                                   {"value", control.value}});
    }
    json["cameras"].push_back(std::move(entry));
  }
  std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
}

void PrintText(const std::vector<DeviceDescription>& devices) {
  if (devices.empty()) std::puts("No camera found: no /dev/video device captures images.");
  for (const DeviceDescription& device : devices) {
    if (!device.trouble.empty()) {
      std::printf("%s  %s\n", device.path.c_str(), device.trouble.c_str());
      continue;
    }
    std::printf("%s  %s (%s)\n", device.path.c_str(), device.card.c_str(), device.driver.c_str());
    for (const DevicePixelFormat& format : device.formats) {
      std::printf("  %s  %s\n", format.fourcc.c_str(), format.description.c_str());
      for (const DeviceSize& size : format.sizes) {
        std::string rates;
        for (const double fps : size.fps) rates += (rates.empty() ? " @ " : ", ") + FormatNumber(fps, 4);
        std::printf("    %dx%d%s\n", size.width_px, size.height_px, rates.c_str());
      }
    }
    for (const DeviceControl& control : device.controls) {
      std::printf("  %s = %lld  (%lld to %lld)\n", control.name.c_str(),
                  static_cast<long long>(control.value), static_cast<long long>(control.minimum),
                  static_cast<long long>(control.maximum));
    }
  }
}

}  // namespace

void AddCamerasCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* command = AddSubcommand(program, "cameras", "List video devices with their formats and controls",
                                    "docent cameras");
  const auto as_json = std::make_shared<bool>(false);
  command->add_flag("--json", *as_json, "Print JSON");
  command->callback([=] {
    invocation->run = [as_json] {
      const std::vector<DeviceDescription> devices = ListDevices(MakeDeviceSystem().get());
      *as_json ? PrintJson(devices) : PrintText(devices);
    };
  });
}

}  // namespace docent::app
