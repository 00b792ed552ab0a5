// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace docent::app {

// All sentences that visitors read, in one language. A pair of braces stands where Filled puts the value that
// the comment names.
struct VisitorStrings {
  const char* language;   // Its tag (content::LanguageTag).
  bool is_right_to_left;  // Texts begin at the right.

  // Where a visitor is.
  const char* welcome;
  const char* no_places;
  const char* look_around;
  const char* go_back_to;  // Place.
  const char* go_to_a_place;
  const char* go_to_a_view;

  // What keeps a camera from being recognized or followed.
  const char* not_recognized;
  const char* resembles;      // Place.
  const char* only_a_corner;  // Place.
  const char* either_of_two;  // Place.
  const char* this_or_that;   // Place, place.
  const char* probably;       // Place.
  const char* more_slowly;
  const char* little_detail;
  const char* left_the_map;
  const char* look_back;
  const char* other_camera;

  // The way on.
  const char* to;          // Place.
  const char* to_through;  // Place, and the one before it on the way.
  // Spoken: where the arrow points; the text beside it, as `to`.
  const char* at_left;
  const char* at_right;
  const char* ahead;
  const char* behind;

  // On a tour with stops.
  const char* first_stop;  // What the tour has, stop.
  const char* one_stop;
  const char* stops;          // Number.
  const char* about_minutes;  // Stops, number.
  const char* stop_and_next;  // Number, number, stop.
  const char* next;           // Stop, number, number.
  const char* back_to;        // Stop, number, number.
  const char* saw_all;        // Number.
  const char* saw_only;
  const char* saw_some;       // Numbers.
  const char* numbered_stop;  // Number, stop.
  const char* seen_stop;      // The same.
  const char* skipped_stop;   // The same.
  const char* next_stop;      // The same.
  const char* no_further_stop;
  const char* no_stop_before;

  // Cards about what is in view.
  const char* open_a_card;
  const char* look_to_open;
  const char* nothing_to_open;
  const char* more_pages;  // Numbers of the page and of all pages.
  const char* close_card;
  const char* pages_turn;  // By gaze alone: numbers of the page and of all pages.
  const char* look_away;   // By gaze alone.

  // The other one of two cameras.
  const char* other_is_at;  // Place.
  const char* other_is_lost;
  const char* cameras_apart;

  // The device.
  const char* device_is_slow;

  // The menu.
  const char* menu_skip;
  const char* menu_back;
  const char* menu_stops;
  const char* menu_anew;
  const char* menu_close;

  // Whether a tour that was left goes on, and the two choices.
  const char* was_left;
  const char* choose_continue;
  const char* choose_restart;
};

// The sentences in English, German, Spanish or Arabic. `language` is a tag in lower case; of its last parts,
// those that no sentences exist for are ignored ("de-at" is German). English for any other language, and for
// none.
const VisitorStrings& VisitorStringsFor(const std::string& language);

// The text with the values in the place of its braces, in their order. In a text from right to left, a value
// keeps the direction of its own letters.
std::string Filled(const VisitorStrings& strings, std::string_view text,
                   std::initializer_list<std::string> values);

}  // namespace docent::app
