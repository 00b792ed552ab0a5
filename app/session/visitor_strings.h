// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

// The sentences that visitors read, in one place, so that they can be read together and translated. Filled
// puts what the comment says in the place of the braces.
namespace docent::app::visitor_strings {

// Where a visitor is.
inline constexpr const char* kWelcome = "Welcome. Look around slowly, and I will tell you where you are.";
inline constexpr const char* kNoPlaces = "There are no places in this library yet.";
inline constexpr const char* kLookAround = "Look around slowly.";
inline constexpr const char* kGoBackTo = "Go back to {}, and look around slowly.";  // Place.
inline constexpr const char* kGoToAPlace = "Go to one of these places and look around slowly.";
inline constexpr const char* kGoToAView = "Go to where you see one of these.";

// The way on.
inline constexpr const char* kTo = "To {}";                     // Place.
inline constexpr const char* kToThrough = "To {}, through {}";  // Place, and the one before it on the way.

// On a tour with stops.
inline constexpr const char* kFirstStop = "{}. First: {}";  // What the tour has, stop.
inline constexpr const char* kOneStop = "1 stop";
inline constexpr const char* kStops = "{} stops";                                    // Number.
inline constexpr const char* kAboutMinutes = "{}, about {} minutes";                 // Stops, number.
inline constexpr const char* kStopAndNext = "Stop {} of {}. Next: {}";               // Number, number, stop.
inline constexpr const char* kNext = "Next: {}, {} of {}";                           // Stop, number, number.
inline constexpr const char* kBackTo = "Back to {}, {} of {}";                       // Stop, number, number.
inline constexpr const char* kSawAll = "The tour ends here. You saw all {} stops.";  // Number.
inline constexpr const char* kSawOnly = "The tour ends here. You saw the only stop.";
inline constexpr const char* kSawSome = "The tour ends here. You saw {} of {} stops.";  // Numbers.
inline constexpr const char* kNumberedStop = "{}. {}";                                  // Number, stop.
inline constexpr const char* kSeenStop = "{}. {} (seen)";                               // The same.
inline constexpr const char* kSkippedStop = "{}. {} (skipped)";
inline constexpr const char* kNextStop = "{}. {} (next)";

// The text with the values in the place of its braces, in their order.
std::string Filled(std::string_view text, std::initializer_list<std::string> values);

}  // namespace docent::app::visitor_strings
