// SPDX-License-Identifier: Apache-2.0
#include "ui/text.h"

#include <pango/pangocairo.h>

#include <algorithm>
#include <cstddef>
#include <memory>

namespace docent::ui {
namespace {

template <auto Release>
struct Releaser {
  template <typename T>
  void operator()(T* object) const {
    Release(object);
  }
};
using Surface = std::unique_ptr<cairo_surface_t, Releaser<cairo_surface_destroy>>;
using Cairo = std::unique_ptr<cairo_t, Releaser<cairo_destroy>>;
using Layout = std::unique_ptr<PangoLayout, Releaser<g_object_unref>>;
using Font = std::unique_ptr<PangoFontDescription, Releaser<pango_font_description_free>>;

Layout MakeLayout(cairo_t* cairo, const std::string& text, const TextStyle& style) {
  Layout layout(pango_cairo_create_layout(cairo));
  const Font font(pango_font_description_from_string(style.bold ? "Sans Bold" : "Sans"));
  pango_font_description_set_absolute_size(font.get(), style.size_px * PANGO_SCALE);
  pango_layout_set_font_description(layout.get(), font.get());
  pango_layout_set_width(layout.get(), style.max_width_px * PANGO_SCALE);
  pango_layout_set_height(layout.get(), style.max_height_px * PANGO_SCALE);
  pango_layout_set_wrap(layout.get(), PANGO_WRAP_WORD_CHAR);
  pango_layout_set_ellipsize(layout.get(), PANGO_ELLIPSIZE_END);
  pango_layout_set_alignment(layout.get(), style.centered ? PANGO_ALIGN_CENTER : PANGO_ALIGN_LEFT);
  pango_layout_set_text(layout.get(), text.data(), static_cast<int>(text.size()));
  return layout;
}

// The blocks of Unicode whose letters run from right to left (DerivedBidiClass.txt: the default classes R and
// AL).
bool RunsFromRight(gunichar letter) {
  return (letter >= 0x590 && letter <= 0x8ff) || (letter >= 0xfb1d && letter <= 0xfdff) ||
         (letter >= 0xfe70 && letter <= 0xfeff) || (letter >= 0x10800 && letter <= 0x10fff) ||
         (letter >= 0x1e800 && letter <= 0x1efff);
}

struct Letters {
  int from_left = 0, from_right = 0;  // By the direction in which they run.
};

Letters CountLetters(std::string_view text) {
  Letters letters;
  const char* const end = text.data() + text.size();
  for (const char* at = text.data(); at < end; at = g_utf8_next_char(at)) {
    const gunichar character = g_utf8_get_char(at);
    if (g_unichar_isalpha(character)) ++(RunsFromRight(character) ? letters.from_right : letters.from_left);
  }
  return letters;
}

// The mark that gives a line the direction of most of its letters; empty where its first letter does so.
const char* DirectionMark(const Letters& letters) {
  if (letters.from_right > letters.from_left) return "\u200f";
  return letters.from_right > 0 && letters.from_right < letters.from_left ? "\u200e" : "";
}

// Pango takes the direction of a line from its first letter. A line from right to left that begins with a
// name in Latin letters would have its full stop at the wrong end. Lines without letters run as the text.
std::string WithDirection(const std::string& text) {
  const Letters all = CountLetters(text);
  if (all.from_right == 0) return text;
  std::string marked;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    const Letters letters = CountLetters(line);
    const bool has_letters = letters.from_left + letters.from_right > 0;
    if (begin > 0) marked += '\n';
    marked += DirectionMark(has_letters ? letters : all);
    marked += line;
    begin = end + 1;
  }
  return marked;
}

}  // namespace

bool TextStyle::operator==(const TextStyle& other) const {
  return size_px == other.size_px && bold == other.bold && centered == other.centered &&
         max_width_px == other.max_width_px && max_height_px == other.max_height_px &&
         color.red == other.color.red && color.green == other.color.green && color.blue == other.color.blue &&
         color.alpha == other.color.alpha;
}

std::string ReadableText(std::string_view text, std::size_t max_bytes) {
  // The text is cut between characters: a split character would become a replacement character in the
  // conversion below.
  const bool cut = text.size() > max_bytes;
  if (cut) {
    std::size_t length = max_bytes;
    while (length > 0 && (static_cast<unsigned char>(text[length]) & 0xC0u) == 0x80u) --length;
    text = text.substr(0, length);
  }
  const std::unique_ptr<char, Releaser<g_free>> valid(
      g_utf8_make_valid(text.data(), static_cast<gssize>(text.size())));
  std::string result;
  for (const char* at = valid.get(); *at != '\0'; at = g_utf8_next_char(at)) {
    const gunichar character = g_utf8_get_char(at);
    if (character != '\n' && !g_unichar_isprint(character) && g_unichar_type(character) != G_UNICODE_FORMAT) {
      result += ' ';
    } else {
      result.append(at, static_cast<std::size_t>(g_utf8_next_char(at) - at));
    }
  }
  if (cut) result += "\u2026";
  return result;
}

cv::Mat DrawText(std::string_view text, const TextStyle& style, bool* is_cut) {
  // The text is measured on a surface of one pixel and then drawn on a surface of the right size.
  const Surface probe(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, 1, 1));
  const Cairo probe_cairo(cairo_create(probe.get()));
  const std::string readable = WithDirection(ReadableText(text));
  const Layout layout = MakeLayout(probe_cairo.get(), readable, style);
  if (is_cut != nullptr) *is_cut = pango_layout_is_ellipsized(layout.get()) != FALSE;
  PangoRectangle ink, logical;
  pango_layout_get_pixel_extents(layout.get(), &ink, &logical);
  // Centred lines start to the right of the layout's left edge, and slanted letters extend beyond the logical
  // box.
  const int left = std::min(ink.x, logical.x), top = std::min(ink.y, logical.y);
  const int right = std::max(ink.x + ink.width, logical.x + logical.width);
  const int bottom = std::max(ink.y + ink.height, logical.y + logical.height);
  cv::Mat image = cv::Mat::zeros(std::clamp(bottom - top, 1, std::max(1, style.max_height_px)),
                                 std::clamp(right - left, 1, std::max(1, style.max_width_px)), CV_8UC4);
  const Surface surface(cairo_image_surface_create_for_data(image.data, CAIRO_FORMAT_ARGB32, image.cols,
                                                            image.rows, static_cast<int>(image.step)));
  const Cairo cairo(cairo_create(surface.get()));
  cairo_translate(cairo.get(), -left, -top);
  cairo_set_source_rgba(cairo.get(), style.color.red, style.color.green, style.color.blue, style.color.alpha);
  pango_cairo_show_layout(cairo.get(), layout.get());
  cairo_surface_flush(surface.get());
  return image;
}

}  // namespace docent::ui
