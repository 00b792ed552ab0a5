// SPDX-License-Identifier: Apache-2.0
#include "tests/end_to_end/screen_reader.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace docent::app {
namespace {

// The font of the panel (ui/gui.cpp) at a scale of 1, and its glyphs.
class PanelFont {
 public:
  PanelFont() {
    constexpr std::array<const char*, 2> kFiles = {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                                                   "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf"};
    static const ImWchar kRanges[] = {0x20,   0x24F,  0x370,  0x52F,  0x2010, 0x2044,
                                      0x2190, 0x21FF, 0x25A0, 0x25FF, 0};
    constexpr float kSizePx = 14;
    for (const char* file : kFiles) {
      std::error_code ignored;
      if (font_ == nullptr && std::filesystem::exists(file, ignored))
        font_ = atlas_.AddFontFromFileTTF(file, kSizePx, nullptr, kRanges);
    }
    if (font_ == nullptr) {
      ImFontConfig config;
      config.SizePixels = kSizePx;
      font_ = atlas_.AddFontDefault(&config);
    }
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    atlas_.GetTexDataAsAlpha8(&pixels, &width, &height);
    cv::Mat(height, width, CV_8UC1, pixels).convertTo(glyphs_, CV_32F, 1 / 255.0);
  }

  // White on black, with empty columns at both sides; CV_32FC1. ASCII only.
  cv::Mat Draw(const std::string& text, int margin_px) const {
    float width = 0;
    for (const char c : text) width += font_->FindGlyph(static_cast<ImWchar>(c))->AdvanceX;
    const int columns = static_cast<int>(std::ceil(width)) + 2 * margin_px;
    cv::Mat image(static_cast<int>(std::ceil(font_->FontSize)), columns, CV_32FC1, cv::Scalar(0));
    float x = static_cast<float>(margin_px);
    for (const char c : text) {
      const ImFontGlyph& glyph = *font_->FindGlyph(static_cast<ImWchar>(c));
      if (glyph.Visible != 0) Add(glyph, x, &image);
      x += glyph.AdvanceX;
    }
    return image;
  }

 private:
  // As a graphics card draws a textured rectangle.
  void Add(const ImFontGlyph& glyph, float x, cv::Mat* image) const {
    for (int row = 0; row < image->rows; ++row) {
      for (int column = 0; column < image->cols; ++column) {
        const float across = (static_cast<float>(column) + 0.5f - x - glyph.X0) / (glyph.X1 - glyph.X0),
                    down = (static_cast<float>(row) + 0.5f - glyph.Y0) / (glyph.Y1 - glyph.Y0);
        if (across < 0 || across >= 1 || down < 0 || down >= 1) continue;
        const float u = (glyph.U0 + across * (glyph.U1 - glyph.U0)) * static_cast<float>(glyphs_.cols) - 0.5f,
                    v = (glyph.V0 + down * (glyph.V1 - glyph.V0)) * static_cast<float>(glyphs_.rows) - 0.5f;
        float& pixel = image->at<float>(row, column);
        pixel += Sample(u, v) * (1 - pixel);
      }
    }
  }
  float Sample(float u, float v) const {
    const int left = std::clamp(static_cast<int>(std::floor(u)), 0, glyphs_.cols - 2),
              top = std::clamp(static_cast<int>(std::floor(v)), 0, glyphs_.rows - 2);
    const float a = u - static_cast<float>(left), b = v - static_cast<float>(top);
    return (1 - b) * ((1 - a) * glyphs_.at<float>(top, left) + a * glyphs_.at<float>(top, left + 1)) +
           b * ((1 - a) * glyphs_.at<float>(top + 1, left) + a * glyphs_.at<float>(top + 1, left + 1));
  }

  ImFontAtlas atlas_;
  ImFont* font_ = nullptr;
  cv::Mat glyphs_;
};

std::uint32_t BigEndian(const std::vector<char>& bytes, std::size_t index) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<std::uint8_t>(bytes[4 * index + i]);
  return value;
}

}  // namespace

// The file has the format of xwd: a header of numbers of four bytes, a table of colours, and the pixels.
cv::Mat ScreenReader::Capture() const {
  std::ifstream file(folder_ / "Xvfb_screen0", std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  constexpr std::size_t kHeaderBytes = 100, kColorBytes = 12;
  if (bytes.size() < kHeaderBytes) return {};
  const std::size_t begin = BigEndian(bytes, 0) + kColorBytes * BigEndian(bytes, 19);
  const auto width = static_cast<int>(BigEndian(bytes, 4)), height = static_cast<int>(BigEndian(bytes, 5));
  const std::size_t row_bytes = BigEndian(bytes, 12);
  if (BigEndian(bytes, 11) != 32 || bytes.size() < begin + row_bytes * static_cast<std::size_t>(height))
    return {};
  const cv::Mat screen(height, width, CV_8UC4, const_cast<char*>(bytes.data()) + begin, row_bytes);
  cv::Mat bgr;
  cv::cvtColor(screen, bgr, cv::COLOR_BGRA2BGR);
  return bgr;
}

std::optional<cv::Point> ScreenReader::Find(const std::string& text, const cv::Rect& part,
                                            int margin_px) const {
  static const PanelFont font;
  constexpr double kLeastCorrelation = 0.85;
  const cv::Mat screen = Capture();
  const cv::Rect inside = part & cv::Rect(0, 0, screen.cols, screen.rows);
  const cv::Mat drawn = font.Draw(text, margin_px);
  if (inside.width < drawn.cols || inside.height < drawn.rows) return std::nullopt;
  cv::Mat gray, brightness, correlation;
  cv::cvtColor(screen(inside), gray, cv::COLOR_BGR2GRAY);
  gray.convertTo(brightness, CV_32F);
  cv::matchTemplate(brightness, drawn, correlation, cv::TM_CCOEFF_NORMED);
  // Where nothing is drawn, the correlation is noise.
  cv::Mat mean, square;
  cv::boxFilter(brightness, mean, CV_32F, drawn.size(), {0, 0});
  cv::sqrBoxFilter(brightness, square, CV_32F, drawn.size(), {0, 0});
  const cv::Mat variance = square - mean.mul(mean);
  constexpr double kLeastVariance = 100;
  correlation.setTo(0, variance(cv::Rect({0, 0}, correlation.size())) < kLeastVariance);
  double best = 0;
  cv::Point place;
  cv::minMaxLoc(correlation, nullptr, &best, nullptr, &place);
  if (best < kLeastCorrelation) return std::nullopt;
  return inside.tl() + place + cv::Point(drawn.cols / 2, drawn.rows / 2);
}

std::optional<cv::Point2d> FindNewColor(const cv::Mat& before, const cv::Mat& now, const cv::Scalar& color) {
  constexpr double kTolerance = 60, kLeastArea = 30;
  cv::Mat difference, changed, colored;
  cv::absdiff(before, now, difference);
  cv::inRange(difference, cv::Scalar::all(0), cv::Scalar::all(kTolerance), changed);
  cv::bitwise_not(changed, changed);
  cv::inRange(now, color - cv::Scalar::all(kTolerance), color + cv::Scalar::all(kTolerance), colored);
  const cv::Moments moments = cv::moments(changed & colored, true);
  if (moments.m00 < kLeastArea) return std::nullopt;
  return cv::Point2d(moments.m10 / moments.m00, moments.m01 / moments.m00);
}

}  // namespace docent::app
