// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/device_source.h"

#include <gmock/gmock.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "app/cameras/device_image.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

constexpr std::uint32_t kDeviceWidth = 8, kDeviceHeight = 4;

// A camera that behaves like a driver with one pixel format and three buffers. The grey value of an image is
// its number.
struct FakeCamera {
  bool plugged_in = true;
  int backlog = 0;                  // queued images besides the next one
  std::uint32_t missed_before = 0;  // sequence numbers skipped before every image but the first
  std::map<std::uint32_t, std::int32_t> controls;
  std::chrono::milliseconds now{100500};
  int width = kDeviceWidth;
  std::uint32_t pixel_format = V4L2_PIX_FMT_GREY;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  int open_error = 0;
  int images_until_unplugged = 1000, images_until_silent = 1000, broken_images = 0;
  std::vector<std::vector<std::uint8_t>> buffers;
  std::vector<std::uint32_t> queue;
  std::uint32_t sequence = 0;
  int delivered = 0, mapped = 0, opened = 0;
  bool streaming = false;
};

class StreamingSystem : public DeviceSystem {
 public:
  explicit StreamingSystem(FakeCamera* camera) : camera_(camera) {}

  int Open(const std::string&) override {
    if (camera_->open_error != 0) return Fail(camera_->open_error);
    if (!camera_->plugged_in) return Fail(ENOENT);
    ++camera_->opened;
    return 7;
  }
  void Close(int) override { --camera_->opened; }
  void* Map(int, std::size_t, long offset) override {
    ++camera_->mapped;
    return camera_->buffers[static_cast<std::size_t>(offset)].data();
  }
  void Unmap(void*, std::size_t) override { --camera_->mapped; }
  std::chrono::nanoseconds Now() override { return camera_->now; }
  void Sleep(std::chrono::milliseconds duration) override { camera_->now += duration; }
  int Wait(int, int timeout_ms) override {
    if (!camera_->plugged_in) return Fail(ENODEV);
    if (timeout_ms == 0) return camera_->backlog > 0 ? 1 : 0;
    if (camera_->delivered >= camera_->images_until_unplugged) return Fail(ENODEV);
    return camera_->delivered >= camera_->images_until_silent ? 0 : 1;
  }

  int Control(int, unsigned long request, void* argument) override {
    if (!camera_->plugged_in) return Fail(ENODEV);
    switch (request) {
      case VIDIOC_G_CTRL:
      case VIDIOC_S_CTRL: {
        auto* control = static_cast<v4l2_control*>(argument);
        const auto found = camera_->controls.find(control->id);
        if (found == camera_->controls.end()) return Fail(EINVAL);
        (request == VIDIOC_G_CTRL ? control->value : found->second) =
            request == VIDIOC_G_CTRL ? found->second : control->value;
        return 0;
      }
      case VIDIOC_QUERYCTRL: {
        auto* query = static_cast<v4l2_queryctrl*>(argument);
        if (query->id != V4L2_CID_PAN_ABSOLUTE || !camera_->controls.contains(query->id)) return Fail(EINVAL);
        query->minimum = -100 * 3600;
        query->maximum = 100 * 3600;
        query->step = 1;
        return 0;
      }
      case VIDIOC_QUERYCAP: {
        auto* capability = static_cast<v4l2_capability*>(argument);
        capability->capabilities = camera_->capabilities;
        std::memcpy(capability->card, "Fake", 5);
        return 0;
      }
      case VIDIOC_TRY_FMT:
      case VIDIOC_S_FMT:
        return SetFormat(static_cast<v4l2_format*>(argument));
      case VIDIOC_G_PARM:
      case VIDIOC_S_PARM:  // drivers return their actual setting
        static_cast<v4l2_streamparm*>(argument)->parm.capture = {V4L2_CAP_TIMEPERFRAME, 0, {1, 15}, 0, 0, {}};
        return 0;
      case VIDIOC_REQBUFS:
        static_cast<v4l2_requestbuffers*>(argument)->count = 3;
        camera_->sequence = 0;
        camera_->queue.clear();
        camera_->buffers.assign(3, std::vector<std::uint8_t>(kDeviceWidth * kDeviceHeight * 2));
        return 0;
      case VIDIOC_QUERYBUF: {
        auto* buffer = static_cast<v4l2_buffer*>(argument);
        buffer->length = kDeviceWidth * kDeviceHeight * 2;
        buffer->m.offset = buffer->index;
        return 0;
      }
      case VIDIOC_QBUF:
        camera_->queue.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_STREAMON:
        camera_->streaming = true;
        return 0;
      case VIDIOC_STREAMOFF:
        camera_->streaming = false;
        return 0;
      case VIDIOC_DQBUF:
        return Deliver(static_cast<v4l2_buffer*>(argument));
      case VIDIOC_ENUM_FMT: {
        auto* format = static_cast<v4l2_fmtdesc*>(argument);
        if (format->index > 0) return Fail(EINVAL);
        format->pixelformat = camera_->pixel_format;
        return 0;
      }
      default:
        return Fail(EINVAL);
    }
  }

 private:
  static int Fail(int error) {
    errno = error;
    return -1;
  }
  int SetFormat(v4l2_format* format) {
    format->fmt.pix.pixelformat = camera_->pixel_format;  // drivers return their actual format
    format->fmt.pix.width = static_cast<std::uint32_t>(camera_->width);
    format->fmt.pix.height = kDeviceHeight;
    format->fmt.pix.bytesperline = 0;
    return 0;
  }
  int Deliver(v4l2_buffer* buffer) {
    if (camera_->queue.empty()) return Fail(EAGAIN);
    buffer->index = camera_->queue.front();
    camera_->queue.erase(camera_->queue.begin());
    if (camera_->streaming && camera_->backlog > 0 && camera_->sequence > 0) --camera_->backlog;
    const int number = camera_->delivered++;
    buffer->flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    if (camera_->sequence > 0) camera_->sequence += camera_->missed_before;
    buffer->sequence = camera_->sequence++;
    std::memset(camera_->buffers[buffer->index].data(), number, kDeviceWidth * kDeviceHeight);
    buffer->bytesused = number < camera_->broken_images ? 3 : kDeviceWidth * kDeviceHeight;
    buffer->timestamp = {100, number * 1000};
    return 0;
  }

  FakeCamera* camera_;
};

std::unique_ptr<FrameSource> Open(FakeCamera* camera, CameraOptions options = {}) {
  return OpenDevice("/dev/video9", options, std::make_unique<StreamingSystem>(camera));
}

TEST(Device, StreamsImagesAndReleasesAllResources) {
  FakeCamera camera;
  {
    const auto source = Open(&camera);
    EXPECT_TRUE(source->info().live);
    EXPECT_DOUBLE_EQ(source->info().nominal_fps, 15);
    std::vector<engine::Frame> frames(10);
    for (engine::Frame& frame : frames) ASSERT_TRUE(source->Next(&frame));
    for (int i = 0; i < 10; ++i) {  // an image does not change when its buffer is reused
      const engine::Frame& frame = frames[static_cast<std::size_t>(i)];
      EXPECT_EQ(frame.image.at<std::uint8_t>(3, 7), i);
      EXPECT_EQ(frame.time, std::chrono::seconds(100) + std::chrono::milliseconds(i));
      EXPECT_EQ(frame.index, static_cast<std::uint64_t>(i));
    }
    EXPECT_TRUE(camera.streaming);
  }
  EXPECT_FALSE(camera.streaming);
  EXPECT_EQ(camera.mapped, 0);
  EXPECT_EQ(camera.opened, 0);
}

TEST(Device, ReportsThatItWasUnplugged) {
  FakeCamera camera;
  camera.images_until_unplugged = 2;
  const auto source = Open(&camera);
  engine::Frame frame;
  ASSERT_TRUE(source->Next(&frame));
  ASSERT_TRUE(source->Next(&frame));
  EXPECT_THAT(ErrorOf([&] { source->Next(&frame); }), HasSubstr("unplugged"));
}

TEST(Device, ContinuesAfterReconnection) {
  FakeCamera camera;
  CameraOptions options;
  options.reconnect = true;
  const auto source = Open(&camera, options);
  engine::Frame frame;
  ASSERT_TRUE(source->Next(&frame));
  EXPECT_FALSE(frame.image.empty());
  const Timestamp before = frame.time;
  camera.plugged_in = false;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_TRUE(frame.image.empty());
    EXPECT_THAT(source->trouble(), HasSubstr("unplugged"));
    EXPECT_EQ(camera.opened, 0);  // closed, so that the device can get the same name again
    EXPECT_EQ(camera.mapped, 0);
  }
  camera.width = kDeviceWidth * 2;
  camera.plugged_in = true;
  ASSERT_TRUE(source->Next(&frame));
  EXPECT_TRUE(frame.image.empty());
  EXPECT_THAT(source->trouble(), HasSubstr("at 8x4"));
  camera.width = kDeviceWidth;
  ASSERT_TRUE(source->Next(&frame));
  EXPECT_FALSE(frame.image.empty());
  EXPECT_EQ(source->trouble(), "");
  EXPECT_GT(frame.time, before);
  EXPECT_EQ(frame.index, 1u);
  EXPECT_EQ(source->delivery().reconnections, 1);
}

TEST(Device, CountsAReconnectionWhenAnImageComesAgain) {
  FakeCamera camera;
  camera.images_until_silent = 1;
  CameraOptions options;
  options.reconnect = true;
  const auto source = Open(&camera, options);
  engine::Frame frame;
  ASSERT_TRUE(source->Next(&frame));
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_TRUE(frame.image.empty());
    EXPECT_THAT(source->trouble(), HasSubstr("sent no image"));
  }
  EXPECT_EQ(source->delivery().reconnections, 0);
  camera.images_until_silent = 1000;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_FALSE(frame.image.empty());
  }
  EXPECT_EQ(source->delivery().reconnections, 1);
}

TEST(Device, ClosesItsHeadTooWhenItIsUnplugged) {
  FakeCamera camera;
  camera.controls = {{V4L2_CID_PAN_ABSOLUTE, 0}};
  CameraOptions options;
  options.reconnect = true;
  {
    const auto source = Open(&camera, options);
    source->SetHead(OpenDeviceHead(std::make_unique<StreamingSystem>(&camera), "/dev/video9"));
    ASSERT_TRUE(source->head());
    EXPECT_EQ(camera.opened, 2);
    engine::Frame frame;
    ASSERT_TRUE(source->Next(&frame));
    camera.plugged_in = false;
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_EQ(camera.opened, 0) << "only then does the device get the same name again";
    camera.plugged_in = true;
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_FALSE(frame.image.empty());
    source->head()->LookAt({1, 0}, FromSeconds(1));
    EXPECT_GT(camera.controls[V4L2_CID_PAN_ABSOLUTE], 0);
  }
  EXPECT_EQ(camera.opened, 0);
}

TEST(Device, CountsImagesThatTheDriverMissed) {
  FakeCamera camera;
  camera.missed_before = 2;
  const auto source = Open(&camera);
  engine::Frame frame;
  for (std::uint64_t i = 0; i < 5; ++i) {
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_EQ(frame.index, 3 * i);
  }
  EXPECT_EQ(source->delivery().missed, 8u);
  EXPECT_EQ(source->delivery().delivered, 5u);
}

TEST(Device, CountsNoImagesWhereItsNumbersJump) {
  FakeCamera camera;
  const auto source = Open(&camera);
  engine::Frame frame;
  ASSERT_TRUE(source->Next(&frame));
  camera.sequence += 1u << 31;
  ASSERT_TRUE(source->Next(&frame));
  EXPECT_EQ(frame.index, 1u);
  EXPECT_EQ(source->delivery().missed, 0u);
}

TEST(Device, DeliversTheNewestImageAndCountsSkippedOnes) {
  FakeCamera camera;
  const auto source = Open(&camera);
  engine::Frame frame;
  ASSERT_TRUE(source->Next(&frame));
  camera.backlog = 2;
  ASSERT_TRUE(source->Next(&frame));
  EXPECT_EQ(frame.image.at<std::uint8_t>(0, 0), 2);  // the backlog holds 1 and 2
  EXPECT_EQ(frame.index, 2u);
  EXPECT_EQ(source->delivery().late, 1u);
}

TEST(Device, LocksAutomaticControlsAfterAWhileAndRestoresThem) {
  FakeCamera camera;
  camera.controls = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY},
                     {V4L2_CID_EXPOSURE_ABSOLUTE, 123},
                     {V4L2_CID_AUTOGAIN, 1},
                     {V4L2_CID_FOCUS_AUTO, 0}};
  const auto before = camera.controls;
  CameraOptions options;
  options.lock_controls_after = 2;
  {
    const auto source = Open(&camera, options);
    engine::Frame frame;
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_EQ(camera.controls, before);
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_EQ(camera.controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
    EXPECT_EQ(camera.controls[V4L2_CID_EXPOSURE_ABSOLUTE], 123);
    EXPECT_EQ(camera.controls[V4L2_CID_AUTOGAIN], 0);
  }
  EXPECT_EQ(camera.controls, before);
}

TEST(Device, MeasuresTheLatencyOfItsImages) {
  FakeCamera camera;
  const auto source = Open(&camera);
  engine::Frame frame;
  ASSERT_TRUE(source->Next(&frame));  // taken at 100 s, and it is 100.5 s now
  EXPECT_EQ(source->delivery().median_latency, std::chrono::milliseconds(500));
}

TEST(Device, ListsAnInaccessibleDeviceWithAdvice) {
  FakeCamera camera;
  camera.open_error = EACCES;
  StreamingSystem system(&camera);
  const auto device = DescribeDevice("/dev/video9", &system);
  ASSERT_TRUE(device);
  EXPECT_THAT(device->trouble, HasSubstr("group 'video'"));
  camera.open_error = ENODEV;
  EXPECT_FALSE(DescribeDevice("/dev/video9", &system));
}

TEST(Device, ReportsATimeout) {
  FakeCamera camera;
  camera.images_until_silent = 1;
  const auto source = Open(&camera);
  engine::Frame frame;
  ASSERT_TRUE(source->Next(&frame));
  EXPECT_THAT(ErrorOf([&] { source->Next(&frame); }), HasSubstr("no image for 2000 ms"));
}

TEST(Device, SkipsAFewBrokenImagesButNotAll) {
  FakeCamera camera;
  camera.broken_images = 5;
  engine::Frame frame;
  ASSERT_TRUE(Open(&camera)->Next(&frame));
  EXPECT_EQ(frame.image.at<std::uint8_t>(0, 0), 5);
  FakeCamera broken;
  broken.broken_images = 1000;
  const auto source = Open(&broken);
  EXPECT_THAT(ErrorOf([&] { source->Next(&frame); }), HasSubstr("broken images"));
}

TEST(Device, ReportsWhyItCannotBeUsed) {
  const auto error = [](FakeCamera camera, CameraOptions options = {}) {
    const std::string text = ErrorOf([&] { Open(&camera, options); });
    EXPECT_EQ(camera.opened, 0);
    EXPECT_EQ(camera.mapped, 0);
    return text;
  };
  FakeCamera camera;
  camera.open_error = ENOENT;
  EXPECT_THAT(error(camera), HasSubstr("There is no camera"));
  camera.open_error = EACCES;
  EXPECT_THAT(error(camera), HasSubstr("group 'video'"));
  camera.open_error = EBUSY;
  EXPECT_THAT(error(camera), HasSubstr("in use"));
  camera.open_error = 0;
  camera.capabilities = V4L2_CAP_VIDEO_OUTPUT;
  EXPECT_THAT(error(camera), HasSubstr("does not stream"));
  camera = {};
  camera.pixel_format = V4L2_PIX_FMT_RGB565;
  EXPECT_THAT(error(camera), HasSubstr("no image format"));
  camera = {};
  CameraOptions options;
  options.device_format = {1920, 1080, 0};
  EXPECT_THAT(error(camera, options), HasSubstr("1920x1080"));
}

TEST(Device, DescribesItsFormats) {
  FakeCamera camera;
  StreamingSystem system(&camera);
  const auto device = DescribeDevice("/dev/video9", &system);
  ASSERT_TRUE(device);
  EXPECT_EQ(device->card, "Fake");
  ASSERT_EQ(device->formats.size(), 1u);
  EXPECT_EQ(device->formats[0].fourcc, "GREY");
  EXPECT_EQ(camera.opened, 0);
}

TEST(DeviceImages, AreConvertedWithTheirStride) {
  // Grey in YUYV is Y with U = V = 128; each row has two bytes of padding.
  std::vector<std::uint8_t> bytes;
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 4; ++column)
      bytes.insert(bytes.end(), {static_cast<std::uint8_t>(100 + row), 128});
    bytes.insert(bytes.end(), {0, 0});
  }
  const cv::Mat image = ConvertDeviceImage(V4L2_PIX_FMT_YUYV, bytes, {4, 2}, 10, "image");
  ASSERT_EQ(image.size(), cv::Size(4, 2));
  EXPECT_LT(image.at<cv::Vec3b>(0, 0)[1], image.at<cv::Vec3b>(1, 3)[1]);
  EXPECT_EQ(image.at<cv::Vec3b>(1, 0)[0], image.at<cv::Vec3b>(1, 3)[2]);
  bytes.resize(bytes.size() - 3);
  EXPECT_THAT(ErrorOf([&] {
                ConvertDeviceImage(V4L2_PIX_FMT_YUYV, bytes, {4, 2}, 10, "image");
              }),
              HasSubstr("bytes"));
}

TEST(DeviceImages, MotionJpegIsDecodedAndItsSizeChecked) {
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(cv::imencode(".jpg", cv::Mat(8, 16, CV_8UC3, cv::Scalar(10, 200, 30)), bytes));
  EXPECT_EQ(ConvertDeviceImage(V4L2_PIX_FMT_MJPEG, bytes, {16, 8}, 16, "image").type(), CV_8UC3);
  EXPECT_THAT(ErrorOf([&] {
                ConvertDeviceImage(V4L2_PIX_FMT_MJPEG, bytes, {8, 8}, 8, "image");
              }),
              HasSubstr("negotiated size"));
}

TEST(DeviceImages, MotionJpegMayOmitHuffmanTablesButNotItsEnd) {
  cv::Mat image(48, 64, CV_8UC3);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      image.at<cv::Vec3b>(row, column) =
          cv::Vec3b(static_cast<std::uint8_t>(4 * row), static_cast<std::uint8_t>(3 * column), 100);
    }
  }
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 95}));
  const cv::Mat whole = ConvertDeviceImage(V4L2_PIX_FMT_MJPEG, bytes, {64, 48}, 0, "image");
  EXPECT_LT(cv::norm(whole, image, cv::NORM_L1) / static_cast<double>(image.total()), 12);
  // Some cameras omit the DHT segments (FF C4, length), which the encoder above writes with the standard
  // tables.
  std::vector<std::uint8_t> without_tables;
  for (std::size_t i = 0; i < bytes.size();) {
    if (bytes[i] == 0xFF && i + 3 < bytes.size() && bytes[i + 1] == 0xC4) {
      i += 2 + static_cast<std::size_t>(bytes[i + 2] << 8 | bytes[i + 3]);
    } else {
      without_tables.push_back(bytes[i++]);
    }
  }
  ASSERT_LT(without_tables.size(), bytes.size());
  EXPECT_EQ(cv::norm(ConvertDeviceImage(V4L2_PIX_FMT_MJPEG, without_tables, {64, 48}, 0, "image"), whole), 0);
  bytes.resize(bytes.size() - 100);
  EXPECT_THAT(ErrorOf([&] {
                ConvertDeviceImage(V4L2_PIX_FMT_MJPEG, bytes, {64, 48}, 0, "image");
              }),
              HasSubstr("cannot be decoded"));
}

TEST(DeviceImages, Nv12TakesItsColourFromTheSecondPlane) {
  // Two rows of luma and one of interleaved chroma, each with two bytes of padding.
  std::vector<std::uint8_t> bytes = {100, 100, 100, 100, 0,   0,   100, 100, 100,
                                     100, 0,   0,   128, 128, 128, 240, 0,   0};
  const cv::Mat image = ConvertDeviceImage(V4L2_PIX_FMT_NV12, bytes, {4, 2}, 6, "image");
  ASSERT_EQ(image.type(), CV_8UC3);
  const auto grey = image.at<cv::Vec3b>(1, 0), red = image.at<cv::Vec3b>(1, 3);
  EXPECT_EQ(grey[0], grey[2]);
  EXPECT_GT(red[2], red[0] + 100);  // Cr above 128 is red
  bytes.resize(15);
  EXPECT_THAT(ErrorOf([&] {
                ConvertDeviceImage(V4L2_PIX_FMT_NV12, bytes, {4, 2}, 6, "image");
              }),
              HasSubstr("bytes"));
}

TEST(Device, ReportsThatAPathIsNoVideoDevice) {
  EXPECT_THAT(ErrorOf([] { OpenCamera("/dev/null"); }), HasSubstr("not a video device"));
  EXPECT_THAT(ErrorOf([] { OpenCamera("/dev/video987"); }), HasSubstr("There is no camera"));
}

}  // namespace
}  // namespace docent::app
