// SPDX-License-Identifier: Apache-2.0
// Runs as the only program of an emulated machine (run_in_qemu.sh), with cameras provided by the kernel's
// vivid and v4l2loopback drivers. The machine is slow, so that no test measures speed.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <turbojpeg.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numeric>
#include <opencv2/core.hpp>
#include <thread>

#include "app/cameras/device_source.h"
#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/base/worker.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kVivid[] = "/dev/video0", kLoopback[] = "/dev/video9";

// The open device files and mapped device memory of the process, to detect leaks.
std::vector<std::string> HeldDevices() {
  std::vector<std::string> held;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code error;
    const std::string target = std::filesystem::read_symlink(entry, error);
    if (target.starts_with("/dev/video")) held.push_back(target);
  }
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    if (line.find("/dev/video") != std::string::npos) held.push_back(line);
  }
  return held;
}

// Sets a control of vivid by its name in the driver.
void SetByName(const std::string& name, std::int64_t value) {
  const auto system = MakeDeviceSystem();
  const int file = system->Open(kVivid);
  ASSERT_GE(file, 0);
  // Button controls have no value and are missing from the device description, so the names are queried here.
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  bool found = false;
  while (!found && ioctl(file, VIDIOC_QUERYCTRL, &query) == 0) {
    found = name == reinterpret_cast<const char*>(query.name);
    if (found) {
      EXPECT_TRUE(WriteControl(system.get(), file, query.id, value)) << name;
    }
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  system->Close(file);
  EXPECT_TRUE(found) << "vivid has no control '" << name << "'";
}

CameraOptions Options(std::uint32_t pixel_format) {
  CameraOptions options;
  options.device_format = {640, 480, 0, pixel_format};
  options.device_timeout = std::chrono::seconds(20);
  return options;
}

// Fetches images, checks their sizes, times, indices and counters, and returns the last frame.
engine::Frame Fetch(FrameSource* source, int count) {
  engine::Frame frame;
  std::optional<Timestamp> time;
  std::optional<std::uint64_t> index;
  for (int i = 0; i < count; ++i) {
    EXPECT_TRUE(source->Next(&frame));
    EXPECT_EQ(frame.image.size(), cv::Size(640, 480));
    if (time) {
      EXPECT_GT(frame.time, *time);
    }
    if (index) {
      EXPECT_GT(frame.index, *index);
    }
    time = frame.time;
    index = frame.index;
  }
  const Delivery delivery = source->delivery();
  EXPECT_EQ(frame.index + 1, delivery.delivered + delivery.missed + delivery.late + delivery.broken);
  return frame;
}

TEST(Vivid, ListsFormatsAndControls) {
  const auto devices = ListDevices(MakeDeviceSystem().get());
  ASSERT_FALSE(devices.empty());
  EXPECT_EQ(devices.front().path, kVivid);
  EXPECT_EQ(devices.front().driver, "vivid");
  const auto& formats = devices.front().formats;
  const auto yuyv = std::find_if(formats.begin(), formats.end(),
                                 [](const DevicePixelFormat& format) { return format.fourcc == "YUYV"; });
  ASSERT_NE(yuyv, formats.end());
  const auto size = std::find_if(yuyv->sizes.begin(), yuyv->sizes.end(),
                                 [](const DeviceSize& s) { return s.width_px == 640 && s.height_px == 480; });
  ASSERT_NE(size, yuyv->sizes.end());
  EXPECT_FALSE(size->fps.empty());
  EXPECT_FALSE(devices.front().controls.empty());
  EXPECT_THAT(HeldDevices(), IsEmpty());
}

TEST(Vivid, DeliversSixtyYuyvImagesInOrderAndReleasesTheDevice) {
  {
    const auto source = OpenDevice(kVivid, Options(V4L2_PIX_FMT_YUYV));
    Fetch(source.get(), 60);
    EXPECT_EQ(source->delivery().delivered, 60u);
    EXPECT_EQ(source->delivery().broken, 0u);
    // The time stamps come from the clock that the latency is measured with.
    EXPECT_LT(source->delivery().median_latency, std::chrono::seconds(20));
    EXPECT_FALSE(HeldDevices().empty());
  }
  EXPECT_THAT(HeldDevices(), IsEmpty());
}

// Every pixel format must give the same test image. Its lower part contains no text.
TEST(Vivid, GivesTheSameImageInEveryPixelFormat) {
  const cv::Rect bars(0, 300, 640, 100);
  const auto column_means = [&](std::uint32_t pixel_format) {
    const auto source = OpenDevice(kVivid, Options(pixel_format));
    const cv::Mat image = Fetch(source.get(), 2).image;
    cv::Mat means;
    cv::reduce(image(bars), means, 0, cv::REDUCE_AVG, CV_32F);
    return means;
  };
  const cv::Mat yuyv = column_means(V4L2_PIX_FMT_YUYV), nv12 = column_means(V4L2_PIX_FMT_NV12);
  ASSERT_EQ(yuyv.type(), CV_32FC3);
  EXPECT_LT(cv::norm(yuyv, nv12, cv::NORM_L1) / (640 * 3), 3);
  double darkest = 0, brightest = 0;
  cv::minMaxLoc(yuyv.reshape(1), &darkest, &brightest);
  EXPECT_GT(brightest - darkest, 100);  // colour bars, not a uniform image
  const cv::Mat grey = column_means(V4L2_PIX_FMT_GREY);
  ASSERT_EQ(grey.type(), CV_32FC1);
  cv::Mat expected;
  cv::transform(yuyv, expected, cv::Matx13f(0.114f, 0.587f, 0.299f));
  // Device luma may be limited to 16-235, so the two agree up to a linear function.
  cv::Scalar mean_a, deviation_a, mean_b, deviation_b;
  cv::meanStdDev(grey, mean_a, deviation_a);
  cv::meanStdDev(expected, mean_b, deviation_b);
  const double correlation =
      cv::mean((grey - mean_a).mul(expected - mean_b))[0] / (deviation_a[0] * deviation_b[0]);
  EXPECT_GT(correlation, 0.95);  // colours outside the displayable range are clipped
}

TEST(Vivid, CountsDroppedImages) {
  SetByName("Percentage of Dropped Buffers", 30);
  {
    const auto source = OpenDevice(kVivid, Options(V4L2_PIX_FMT_YUYV));
    Fetch(source.get(), 60);
    const Delivery delivery = source->delivery();
    // The driver drops three images in ten, and a slow machine may drop more. With 60 delivered images about
    // 26 are dropped, and fewer than 8 with a probability below one in ten thousand.
    EXPECT_GE(delivery.missed, 8u);
  }
  SetByName("Percentage of Dropped Buffers", 0);
}

TEST(Vivid, SkipsABrokenImage) {
  const auto source = OpenDevice(kVivid, Options(V4L2_PIX_FMT_YUYV));
  Fetch(source.get(), 2);
  // On a slow machine a newer image may be there already, and the broken one is then late and not looked at.
  for (int attempt = 0; attempt < 20 && source->delivery().broken == 0; ++attempt) {
    SetByName("Inject V4L2_BUF_FLAG_ERROR", 1);
    Fetch(source.get(), 10);
  }
  EXPECT_EQ(source->delivery().broken, 1u);
}

TEST(Vivid, DeliversTheNewestImageToASlowReader) {
  const auto source = OpenDevice(kVivid, Options(V4L2_PIX_FMT_YUYV));
  Fetch(source.get(), 2);
  for (int attempt = 0; attempt < 20 && source->delivery().late == 0; ++attempt) {
    std::this_thread::sleep_for(std::chrono::seconds(1));
    Fetch(source.get(), 1);
  }
  EXPECT_GE(source->delivery().late, 1u);
}

TEST(Vivid, ReportsThatItWasUnplugged) {
  const auto source = OpenDevice(kVivid, Options(V4L2_PIX_FMT_YUYV));
  Fetch(source.get(), 2);
  SetByName("Disconnect", 1);
  engine::Frame frame;
  std::string sentence;
  try {
    for (int i = 0; i < 20; ++i) source->Next(&frame);
  } catch (const Error& error) {
    sentence = error.what();
  }
  EXPECT_THAT(sentence, HasSubstr("unplugged"));
  EXPECT_THAT(HeldDevices(), IsEmpty());
}

TEST(Vivid, ContinuesAfterReconnection) {
  CameraOptions options = Options(V4L2_PIX_FMT_YUYV);
  options.reconnect = true;
  const auto source = OpenDevice(kVivid, options);
  const engine::Frame before = Fetch(source.get(), 5);
  // vivid reappears only after its last user has closed it, so that this open file keeps it unplugged.
  const int holder = open(kVivid, O_RDWR);
  ASSERT_GE(holder, 0);
  SetByName("Disconnect", 1);
  engine::Frame frame;
  for (int i = 0; i < 50 && source->trouble().empty(); ++i) ASSERT_TRUE(source->Next(&frame));
  EXPECT_THAT(source->trouble(), HasSubstr("unplugged"));
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_TRUE(frame.image.empty());
  }
  close(holder);
  for (int i = 0; i < 50 && !source->trouble().empty(); ++i) ASSERT_TRUE(source->Next(&frame));
  EXPECT_EQ(source->trouble(), "");
  const engine::Frame after = Fetch(source.get(), 5);
  EXPECT_GT(after.time, before.time);
  EXPECT_EQ(source->delivery().reconnections, 1);
}

TEST(Vivid, LocksTheAutomaticGainAndRestoresIt) {
  const auto gain = [] {
    const auto system = MakeDeviceSystem();
    const int file = system->Open(kVivid);
    const auto value = ReadControl(system.get(), file, V4L2_CID_AUTOGAIN);
    system->Close(file);
    return value;
  };
  ASSERT_EQ(gain(), 1);
  {
    CameraOptions options = Options(V4L2_PIX_FMT_YUYV);
    options.lock_controls_after = 3;
    const auto source = OpenDevice(kVivid, options);
    Fetch(source.get(), 2);
    EXPECT_EQ(gain(), 1);
    Fetch(source.get(), 2);
    EXPECT_EQ(gain(), 0);
  }
  EXPECT_EQ(gain(), 1);
}

constexpr int kNumbers = 64;  // six bits

// An image that encodes a number as six black or white stripes.
cv::Mat Numbered(int number) {
  cv::Mat image(480, 640, CV_8UC3, cv::Scalar::all(30));
  for (int bit = 0; bit < 6; ++bit) {
    if ((number >> bit & 1) != 0) image(cv::Rect(80 * bit, 0, 80, 480)).setTo(cv::Scalar::all(220));
  }
  return image;
}

int NumberOf(const cv::Mat& image) {
  int number = 0;
  for (int bit = 0; bit < 6; ++bit) {
    if (cv::mean(image(cv::Rect(80 * bit + 20, 100, 40, 200)))[0] > 128) number |= 1 << bit;
  }
  return number;
}

// Feeds Motion-JPEG images into the loopback device until destruction. The loopback driver writes over images
// that nobody has fetched, and over those that are being read, so that on a busy machine any number of them
// may be lost or arrive twice. A test that counts them names the last one that it received, and the feeder
// then stays at most three images ahead of it, which fit into the four buffers of the reader, unless
// `longest_wait` passes.
class JpegFeeder {
 public:
  explicit JpegFeeder(std::chrono::milliseconds longest_wait = std::chrono::milliseconds(0))
      : file_(open(kLoopback, O_RDWR)) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = 640;
    format.fmt.pix.height = 480;
    format.fmt.pix.pixelformat = V4L2_PIX_FMT_MJPEG;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    format.fmt.pix.sizeimage = 640 * 480;
    EXPECT_EQ(ioctl(file_, VIDIOC_S_FMT, &format), 0);
    const tjhandle encoder = tjInitCompress();
    for (int number = 0; number < kNumbers; ++number) {
      const cv::Mat image = Numbered(number);
      unsigned char* bytes = nullptr;
      unsigned long size = 0;
      EXPECT_EQ(tjCompress2(encoder, image.data, 640, 0, 480, TJPF_BGR, &bytes, &size, TJSAMP_422, 80, 0), 0);
      images_.emplace_back(bytes, bytes + size);
      tjFree(bytes);
    }
    tjDestroy(encoder);
    EXPECT_GT(write(file_, images_[0].data(), images_[0].size()), 0);
    worker_.emplace("feeder", [this, longest_wait](const std::stop_token& stop) {
      for (int number = 1; !stop.stop_requested(); number = (number + 1) % kNumbers) {
        const auto& bytes = images_[static_cast<std::size_t>(number)];
        if (write(file_, bytes.data(), bytes.size()) < 0) return;
        std::this_thread::sleep_for(std::chrono::milliseconds(40));
        const auto end = std::chrono::steady_clock::now() + longest_wait;
        while (!stop.stop_requested() && (number - received_ + kNumbers) % kNumbers > 2 &&
               std::chrono::steady_clock::now() < end) {
          std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
      }
    });
  }
  ~JpegFeeder() {
    worker_.reset();
    close(file_);
  }

  void Received(int number) { received_ = number; }

 private:
  int file_;
  std::vector<std::vector<unsigned char>> images_;
  std::atomic<int> received_{0};
  std::optional<Worker> worker_;
};

TEST(Loopback, DeliversSixtyMotionJpegImagesInOrder) {
  JpegFeeder feeder(std::chrono::seconds(20));
  const auto source = OpenDevice(kLoopback, Options(V4L2_PIX_FMT_MJPEG));
  engine::Frame frame;
  std::vector<int> steps;
  int last = -1;
  for (int i = 0; i < 60; ++i) {
    frame = Fetch(source.get(), 1);
    ASSERT_EQ(frame.image.type(), CV_8UC3);
    const int number = NumberOf(frame.image);
    if (last >= 0) steps.push_back((number - last + kNumbers) % kNumbers);
    last = number;
    feeder.Received(number);
  }
  // The images must be in order without repetition; a slow machine may skip some.
  for (const int step : steps) EXPECT_TRUE(step >= 1 && step < kNumbers / 2) << step;
}

TEST(Devices, WorkInParallel) {
  const JpegFeeder feeder;
  const auto jpeg = OpenDevice(kLoopback, Options(V4L2_PIX_FMT_MJPEG));
  const auto yuyv = OpenDevice(kVivid, Options(V4L2_PIX_FMT_YUYV));
  std::thread other([&] { Fetch(jpeg.get(), 10); });
  Fetch(yuyv.get(), 10);
  other.join();
}

TEST(Devices, HandleStartsStopsAndUnpluggingInRandomOrder) {
  Random random(7);
  for (int round = 0; round < 12; ++round) {
    CameraOptions options = Options(random.Below(2) == 0 ? V4L2_PIX_FMT_YUYV : V4L2_PIX_FMT_NV12);
    options.reconnect = true;
    options.lock_controls_after = static_cast<int>(random.Below(3));
    const auto source = OpenDevice(kVivid, options);
    engine::Frame frame;
    const auto unplugged_at = random.Below(8);
    for (std::uint32_t i = 0; i < 6; ++i) {
      if (i == unplugged_at) SetByName("Disconnect", 1);
      ASSERT_TRUE(source->Next(&frame));
    }
  }
  EXPECT_THAT(HeldDevices(), IsEmpty());
}

}  // namespace
}  // namespace docent::app

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
