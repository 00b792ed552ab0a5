// SPDX-License-Identifier: Apache-2.0
#include "app/cameras/file_sources.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "app/cameras/clipped_source.h"
#include "tests/app/support/log_of.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kFileWidth = 64, kFileHeight = 48;

// An image whose brightness encodes its number.
cv::Mat Numbered(int number) {
  return cv::Mat(kFileHeight, kFileWidth, CV_8UC1, cv::Scalar(10 * number + 5));
}

void WritePng(const std::filesystem::path& path, const cv::Mat& image) {
  std::filesystem::create_directories(path.parent_path());
  ASSERT_TRUE(cv::imwrite(path.string(), image));
}

void WriteVideo(const std::filesystem::path& path, int count) {
  cv::VideoWriter writer(path.string(), cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 25,
                         cv::Size(kFileWidth, kFileHeight));
  ASSERT_TRUE(writer.isOpened());
  cv::Mat image;
  for (int i = 0; i < count; ++i) {
    cv::cvtColor(Numbered(i), image, cv::COLOR_GRAY2BGR);
    writer.write(image);
  }
}

std::vector<engine::Frame> ReadFrames(FrameSource* source) {
  std::vector<engine::Frame> frames;
  for (engine::Frame frame; source->Next(&frame);) frames.push_back(frame);
  return frames;
}

class Cameras : public testing::Test {
 protected:
  static void SetUpTestSuite() { QuietDecoders(); }

  // Writes a TUM folder with three images.
  void MakeTum() {
    for (int i = 0; i < 3; ++i) WritePng(folder_ / ("rgb/" + std::to_string(i) + ".png"), Numbered(i));
    folder_.Write("rgb.txt",
                  "# list\n1305031102.175304001 rgb/0.png\n1305031102.2 rgb/1.png\n1305031103 rgb/2.png\n");
  }
  std::string ErrorOfReading() const {
    return ErrorOf([&] { ReadFrames(OpenCamera(folder_.path().string()).get()); });
  }

  TemporaryFolder folder_;
};

TEST_F(Cameras, ReadTumFoldersWithExactTimes) {
  MakeTum();
  folder_.Write("groundtruth.txt", "");
  const auto source = OpenCamera(folder_.path().string());
  EXPECT_EQ(source->info().frame_count, 3u);
  EXPECT_EQ(source->info().name, folder_.path().filename().string());
  EXPECT_EQ(source->info().ground_truth_path, folder_ / "groundtruth.txt");
  const auto frames = ReadFrames(source.get());
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].time, Timestamp(1305031102175304001));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(frames[static_cast<std::size_t>(i)].index, static_cast<std::uint64_t>(i));
    EXPECT_EQ(frames[static_cast<std::size_t>(i)].image.type(), CV_8UC1);
    EXPECT_EQ(frames[static_cast<std::size_t>(i)].image.at<std::uint8_t>(7, 7), 10 * i + 5);
  }
  engine::Frame more;
  EXPECT_FALSE(source->Next(&more));
}

TEST_F(Cameras, ReadEurocFoldersInNanoseconds) {
  for (const char* camera : {"mav0/cam0", "cam0"}) {
    const TemporaryFolder folder;
    WritePng(folder / (std::string(camera) + "/data/a.png"), Numbered(3));
    folder.Write(std::string(camera) + "/data.csv",
                 "#timestamp [ns],filename\r\n1403715273262142976,a.png\r\n");
    const auto frames = ReadFrames(OpenCamera(folder.path().string()).get());
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].time, Timestamp(1403715273262142976));
  }
}

TEST_F(Cameras, ReadNumberedImagesInNumericalOrder) {
  for (int i = 8; i <= 11; ++i) WritePng(folder_ / ("frame" + std::to_string(i) + ".png"), Numbered(i));
  CameraOptions options;
  options.image_fps = 10;
  const auto frames = ReadFrames(OpenCamera(folder_.path().string(), options).get());
  ASSERT_EQ(frames.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(frames[static_cast<std::size_t>(i)].image.at<std::uint8_t>(0, 0), 10 * (i + 8) + 5);
    EXPECT_EQ(frames[static_cast<std::size_t>(i)].time, std::chrono::milliseconds(100 * i));
  }
}

TEST_F(Cameras, RefuseNumberedImagesOfSeveralKinds) {
  for (const auto& [one, other] : {std::pair{"frame-000000.color.png", "frame-000000.depth.png"},
                                   {"left000.png", "right000.png"},
                                   {"1.jpg", "1.png"}}) {
    const TemporaryFolder folder;
    WritePng(folder / one, Numbered(1));
    WritePng(folder / other, Numbered(2));
    EXPECT_THAT(ErrorOf([&] { OpenCamera(folder.path().string()); }),
                AllOf(HasSubstr("several kinds"), HasSubstr(one), HasSubstr(other)));
  }
  WritePng(folder_ / "img9.png", Numbered(1));
  WritePng(folder_ / "img10.png", Numbered(2));
  std::filesystem::rename(folder_ / "img10.png", folder_ / "img10.PNG");
  EXPECT_EQ(ReadFrames(OpenCamera(folder_.path().string()).get()).size(), 2u);
}

TEST_F(Cameras, KeepAllBitsThatSixteenBitImagesUse) {
  const auto write = [&](const std::string& name, int type, double value) {
    cv::Mat image(kFileHeight, kFileWidth, type, cv::Scalar::all(value));
    image.ptr<std::uint16_t>()[0] = 0;
    WritePng(folder_ / name, image);
  };
  const auto levels = [&] {
    std::vector<int> found;
    for (const engine::Frame& frame : ReadFrames(OpenCamera(folder_.path().string()).get())) {
      EXPECT_EQ(frame.image.depth(), CV_8U);
      EXPECT_EQ(frame.image.ptr()[0], 0);
      found.push_back(frame.image.ptr(3)[5]);
    }
    return found;
  };
  write("1.png", CV_16UC1, 200 * 16 + 7);
  write("2.png", CV_16UC1, 40 * 16 + 15);
  EXPECT_THAT(levels(), ::testing::ElementsAre(200, 40)) << "12 bits";
  write("1.png", CV_16UC1, 900);
  write("2.png", CV_16UC1, 40 * 4);
  EXPECT_THAT(levels(), ::testing::ElementsAre(225, 40)) << "10 bits";
  write("1.png", CV_16UC3, 200 * 256 + 255);
  write("2.png", CV_16UC3, 3 * 256 + 200);
  EXPECT_THAT(levels(), ::testing::ElementsAre(200, 3)) << "16 bits";
  write("1.png", CV_16UC1, 5);
  write("2.png", CV_16UC1, 200 * 16);
  write("3.png", CV_16UC1, 20 * 16);
  EXPECT_THAT(levels(), ::testing::ElementsAre(5, 200, 20)) << "the first image is dark";
}

TEST_F(Cameras, OpenFilesBelowDev) {
  std::string pattern = "/dev/shm/docent-test-XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr) GTEST_SKIP() << "no folder can be made in /dev/shm";
  const std::filesystem::path folder = pattern;
  WritePng(folder / "1.png", Numbered(1));
  std::size_t frames = 0;
  const std::string error = ErrorOf([&] { frames = ReadFrames(OpenCamera(pattern).get()).size(); });
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  EXPECT_EQ(error, "");
  EXPECT_EQ(frames, 1u);
}

TEST_F(Cameras, UseTheTimestampListOfAVideo) {
  WriteVideo(folder_ / "video.mp4", 4);
  folder_.Write("timestamps.txt", "# seconds\n10.000000\n10.033333\n10.5\n11\n");
  const auto frames = ReadFrames(OpenCamera(folder_.path().string()).get());
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_EQ(frames[1].time, Timestamp(10'033'333'000));
  EXPECT_EQ(frames[3].time, std::chrono::seconds(11));
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(frames[static_cast<std::size_t>(i)].image.at<cv::Vec3b>(20, 20)[1], 10 * i + 5, 4);
  }
}

TEST_F(Cameras, UseTheVideoTimesWithoutAList) {
  WriteVideo(folder_ / "v.mp4", 10);
  const auto frames = ReadFrames(OpenCamera((folder_ / "v.mp4").string()).get());
  ASSERT_EQ(frames.size(), 10u);
  for (std::size_t i = 0; i < frames.size(); ++i)
    EXPECT_NEAR(ToSeconds(frames[i].time), 0.04 * static_cast<double>(i), 1e-6);
}

// Passing over an image changes nothing about the times and the images after it, and needs no image.
TEST_F(Cameras, PassOverLateImagesWithoutDecodingThem) {
  MakeTum();
  WriteVideo(folder_ / "plain.mp4", 8);
  const TemporaryFolder timed;
  WriteVideo(timed / "video.mp4", 8);
  std::string times;
  for (int i = 0; i < 8; ++i) times += std::to_string(100 + i) + ".5\n";
  timed.Write("timestamps.txt", times);
  for (const std::string& place :
       {folder_.path().string(), (folder_ / "plain.mp4").string(), timed.path().string()}) {
    SCOPED_TRACE(place);
    const auto all = ReadFrames(OpenCamera(place).get());
    const auto source = OpenCamera(place);
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_EQ(source->NextTime().value_or(all[i].time), all[i].time) << i;
      engine::Frame frame;
      const bool is_late = i % 3 != 2;
      ASSERT_TRUE(is_late ? source->NextLate(&frame) : source->Next(&frame)) << i;
      EXPECT_EQ(frame.time, all[i].time) << i;
      EXPECT_EQ(frame.index, all[i].index) << i;
      ASSERT_EQ(frame.image.empty(), is_late) << i;
      if (is_late) continue;
      EXPECT_EQ(cv::norm(frame.image, all[i].image, cv::NORM_INF), 0) << i;
    }
    engine::Frame more;
    EXPECT_FALSE(source->NextLate(&more));
    EXPECT_FALSE(source->NextTime());
  }
  // What is passed over is not read at all.
  std::filesystem::remove(folder_ / "rgb/1.png");
  const auto source = OpenCamera(folder_.path().string());
  engine::Frame frame;
  EXPECT_TRUE(source->Next(&frame) && source->NextLate(&frame) && source->Next(&frame));
}

TEST_F(Cameras, DeliverTheImagesOfATruncatedVideoAndReportWhereItEnds) {
  WriteVideo(folder_ / "video.mp4", 3);
  folder_.Write("timestamps.txt", "1\n2\n3\n4\n5\n");
  const auto source = OpenCamera(folder_.path().string());
  engine::Frame frame;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(source->Next(&frame));
  EXPECT_THAT(ErrorOf([&] { source->Next(&frame); }),
              AllOf(HasSubstr("truncated at image 3"), HasSubstr("of the 5")));
  EXPECT_FALSE(source->Next(&frame));
}

TEST_F(Cameras, ReportAVideoThatIsLongerThanItsList) {
  WriteVideo(folder_ / "video.mp4", 3);
  folder_.Write("timestamps.txt", "1\n2\n");
  EXPECT_THAT(ErrorOfReading(), AllOf(HasSubstr("has 2 times"), HasSubstr("has more images")));
}

// As after `ffmpeg -t 0.4 -c copy`: the edit list hides images that stay in the file and count in its header.
TEST_F(Cameras, ReadATrimmedVideoToItsEndAndWarnOnce) {
  WriteVideo(folder_ / "whole.mp4", 20);
  std::string bytes = ReadAll(folder_ / "whole.mp4");
  const std::size_t edits = bytes.rfind("elst");
  ASSERT_NE(edits, std::string::npos);
  // The duration of the first edit in milliseconds follows the type, version and flags, and the number of
  // edits.
  folder_.Write("cut.mp4", bytes.replace(edits + 12, 4, std::string("\0\0\x01\x90", 4)));
  const std::string cut = (folder_ / "cut.mp4").string();
  std::vector<engine::Frame> frames;
  const std::string log = LogOf([&] { frames = ReadFrames(OpenCamera(cut).get()); });
  ASSERT_EQ(frames.size(), 10u);
  EXPECT_NEAR(ToSeconds(frames.back().time), 0.36, 1e-6);
  EXPECT_THAT(log, AllOf(HasSubstr("cut.mp4' ends after image 10 of the 20"), HasSubstr("trimmed")));
  EXPECT_EQ(LogOf([&] { ReadFrames(OpenCamera(cut).get()); }), "");
}

TEST_F(Cameras, ReportATruncatedVideoThatCannotBeOpened) {
  WriteVideo(folder_ / "whole.mp4", 20);
  const std::string bytes = ReadAll(folder_ / "whole.mp4");
  folder_.Write("video.mp4", bytes.substr(0, bytes.size() / 2));
  EXPECT_THAT(ErrorOfReading(), AllOf(HasSubstr("video.mp4"), HasSubstr("cannot be opened")));
}

TEST_F(Cameras, ReportATruncatedImage) {
  cv::Mat noise(kFileHeight, kFileWidth, CV_8UC3);
  cv::RNG(1).fill(noise, cv::RNG::UNIFORM, 0, 255);
  for (const char* name : {"rgb/0.jpg", "rgb/0.png"}) {
    WritePng(folder_ / name, noise);
    const std::string bytes = ReadAll(folder_ / name);
    folder_.Write(name, bytes.substr(0, bytes.size() * 2 / 3));
    folder_.Write("rgb.txt", std::string("0 ") + name + "\n");
    EXPECT_THAT(ErrorOfReading(), AllOf(HasSubstr(name), HasSubstr("is truncated")));
  }
  folder_.Write("rgb/0.png", "no image at all");
  EXPECT_THAT(ErrorOfReading(), HasSubstr("cannot be decoded"));
  folder_.Write("rgb/0.png", "");
  EXPECT_THAT(ErrorOfReading(), HasSubstr("empty"));
}

TEST_F(Cameras, ReportMissingImagesAndImagesOfAnotherSize) {
  MakeTum();
  WritePng(folder_ / "rgb/1.png", cv::Mat(20, 20, CV_8UC1, cv::Scalar(0)));
  EXPECT_THAT(ErrorOfReading(), AllOf(HasSubstr("rgb/1.png"), HasSubstr("20x20"), HasSubstr("64x48")));
  std::filesystem::remove(folder_ / "rgb/1.png");
  EXPECT_THAT(ErrorOfReading(), AllOf(HasSubstr("There is no file"), HasSubstr("rgb/1.png")));
}

TEST_F(Cameras, NameTheLineOfAnInvalidList) {
  MakeTum();
  folder_.Write("rgb.txt", "2 rgb/0.png\n1 rgb/1.png\n2 rgb/2.png\n");
  EXPECT_THAT(ErrorOfReading(),
              AllOf(HasSubstr("line 2"), HasSubstr("is not later than"), HasSubstr("2 of the 3 images")));
  folder_.Write("rgb.txt", "1 rgb/0.png\n\nsoon rgb/1.png\n");
  EXPECT_THAT(ErrorOfReading(), HasSubstr("line 3"));
  folder_.Write("rgb.txt", "1\n");
  EXPECT_THAT(ErrorOfReading(), HasSubstr("line 1"));
  folder_.Write("rgb.txt", "# nothing\n");
  EXPECT_THAT(ErrorOfReading(), HasSubstr("no images"));
}

TEST_F(Cameras, LeaveOutImagesWhoseTimesDoNotIncrease) {
  const TemporaryFolder euroc, video;
  MakeTum();
  folder_.Write("rgb.txt", "1 rgb/0.png\n1 rgb/1.png\n0.5 rgb/1.png\n1.5 rgb/1.png\n2 rgb/2.png\n");
  for (int i = 0; i < 3; ++i) WritePng(euroc / ("data/" + std::to_string(i) + ".png"), Numbered(i));
  euroc.Write("data.csv",
              "1000000000,0.png\n1000000000,1.png\n500000000,1.png\n1500000000,1.png\n2000000000,2.png\n");
  WriteVideo(video / "video.mp4", 5);
  video.Write("timestamps.txt", "1\n1\n0.5\n1.5\n2\n");
  for (const TemporaryFolder* folder :
       std::initializer_list<const TemporaryFolder*>{&folder_, &euroc, &video}) {
    SCOPED_TRACE(folder->path());
    std::unique_ptr<FrameSource> source;
    const std::string log = LogOf([&] { source = OpenCamera(folder->path().string()); });
    EXPECT_THAT(log, AllOf(HasSubstr("line 2"), HasSubstr("2 of the 5 images are left out")));
    EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 1) << log;
    EXPECT_EQ(source->info().frame_count, 3u);
    EXPECT_EQ(source->info().duration, std::chrono::seconds(1));
    EXPECT_EQ(source->NextTime(), std::chrono::seconds(1));
    engine::Frame first;
    ASSERT_TRUE(source->Next(&first));
    EXPECT_EQ(source->NextTime(), std::chrono::milliseconds(1500));
    const auto frames = ReadFrames(source.get());
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_EQ(frames[0].time, std::chrono::milliseconds(1500));
    EXPECT_EQ(frames[0].index, 1u);
    EXPECT_EQ(frames[1].time, std::chrono::seconds(2));
    // The image belongs to its own line: the second image of the folders, the fourth of the video.
    const int brightness = folder == &video ? 35 : 15;
    EXPECT_NEAR(frames[0].image.ptr()[0], brightness, 4);
  }
}

TEST_F(Cameras, RefuseTimesThatAreCenturiesAway) {
  WritePng(folder_ / "data/0.png", Numbered(0));
  for (const char* time : {"9223372036854775807", "-9223372036854775808", "4000000000000000000"}) {
    folder_.Write("data.csv", "1000,0.png\n" + std::string(time) + ",0.png\n");
    EXPECT_THAT(ErrorOfReading(), AllOf(HasSubstr("line 2"), HasSubstr("95 years"))) << time;
  }
  const TemporaryFolder tum;
  tum.Write("rgb.txt", "-7000000000 0.png\n7000000000 1.png\n");
  EXPECT_THAT(ErrorOf([&] { OpenCamera(tum.path().string()); }), HasSubstr("95 years"));
}

TEST_F(Cameras, ReportInvalidSources) {
  const auto error = [](const std::string& source) { return ErrorOf([&] { OpenCamera(source); }); };
  EXPECT_THAT(error((folder_ / "none").string()), HasSubstr("There is no camera, video or folder"));
  EXPECT_THAT(error(folder_.path().string()), HasSubstr("no image sequence"));
  EXPECT_THAT(error(""), HasSubstr("name is empty"));
  EXPECT_THAT(error("sim:nowhere"), HasSubstr("nowhere"));
  EXPECT_THAT(error(folder_.Write("text.mp4", "hello").string()), HasSubstr("cannot be opened as a video"));
}

TEST_F(Cameras, CanBeClippedToATimeRange) {
  for (int i = 0; i < 10; ++i) WritePng(folder_ / (std::to_string(i) + ".png"), Numbered(i));
  CameraOptions options;
  options.image_fps = 10;
  const auto source = ClipSource(OpenCamera(folder_.path().string(), options), std::chrono::milliseconds(200),
                                 std::chrono::milliseconds(500));
  const auto frames = ReadFrames(source.get());
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].index, 2u);
  EXPECT_EQ(frames[2].time, std::chrono::milliseconds(400));
}

// A recording of 40 images, ten per second, that counts those that were decoded.
class CountingRecording : public FrameSource {
 public:
  explicit CountingRecording(int* decoded) : decoded_(decoded) { info_.name = "counting"; }
  bool Next(engine::Frame* frame) override {
    if (!NextLate(frame)) return false;
    frame->image = cv::Mat::zeros(4, 4, CV_8UC1);
    ++*decoded_;
    return true;
  }
  bool NextLate(engine::Frame* frame) override {
    if (next_ == 40) return false;
    frame->index = next_;
    frame->time = std::chrono::milliseconds(100) * next_++;
    return true;
  }

 private:
  int* const decoded_;
  std::uint64_t next_ = 0;
};

TEST(ClippedSource, DoesNotDecodeWhatIsLongBeforeTheInterval) {
  int decoded = 0;
  const auto source = ClipSource(std::make_unique<CountingRecording>(&decoded), std::chrono::seconds(3),
                                 std::chrono::milliseconds(3500));
  engine::Frame frame;
  ASSERT_TRUE(source->Next(&frame));
  EXPECT_EQ(frame.index, 30u);
  EXPECT_FALSE(frame.image.empty());
  EXPECT_LE(decoded, 13) << "the first one, and those of a second before the interval";
  int more = 0;
  for (; source->Next(&frame); ++more) EXPECT_FALSE(frame.image.empty());
  EXPECT_EQ(more, 4);
}

TEST_F(Cameras, DeliverTheFirstImageOfAnIntervalWhateverTheirRate) {
  for (int i = 0; i < 4; ++i) WritePng(folder_ / ("rgb/" + std::to_string(i) + ".png"), Numbered(i));
  folder_.Write("rgb.txt", "10 rgb/0.png\n15 rgb/1.png\n20 rgb/2.png\n25 rgb/3.png\n");
  const auto frames =
      ReadFrames(ClipSource(OpenCamera(folder_.path().string()), std::chrono::seconds(8), {}).get());
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].time, std::chrono::seconds(20));
}

TEST_F(Cameras, RefuseToBeClippedBeyondTheirEnd) {
  MakeTum();  // 0.825 s long
  const auto clip = [&](const std::string& camera, int from_ms, int until_ms = 0) {
    return ClipSource(OpenCamera(camera), std::chrono::milliseconds(from_ms),
                      std::chrono::milliseconds(until_ms));
  };
  const std::string tum = folder_.path().string();
  EXPECT_EQ(ReadFrames(clip(tum, 800).get()).size(), 1u);
  EXPECT_THAT(ErrorOf([&] { clip(tum, 900); }), AllOf(HasSubstr("--from 0.9 "), HasSubstr(" 0.824696 s.")));
  EXPECT_THAT(ErrorOf([&] { clip("sim:room,duration=1", 2000); }), HasSubstr("--from 2 "));

  // A video without times tells its length only at its end.
  const TemporaryFolder videos;
  WriteVideo(videos / "walk.mp4", 10);
  const std::string video = (videos / "walk.mp4").string();
  EXPECT_EQ(ReadFrames(clip(video, 320).get()).size(), 2u);
  const auto clipped = clip(video, 2000);
  EXPECT_THAT(ErrorOf([&] { ReadFrames(clipped.get()); }),
              AllOf(HasSubstr("--from 2 "), HasSubstr(" 0.36 s.")));
  EXPECT_TRUE(ReadFrames(clipped.get()).empty()) << "it stays at its end";
  EXPECT_EQ(ErrorOf([&] { ReadFrames(clip(tum, 100, 50).get()); }), "")
      << "an empty interval is no wrong start";
}

TEST_F(Cameras, CanBeginAtAnyImageAsIfItWereTheFirst) {
  for (int i = 0; i < 10; ++i) WritePng(folder_ / (std::to_string(i) + ".png"), Numbered(i));
  CameraOptions options;
  options.image_fps = 10;
  const auto window = [&](std::uint64_t first, int milliseconds) {
    return WindowOf(OpenCamera(folder_.path().string(), options), first,
                    std::chrono::milliseconds(milliseconds));
  };
  const auto source = window(6, 0);
  EXPECT_EQ(source->info().frame_count, 4u);
  const auto frames = ReadFrames(source.get());
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_EQ(frames[0].index, 0u);
  EXPECT_EQ(frames[3].index, 3u);
  EXPECT_EQ(frames[0].time, std::chrono::milliseconds(600))
      << "times must match the ground truth of the recording";
  EXPECT_FALSE(frames[0].image.empty());
  EXPECT_EQ(ReadFrames(window(6, 200).get()).size(), 2u) << "the end is exclusive";
  EXPECT_EQ(ReadFrames(window(0, 250).get()).size(), 3u);
  EXPECT_EQ(ReadFrames(window(8, 5000).get()).size(), 2u);
}

TEST_F(Cameras, RefuseAWindowThatBeginsBeyondTheirEnd) {
  WriteVideo(folder_ / "video.mp4", 4);
  for (const std::uint64_t first : {4u, 9u}) {
    const auto source = WindowOf(OpenCamera((folder_ / "video.mp4").string()), first, {});
    EXPECT_THAT(ErrorOf([&] { ReadFrames(source.get()); }),
                AllOf(HasSubstr("at image " + std::to_string(first) + " of 'video.mp4'"),
                      HasSubstr("it has only 4 images")));
    EXPECT_TRUE(ReadFrames(source.get()).empty()) << "it stays at its end";
  }
}

TEST_F(Cameras, KeepTheirHeadWhenClipped) {
  const auto source = OpenCamera("sim:head", {});
  Head* const head = source->head();
  ASSERT_NE(head, nullptr);
  EXPECT_EQ(OpenCamera("sim:hand", {})->head(), nullptr);
  const auto clipped = ClipSource(OpenCamera("sim:head", {}), std::chrono::seconds(1), Timestamp{});
  EXPECT_NE(clipped->head(), nullptr);
}

TEST(DeviceFormats, ParseValidTextAndRejectInvalidText) {
  const DeviceFormat format = ParseDeviceFormat("640x480@29.97");
  EXPECT_EQ(format.width_px, 640);
  EXPECT_EQ(format.height_px, 480);
  EXPECT_DOUBLE_EQ(format.fps, 29.97);
  EXPECT_EQ(ParseDeviceFormat("1280x720").fps, 0);
  for (const char* text :
       {"", "640", "640x", "x480", "640x480@", "640x480@0", "-1x2", "640@30x480", "640x480x3"}) {
    EXPECT_THAT(ErrorOf([&] { ParseDeviceFormat(text); }), HasSubstr("not a camera format")) << text;
  }
}

TEST_F(Cameras, ReadTheRecordedSequencesToTheEnd) {
  const std::filesystem::path sequences = DOCENT_SOURCE_DIR "/../shared/sequences";
  if (!std::filesystem::exists(sequences)) GTEST_SKIP() << "the recorded sequences are not on this machine";
  const std::pair<const char*, std::size_t> expected[] = {
      {"still", 40}, {"checkerboard", 240}, {"cylinder-dev-5", 100}};
  for (const auto& [name, count] : expected) {
    EXPECT_EQ(ReadFrames(OpenCamera((sequences / name).string()).get()).size(), count) << name;
  }
}

}  // namespace
}  // namespace docent::app
