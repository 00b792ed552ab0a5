// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/named_options.h"

#include <cmath>
#include <set>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {
namespace {

using Options = SimulationOptions;

constexpr NamedOption kOptions[] = {
    {"duration", "SECONDS", "maximum duration; 0 for the whole trajectory", 0, 86400,
     [](double value, Options* options) { options->duration_s = value; }},
    {"fps", "HZ", "frame rate, images per second (default 30)", 0.01, 1000,
     [](double value, Options* options) { options->frame_rate_hz = value; }},
    {"noise", "LEVELS", "standard deviation of the constant image noise, grey levels of 255 (default 1.5)", 0,
     100, [](double value, Options* options) { options->noise_sigma = value; }},
    {"gain-noise", "LEVELS",
     "standard deviation of the noise that grows with signal and gain, grey levels at a signal of 128", 0, 50,
     [](double value, Options* options) { options->faults.gain_noise_sigma = value; }},
    {"blur", "N", "images averaged over an exposure to simulate motion blur; 1 for none", 1, 64,
     [](double value, Options* options) { options->blur_samples = static_cast<int>(value); }, true},
    {"exposure", "MS", "exposure time in milliseconds; only used with blur (default 16.7)", 0, 1000,
     [](double value, Options* options) { options->exposure_s = value / 1000; }},
    {"rolling-shutter", "MS", "time from the exposure of the first row to that of the last row, milliseconds",
     0, 1000, [](double value, Options* options) { options->faults.readout_s = value / 1000; }},
    {"interlaced", nullptr, "expose odd rows half a frame later than even rows", 0, 1,
     [](double value, Options* options) { options->faults.interlaced = value != 0; }},
    {"focal-error", "PERCENT", "error of the calibrated focal length; positive: too long", -50, 100,
     [](double value, Options* options) { options->faults.focal_error = value / 100; }},
    {"distortion-error", "PIXELS",
     "error of the calibrated distortion: RMS displacement of rays over the image", -20, 20,
     [](double value, Options* options) { options->faults.distortion_error_px = value; }},
    {"field-of-view", "DEGREES",
     "horizontal field of view of a lens without distortion that replaces the scene's lens", 5, 140,
     [](double value, Options* options) { options->field_of_view_deg = value; }},
    {"gain", "FACTOR", "factor of the exposure; above 1, highlights are clipped", 0.05, 20,
     [](double value, Options* options) { options->faults.gain = value; }},
    {"exposure-jumps", "STOPS", "largest exposure jump; jumps occur at random times and decay", 0, 4,
     [](double value, Options* options) { options->faults.exposure_jump_stops = value; }},
    {"drops", "PERCENT", "percentage of frames that are lost, singly and in bursts", 0, 90,
     [](double value, Options* options) { options->faults.dropped_share = value / 100; }},
    {"tremor", "DEGREES", "RMS rotation about each axis of the hand tremor of 4 to 12 Hz", 0, 5,
     [](double value, Options* options) { options->faults.tremor_deg = value; }},
    {"identical-places", nullptr,
     "give all bays or desks the same content, so that they cannot be distinguished", 0, 1,
     [](double value, Options* options) { options->identical_places = value != 0; }},
    {"walk", "N",
     "another walk through the bays or desks after they were built, by its number; 0 for the usual one", 0,
     1e9, [](double value, Options* options) { options->walk = static_cast<std::uint64_t>(value); }, true},
    {"build", "SECONDS", "time at each bay or desk while it is built; at least the usual 6 seconds", 0, 3600,
     [](double value, Options* options) { options->build_s = value; }},
    {"rounds", "N", "how often all bays or desks are visited after they were built", 1, 1000,
     [](double value, Options* options) { options->rounds = static_cast<int>(value); }, true},
    {"rest", "SECONDS", "how long the person rests, with the lens covered; the rest begins at rest-at", 0,
     3600, [](double value, Options* options) { options->rest_s = value; }},
    {"rest-at", "SECONDS", "when the rest begins, seconds from the first image", 0, 86400,
     [](double value, Options* options) { options->rest_at_s = value; }},
};

std::string Names() {
  std::string names;
  for (const NamedOption& option : kOptions) names += (names.empty() ? "" : ", ") + std::string(option.name);
  return names;
}

const NamedOption& OptionOf(std::string_view name) {
  for (const NamedOption& option : kOptions) {
    if (name == option.name) return option;
  }
  throw Error("The simulator has no option '" + std::string(name) + "'; its options are " + Names() + ".");
}

}  // namespace

std::span<const NamedOption> NamedOptions() {
  return kOptions;
}

void SetNamedOption(const NamedOption& option, std::string_view text, SimulationOptions* options) {
  const std::string name = "The simulator's option '" + std::string(option.name) + "'";
  if (option.unit == nullptr) {
    if (!text.empty()) throw Error(name + " takes no number.");
    option.set(1, options);
    return;
  }
  const auto value = ParseNumber(text);
  if (!value || !(*value >= option.lowest && *value <= option.highest) ||
      (option.whole && *value != std::round(*value))) {
    throw Error(name + " takes a " + (option.whole ? "whole " : "") + "number from " +
                FormatNumber(option.lowest) + " to " + FormatNumber(option.highest) + ", not '" +
                std::string(text) + "': " + option.meaning + ".");
  }
  option.set(*value, options);
}

void SetNamedOptions(std::string_view text, SimulationOptions* options) {
  std::set<std::string_view> taken;
  for (bool more = true; more;) {
    const std::size_t comma = text.find(',');
    const std::string_view word = text.substr(0, comma);
    more = comma != std::string_view::npos;
    if (more) text.remove_prefix(comma + 1);
    const std::size_t equals = word.find('=');
    const std::string_view name = word.substr(0, equals);
    const NamedOption& option = OptionOf(name);
    if (!taken.insert(name).second)
      throw Error("The simulator's option '" + std::string(name) + "' is specified twice.");
    const bool has_number = equals != std::string_view::npos;
    if (option.unit != nullptr && !has_number) {
      throw Error("The simulator's option '" + std::string(name) + "' needs a number: " + std::string(name) +
                  "=" + option.unit + ".");
    }
    if (option.unit == nullptr && has_number)
      throw Error("The simulator's option '" + std::string(name) + "' takes no number.");
    SetNamedOption(option, has_number ? word.substr(equals + 1) : std::string_view(), options);
  }
}

}  // namespace docent::app
