// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/run_arguments.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <system_error>

#include "app/files/text_file.h"
#include "content/language.h"
#include "engine/base/error.h"
#include "maps/storage/map_codec.h"

namespace docent::app {

namespace {

template <typename Choice>
std::string JoinedNames(const std::map<std::string, Choice>& names) {
  std::string joined;
  for (const auto& [name, choice] : names) joined += (joined.empty() ? "" : "|") + name;
  return joined;
}

// Adds an option with a fixed set of named values. Any other value is an error that lists the names.
template <typename Choice, typename Target>
void AddChoice(CLI::App* command, const std::string& option, Target* target, const std::string& description,
               const std::map<std::string, Choice>& names) {
  command
      ->add_option_function<std::string>(
          option,
          [=](const std::string& word) {
            const auto found = names.find(word);
            if (found == names.end()) {
              throw CLI::ValidationError(option, "'" + word + "' is not one of " + JoinedNames(names));
            }
            *target = found->second;
          },
          description)
      ->type_name(JoinedNames(names));
}

}  // namespace

void AddSecondsOption(CLI::App* command, const std::string& option, Timestamp* target,
                      const std::string& description) {
  command
      ->add_option_function<std::string>(
          option,
          [=](const std::string& text) {
            const auto time = ParseSeconds(text);
            if (!time || *time < Timestamp{}) {
              throw CLI::ValidationError(option, "'" + text + "' is not a number of seconds");
            }
            *target = *time;
          },
          description)
      ->type_name("SECONDS");
}

void AddMetresOption(CLI::App* command, const std::string& option, double least, double* target,
                     const std::string& description) {
  constexpr double kMost_m = 1e4;
  command
      ->add_option_function<std::string>(
          option,
          [=](const std::string& text) {
            const auto metres = ParseNumber(text);
            if (!metres || *metres < least || *metres > kMost_m) {
              throw CLI::ValidationError(option, "'" + text + "' is not a length in metres, from " +
                                                     FormatNumber(least) + " to " + FormatNumber(kMost_m));
            }
            *target = *metres;
          },
          description)
      ->type_name("METRES");
}

void AddPaceOption(CLI::App* command, std::optional<Pace>* pace, const std::string& otherwise) {
  AddChoice<Pace>(command, "--pace", pace,
                  "How images are processed: lockstep is reproducible, eager processes every image, realtime "
                  "skips late images (default: " +
                      otherwise + ")",
                  {{"lockstep", Pace::kLockstep}, {"eager", Pace::kEager}, {"realtime", Pace::kRealtime}});
}

void AddEngineOption(CLI::App* command, EngineKind* engine) {
  AddChoice<EngineKind>(
      command, "--engine", engine,
      "hybrid maps pure rotations as panoramas (the default); sixdof is plain six-degrees-of-freedom SLAM",
      {{"hybrid", EngineKind::kHybrid}, {"sixdof", EngineKind::kSixDof}});
}

void AddWhenLostOption(CLI::App* command, std::optional<WhenLost>* when_lost, const std::string& otherwise) {
  AddChoice<WhenLost>(
      command, "--when-lost", when_lost,
      "What to do when tracking is lost and no map is recognized: start a new map, which is joined with a "
      "known map where they overlap, or wait until a map is recognized (default: " +
          otherwise + ")",
      {{"new", WhenLost::kNew}, {"wait", WhenLost::kWait}});
}

void AddSeedOption(CLI::App* command, std::uint64_t* seed) {
  // Parsed as text, because CLI11's unsigned integers would wrap -1 around to the largest seed.
  command
      ->add_option_function<std::string>(
          "--seed",
          [=](const std::string& text) {
            const auto value = ParseInteger(text);
            if (!value || *value < 0)
              throw CLI::ValidationError("--seed", "'" + text + "' is not a whole number of 0 or more");
            *seed = static_cast<std::uint64_t>(*value);
          },
          "Seed of all random choices (default 1)")
      ->type_name("N");
}

void AddCameraFormatOption(CLI::App* command, CameraOptions* options) {
  command
      ->add_option_function<std::string>(
          "--camera-format",
          [options](const std::string& text) {
            try {
              options->device_format = ParseDeviceFormat(text);
            } catch (const Error& error) {
              throw CLI::ValidationError("--camera-format", error.what());
            }
          },
          "Image size and frame rate of a device")
      ->type_name("640x480@30");
}

void AddLensOption(CLI::App* command, std::optional<engine::LensModel>* lens) {
  using engine::LensModel;
  AddChoice<std::optional<LensModel>>(
      command, "--lens", lens,
      "Lens model; auto selects the one with the smallest error on views that "
      "were not used for the fit",
      {{"auto", std::nullopt},
       {"radial_tangential", LensModel::kRadialTangential},
       {"fov", LensModel::kFov},
       {"kannala_brandt", LensModel::kKannalaBrandt}});
}

void AddRunArguments(CLI::App* command, const std::string& auto_calibration, RunArguments* run) {
  command
      ->add_option("--camera", run->cameras.sources,
                   "A device, a video file, a folder with an image sequence, or sim:SCENE[,OPTION=NUMBER...] "
                   "(see docent simulate --help); give it twice for two cameras")
      ->required()
      ->type_name("SOURCE")
      ->allow_extra_args(false);
  command
      ->add_option("--calibration", run->cameras.calibrations,
                   "Calibration file of each camera, in the same order; without one, the calibration in the "
                   "folder of a "
                   "recording is used. auto, or where there is none: " +
                       auto_calibration)
      ->type_name("FILE|auto")
      ->allow_extra_args(false);
  AddCameraFormatOption(command, &run->cameras.options);
  AddSecondsOption(command, "--from", &run->cameras.from,
                   "Start at this time (seconds after the first image)");
  AddSecondsOption(command, "--until", &run->cameras.until,
                   "Stop at this time (seconds after the first image)");
  AddPaceOption(command, &run->pace, "realtime with a camera or a window, else eager");
  AddEngineOption(command, &run->engine);
  AddSeedOption(command, &run->seed);
  AddMemoryOption(command, &run->memory_budget_bytes);
  AddOcclusionOption(command, &run->occlusion);
  AddLightOption(command, &run->room_light);
  AddMetresOption(command, "--baseline", kMinLength_m, &run->baseline_m,
                  "Distance between two cameras mounted rigidly together; sets the scale of their maps");
  AddChoice<std::optional<HeadPolicy>>(
      command, "--head", &run->head,
      "Where a camera with a pan-tilt head looks: at the wearer's gaze, or so that the map stays in view; a "
      "lost camera searches for the map",
      {{"gaze", HeadPolicy::kFollowGaze}, {"map", HeadPolicy::kKeepMapInView}});
  AddChoice<bool>(command, "--sound", &run->sound,
                  "Whether the sounds that are placed in maps are heard (default: on with a window); their "
                  "captions are always shown",
                  {{"on", true}, {"off", false}});
  command
      ->add_option_function<std::string>(
          "--language",
          [=](const std::string& text) {
            const std::string tag = content::LanguageTag(text);
            if (tag.empty())
              throw CLI::ValidationError("--language",
                                         "'" + text + "' is not a language tag such as de or es-419");
            run->language = tag;
          },
          "Language of the texts, where they have a variant in it, and of the sentences for visitors on a "
          "tour (en, de, es or ar; default: that of the locale)")
      ->type_name("TAG");
  command->add_flag("--headless", run->headless, "Open no window");
  command->add_option("--output", run->output, "Folder for trajectory, frames and events")->type_name("DIR");
  command->add_option("--record", run->record, "Write the augmented view as a video")->type_name("FILE.mp4");
}

void AddOcclusionOption(CLI::App* command, Occlusion* occlusion) {
  AddChoice<Occlusion>(
      command, "--occlusion", occlusion,
      "What hides content behind it: nothing (off); the occluders that authors place (proxies); also the "
      "surfaces of the map, which docent maps densify computes, as does an author's session while the map is "
      "idle (map; default). Where an occluder stands for a surface, the surface is ignored",
      {{"off", Occlusion::kOff}, {"proxies", Occlusion::kProxies}, {"map", Occlusion::kMap}});
}

void AddLightOption(CLI::App* command, bool* room_light) {
  AddChoice<bool>(command, "--light", room_light,
                  "The light on models: that of the room, as far as its surfaces show it, with shadows on "
                  "the room and the exposure, noise and motion blur of the video (room; default), or always "
                  "the same without shadows, noise and blur, which is drawn faster (plain)",
                  {{"room", true}, {"plain", false}});
}

void AddMemoryOption(CLI::App* command, std::size_t* bytes) {
  command
      ->add_option_function<std::string>(
          "--memory-budget",
          [=](const std::string& text) {
            constexpr std::pair<std::string_view, int> kUnits[] = {{"KiB", 10}, {"MiB", 20}, {"GiB", 30}};
            constexpr std::int64_t kMax = 1 << 20;  // In any unit; keeps the product far from overflow.
            for (const auto& [unit, shift] : kUnits) {
              if (!text.ends_with(unit)) continue;
              const auto number = ParseInteger(text.substr(0, text.size() - unit.size()));
              if (!number || *number < 1 || *number > kMax) break;
              *bytes = static_cast<std::size_t>(*number) << shift;
              return;
            }
            throw CLI::ValidationError("--memory-budget",
                                       "'" + text + "' is not a size such as 512MiB or 1GiB");
          },
          "Memory for maps; the least recently used maps are evicted first (default 1GiB)")
      ->type_name("SIZE");
}

// The first variable that is set and not empty counts (POSIX, Environment Variables, section 8.2).
std::string LanguageOfEnvironment() {
  for (const char* name : {"LC_ALL", "LC_MESSAGES", "LANG"}) {
    const char* const locale = std::getenv(name);
    if (locale != nullptr && *locale != '\0') return content::LanguageOfLocale(locale);
  }
  return "";
}

namespace {

// Whether both names are those of one file, which need not exist.
bool IsSameFile(const std::filesystem::path& a, const std::filesystem::path& b) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::equivalent(a, b, error)) return true;
  // A relative name none of whose folders exists would stay relative.
  const fs::path whole_a = fs::weakly_canonical(fs::absolute(a, error), error);
  if (error) return false;
  const fs::path whole_b = fs::weakly_canonical(fs::absolute(b, error), error);
  return !error && whole_a == whole_b;
}

}  // namespace

void CheckOutputFiles(const std::vector<OptionFile>& outputs, const std::vector<OptionFile>& inputs) {
  const auto replaces = [](const std::filesystem::path& file, const std::filesystem::path& read) {
    std::error_code error;
    return IsSameFile(file, read) ||
           (std::filesystem::is_directory(read, error) && IsSameFile(file, read / "video.mp4"));
  };
  for (const OptionFile& output : outputs) {
    for (const OptionFile& input : inputs) {
      if (replaces(output.file, input.file)) {
        throw CLI::ValidationError(output.option,
                                   "would overwrite the file of " + input.option + " " + input.file.string());
      }
    }
    for (const OptionFile& other : outputs) {
      if (&other != &output && IsSameFile(output.file, other.file))
        throw CLI::ValidationError(output.option, "is the same file as that of " + other.option);
    }
  }
}

std::vector<OptionFile> InputFilesOf(const RunArguments& run) {
  std::vector<OptionFile> inputs;
  for (const std::string& source : run.cameras.sources) inputs.push_back({"--camera", source});
  for (const std::filesystem::path& calibration : run.cameras.calibrations)
    inputs.push_back({"--calibration", calibration});
  return inputs;
}

void CheckRunArguments(const RunArguments& run) {
  if (run.cameras.sources.size() > 2)
    throw CLI::ValidationError("--camera", "at most two cameras are supported");
  if (run.cameras.calibrations.size() > run.cameras.sources.size()) {
    throw CLI::ValidationError("--calibration", "there are more calibrations than cameras");
  }
  if (run.baseline_m > 0 && run.cameras.sources.size() < 2) {
    throw CLI::ValidationError("--baseline", "needs two cameras; give --camera twice");
  }
  if (run.cameras.until > Timestamp{} && run.cameras.until <= run.cameras.from) {
    throw CLI::ValidationError("--until", "must be later than --from");
  }
  if (run.record) CheckOutputFiles({{"--record", *run.record}}, InputFilesOf(run));
}

void CheckStorableSize(const engine::CameraModel& camera, const std::string& source) {
  const int width = camera.width_px(), height = camera.height_px();
  if (std::min(width, height) >= maps::kMinImageSidePx && std::max(width, height) <= maps::kMaxImageSidePx &&
      std::int64_t{width} * height <= maps::kMaxImagePixels) {
    return;
  }
  throw Error("The images of " + source + " are " + std::to_string(width) + "x" + std::to_string(height) +
              " pixels, but a library stores images with sides of " + std::to_string(maps::kMinImageSidePx) +
              " to " + std::to_string(maps::kMaxImageSidePx) + " pixels and at most " +
              std::to_string(maps::kMaxImagePixels) + " pixels.");
}

}  // namespace docent::app
