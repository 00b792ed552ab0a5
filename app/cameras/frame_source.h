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
#include "engine/tracking/tracked_frame.h"

// Where images come from. OpenCamera reads the words of `--camera` and answers with one interface for
// devices, videos, folders and the simulator. One thread at a time may use a source; the session owns it.
namespace docent::app {

// What is known of a source before its first image.
struct SourceInfo {
  std::string name;   // for people and reports: the folder's or file's own name
  bool live = false;  // a device: images come at their own pace and never end
  std::optional<std::uint64_t> frame_count;
  double nominal_fps = 30;                                 // images a second, positive
  std::optional<std::filesystem::path> calibration_path;   // found in the folder
  std::optional<engine::CameraModel> known_camera;         // sources that know their lens without a file
  std::optional<std::filesystem::path> ground_truth_path;  // groundtruth.txt beside the images
  std::optional<std::filesystem::path> segments_path;      // segments.txt beside the images
};

// What a live source has delivered so far, and what of its images was lost on which way.
struct Delivery {
  std::uint64_t delivered = 0;
  std::uint64_t missed = 0;  // gaps in the device's own numbering: nobody had a buffer for them
  std::uint64_t late = 0;    // overtaken by a newer image before anybody asked for them
  std::uint64_t broken = 0;  // could not be decoded
  int reconnections = 0;
  Timestamp median_latency{};  // from the device's time of an image to its delivery, of the newest ones
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // The next image; false at the end, and from then on. Every image is a fresh buffer that nobody writes
  // to again; times grow strictly. Sets time, index and image; leaves `camera` alone. An index that jumps
  // says how many images were lost before this one. Throws Error when the source breaks off; the images
  // before the break have been delivered by then.
  //
  // A source that is waited for (CameraOptions::reconnect) answers with an empty image a few times a second
  // while its device is away, and trouble() says why; time is then the present on the source's clock.
  virtual bool Next(engine::Frame* frame) = 0;

  // The same where it is known that the image comes too late to be used: time and index are set, and
  // sources to whom an image is much work leave it empty.
  virtual bool NextLate(engine::Frame* frame) { return Next(frame); }

  // One sentence for the wearer while there is no image to be had; empty when all is well.
  virtual std::string trouble() const { return {}; }
  virtual Delivery delivery() const { return {}; }

  const SourceInfo& info() const { return info_; }

  // Of a camera that can turn its head; null for others.
  virtual Head* head() const { return head_.get(); }
  void SetHead(std::unique_ptr<Head> head) { head_ = std::move(head); }

 protected:
  SourceInfo info_;

 private:
  std::unique_ptr<Head> head_;
};

// An image format asked of a device; zero means "whatever it likes".
struct DeviceFormat {
  int width_px = 0, height_px = 0;
  double fps = 0;
  std::uint32_t pixel_format = 0;  // V4L2's four-letter code
};

struct CameraOptions {
  DeviceFormat device_format;                      // devices only
  std::chrono::milliseconds device_timeout{2000};  // devices only: how long to wait for one image
  bool reconnect = false;  // devices only: one that is unplugged is waited for instead of being an Error
  // Devices only: after so many images, automatic exposure, gain, white balance and focus are held as they
  // have settled, because a tracker needs the same things to look the same; 0 leaves them alone.
  int lock_controls_after = 0;
  double image_fps = 30;   // plain numbered images, which have no times
  std::uint64_t seed = 1;  // the simulator's noise
};

// `source` is a word of command-line.md: a device, a file, a folder, or sim:SCENE. Throws Error with one
// sentence when it cannot be opened.
std::unique_ptr<FrameSource> OpenCamera(const std::string& source, const CameraOptions& options = {});

// "640x480@30" or "640x480". Throws Error otherwise.
DeviceFormat ParseDeviceFormat(const std::string& text);

// Keeps the decoding libraries from writing to standard error by themselves: what went wrong is said by the
// Error. To be called once, before the first source is opened; variables that are set already stay.
void QuietDecoders();

}  // namespace docent::app
