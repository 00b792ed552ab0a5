// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "app/cameras/head.h"
#include "engine/geometry/camera_model.h"
#include "engine/vision/frame.h"

// Sources of images: OpenCamera parses the value of `--camera` and returns one interface for devices, videos,
// image folders and the simulator. One thread at a time may use a source; CalibratedCamera owns it.
namespace docent::app {

// Properties of a source that are known before its first image.
struct SourceInfo {
  std::string name;   // Name of the folder or file, for messages and reports.
  bool live = false;  // A device, which delivers images at its own rate without end.
  // Empty if it is unknown or has no end. Of a video without times, what its header states, which can be more
  // than it has.
  std::optional<std::uint64_t> frame_count;
  // Time from the first to the last image; empty if it is not known before the images are read.
  std::optional<Timestamp> duration;
  double nominal_fps = 30;                                 // Images per second, positive.
  std::optional<std::filesystem::path> calibration_path;   // Found in the folder.
  std::optional<engine::CameraModel> known_camera;         // For sources that need no calibration file.
  std::optional<std::filesystem::path> ground_truth_path;  // groundtruth.txt in the folder.
  std::optional<std::filesystem::path> segments_path;      // segments.txt in the folder.
};

// Statistics of a live source: how many images it has delivered, and how others were lost.
struct Delivery {
  std::uint64_t delivered = 0;  // Images that were returned.
  std::uint64_t missed = 0;     // Gaps in the device's sequence numbers: it had no free buffer.
  std::uint64_t late = 0;       // Replaced by a newer image before they were fetched.
  std::uint64_t broken = 0;     // Could not be decoded.
  int reconnections = 0;        // How often a device that was unplugged came back.
  Timestamp median_latency{};   // From capture to delivery, over the last 128 images.
};

// Images in the order of their times. Recordings deliver all their images; devices the newest one.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Delivers the next image; returns false at the end and from then on. Each image is a new buffer that is
  // not written to again, and timestamps increase strictly. Sets time, index and image, but not `camera`. A
  // gap in the indices is the number of images lost before this one. Throws Error when the source fails; all
  // images before the failure have then been delivered.
  //
  // With CameraOptions::reconnect, a disconnected device delivers an empty image a few times a second, and
  // trouble() says why. The time is then the current time of the source's clock.
  virtual bool Next(engine::Frame* frame) = 0;

  // Like Next, but for an image that will be dropped: sets time and index. Sources that can pass over an
  // image without decoding or rendering it leave it empty.
  virtual bool NextLate(engine::Frame* frame) { return Next(frame); }
  // The time of the next image, if it is known before the image is delivered.
  virtual std::optional<Timestamp> NextTime() const { return std::nullopt; }

  // One sentence for the user while there are no images; empty otherwise.
  virtual std::string trouble() const { return {}; }
  // Statistics of a device; zero for other sources.
  virtual Delivery delivery() const { return {}; }

  // What is known of the source; does not change.
  const SourceInfo& info() const { return info_; }

  // The pan-tilt head of the camera; null without one.
  virtual Head* head() const { return head_.get(); }
  // Gives the camera a pan-tilt head.
  void SetHead(std::unique_ptr<Head> head) { head_ = std::move(head); }

 protected:
  SourceInfo info_;  // Filled in by the constructor of the source.

 private:
  std::unique_ptr<Head> head_;
};

// Requested image format of a device; zero leaves the choice to the device.
struct DeviceFormat {
  int width_px = 0, height_px = 0;  // Of the image.
  double fps = 0;                   // Images per second.
  std::uint32_t pixel_format = 0;   // V4L2 FourCC.
};

// Value of CameraOptions::lock_controls_after: one second at 30 images/s, after which automatic exposure has
// settled.
inline constexpr int kImagesUntilSettled = 30;

// How a source is opened. Fields for other kinds of sources are ignored.
struct CameraOptions {
  DeviceFormat device_format;                      // Devices only.
  std::chrono::milliseconds device_timeout{2000};  // Devices only: maximum wait for one image.
  bool reconnect = false;  // Devices only: wait for an unplugged device instead of throwing Error.
  // Devices only: number of images after which automatic exposure, gain, white balance and focus are locked
  // at their present values, because changing brightness disturbs patch matching; 0 never locks them.
  int lock_controls_after = 0;
  double image_fps = 30;   // Frame rate of numbered images, which have no timestamps.
  std::uint64_t seed = 1;  // Seed of the simulator.
};

// Opens a source: a device, a file, a folder, or sim:SCENE. Throws Error with one sentence when it cannot be
// opened.
std::unique_ptr<FrameSource> OpenCamera(const std::string& source, const CameraOptions& options = {});

// Parses "640x480@30" or "640x480". Throws Error otherwise.
DeviceFormat ParseDeviceFormat(const std::string& text);

// Prevents the decoding libraries from writing to standard error, because failures are reported as Error.
// Call it once, before the first source is opened. Environment variables that are already set are kept.
void QuietDecoders();

}  // namespace docent::app
