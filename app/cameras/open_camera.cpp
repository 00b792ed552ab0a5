// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>

#include "app/cameras/device_source.h"
#include "app/cameras/file_sources.h"
#include "app/cameras/frame_source.h"
#include "app/cameras/simulated_source.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

std::unique_ptr<FrameSource> OpenCamera(const std::string& source, const CameraOptions& options) {
  namespace fs = std::filesystem;
  if (source.empty())
    throw Error("The camera's name is empty; give a device, a video, a folder or sim:SCENE.");
  std::error_code error;
  const fs::file_status status = fs::status(source, error);
  const bool is_file = fs::is_directory(status) || fs::is_regular_file(status);  // Also below /dev/shm.
  if (source.starts_with("/dev/") && !is_file) {
    auto device = OpenDevice(source, options);
    device->SetHead(OpenDeviceHead(MakeDeviceSystem(), source));
    return device;
  }
  if (source.starts_with("sim:")) return OpenSimulation(source.substr(4), options);
  if (fs::is_directory(status)) return OpenFolder(source, options);
  if (fs::is_regular_file(status)) return OpenVideo(source);
  throw Error("There is no camera, video or folder '" + source + "'.");
}

DeviceFormat ParseDeviceFormat(const std::string& text) {
  const std::string_view whole = text;
  const std::size_t cross = whole.find('x'), at = whole.find('@');
  const auto fail = [&]() -> DeviceFormat {
    throw Error("'" + text + "' is not a camera format; use 640x480 or 640x480@30.");
  };
  if (cross == std::string_view::npos || (at != std::string_view::npos && at < cross)) return fail();
  const auto width = ParseInteger(whole.substr(0, cross));
  const auto height =
      ParseInteger(whole.substr(cross + 1, at == std::string_view::npos ? at : at - cross - 1));
  constexpr std::int64_t kMaxSide = 16384;
  if (!width || !height || *width < 1 || *height < 1 || *width > kMaxSide || *height > kMaxSide)
    return fail();
  DeviceFormat format{static_cast<int>(*width), static_cast<int>(*height), 0};
  if (at != std::string_view::npos) {
    const auto fps = ParseNumber(whole.substr(at + 1));
    if (!fps || *fps <= 0 || *fps > 1000) return fail();
    format.fps = *fps;
  }
  return format;
}

void QuietDecoders() {
  setenv("OPENCV_LOG_LEVEL", "SILENT", 0);
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // AV_LOG_QUIET
}

}  // namespace docent::app
