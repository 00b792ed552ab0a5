// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/maps_tour_command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/number_option.h"
#include "app/command_line/text_table.h"
#include "app/session/library_scene.h"
#include "content/language.h"
#include "engine/base/error.h"
#include "maps/library/library.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

struct MapsTourOptions {
  std::filesystem::path library;
  std::string name, new_name;
  std::vector<std::string> stops;       // Names of maps.
  std::optional<std::string> language;  // Empty removes it.
  std::optional<int> minutes;           // 0 removes them.
  bool as_json = false;
};
using MapsTourAction = void (*)(const MapsTourOptions& options);

// The names of the stops. A stop whose map is missing, as in a damaged library, is shown by its key.
std::vector<std::string> StopNamesOf(const maps::Tour& tour, const std::vector<maps::MapInfo>& infos) {
  std::vector<std::string> names;
  for (const std::uint64_t stop : tour.stops) {
    const auto map =
        std::find_if(infos.begin(), infos.end(), [&](const maps::MapInfo& info) { return info.key == stop; });
    names.push_back(map == infos.end() ? "(map " + std::to_string(stop) + ", which does not exist)"
                                       : map->name);
  }
  return names;
}

Json ToJson(const maps::Tour& tour, const std::vector<maps::MapInfo>& infos) {
  Json json = {{"name", tour.name}, {"stops", StopNamesOf(tour, infos)}};
  json["language"] = tour.language.empty() ? Json() : Json(tour.language);
  json["minutes"] = tour.minutes == 0 ? Json() : Json(tour.minutes);
  return json;
}

void PrintJson(const Json& json) {
  std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
}

maps::Tour& TourNamed(const std::string& name, const std::string& file, std::vector<maps::Tour>* tours) {
  const auto found =
      std::find_if(tours->begin(), tours->end(), [&](const maps::Tour& tour) { return tour.name == name; });
  if (found == tours->end()) throw Error("'" + file + "' has no tour named '" + name + "'.");
  return *found;
}

void ListTours(const MapsTourOptions& options) {
  const maps::Library library = OpenLibrary(options.library, maps::Access::kReadOnly);
  const std::vector<maps::Tour> tours = library.Tours();
  const std::vector<maps::MapInfo> infos = library.List();
  if (options.as_json) {
    Json json = {{"tours", Json::array()}};
    for (const maps::Tour& tour : tours) json["tours"].push_back(ToJson(tour, infos));
    PrintJson(json);
    return;
  }
  if (tours.empty()) std::puts("The library holds no tour.");
  std::vector<std::vector<std::string>> rows;
  for (const maps::Tour& tour : tours) {
    rows.push_back({tour.name,
                    std::to_string(tour.stops.size()) + (tour.stops.size() == 1 ? " stop" : " stops"),
                    tour.minutes == 0 ? "" : std::to_string(tour.minutes) + " min", tour.language});
  }
  std::fputs(FormatColumns({{24}, {10, Alignment::kRight}, {8, Alignment::kRight}, {}}, rows).c_str(),
             stdout);
}

void ShowTour(const MapsTourOptions& options) {
  const maps::Library library = OpenLibrary(options.library, maps::Access::kReadOnly);
  std::vector<maps::Tour> tours = library.Tours();
  const maps::Tour& tour = TourNamed(options.name, library.file(), &tours);
  const std::vector<maps::MapInfo> infos = library.List();
  if (options.as_json) {
    PrintJson(ToJson(tour, infos));
    return;
  }
  std::printf("%-20s %s\n", "name", tour.name.c_str());
  if (!tour.language.empty()) std::printf("%-20s %s\n", "language", tour.language.c_str());
  if (tour.minutes != 0) std::printf("%-20s %d\n", "minutes", tour.minutes);
  std::printf("%-20s %zu\n", "stops", tour.stops.size());
  const std::vector<std::string> names = StopNamesOf(tour, infos);
  for (std::size_t i = 0; i < names.size(); ++i) std::printf("%20zu %s\n", i + 1, names[i].c_str());
}

// Gives a tour what the options say about it.
void TakeOptions(const MapsTourOptions& options, const maps::Library& library, maps::Tour* tour) {
  if (options.language) tour->language = *options.language;
  if (options.minutes) tour->minutes = *options.minutes;
  if (options.stops.empty()) return;
  tour->stops.clear();
  for (const std::string& name : options.stops) {
    const std::uint64_t key = library.FindByName(name).key;
    if (std::find(tour->stops.begin(), tour->stops.end(), key) != tour->stops.end())
      throw Error("A tour stops once at each map, but '" + name + "' is given twice.");
    tour->stops.push_back(key);
  }
}

void CreateTour(const MapsTourOptions& options) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  maps::Tour tour;
  tour.name = options.name;
  TakeOptions(options, library, &tour);
  library.ChangeTours([&](std::vector<maps::Tour>* tours) { tours->push_back(tour); });
}

void EditTour(const MapsTourOptions& options) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  maps::Tour given;
  TakeOptions(options, library, &given);
  library.ChangeTours([&](std::vector<maps::Tour>* tours) {
    maps::Tour& tour = TourNamed(options.name, library.file(), tours);
    if (!options.stops.empty()) tour.stops = given.stops;
    if (options.language) tour.language = given.language;
    if (options.minutes) tour.minutes = given.minutes;
  });
}

void RenameTour(const MapsTourOptions& options) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  library.ChangeTours([&](std::vector<maps::Tour>* tours) {
    TourNamed(options.name, library.file(), tours).name = options.new_name;
  });
}

void RemoveTour(const MapsTourOptions& options) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  library.ChangeTours([&](std::vector<maps::Tour>* tours) {
    TourNamed(options.name, library.file(), tours);
    std::erase_if(*tours, [&](const maps::Tour& tour) { return tour.name == options.name; });
  });
}

// Adds the options for what a tour consists of.
CLI::Option* AddTourContents(CLI::App* command, MapsTourOptions* options) {
  CLI::Option* stops = command
                           ->add_option("--stops", options->stops,
                                        "Names of the maps, in the order in which visitors go there")
                           ->type_name("MAP...")
                           ->expected(1, static_cast<int>(maps::kMaxTourStops));
  command
      ->add_option_function<std::string>(
          "--language",
          [=](const std::string& text) {
            options->language = content::LanguageTag(text);
            if (options->language->empty())
              throw CLI::ValidationError("--language",
                                         "'" + text + "' is not a language tag such as de or es-419");
          },
          "Language in which texts are shown on this tour (default: that of the visitor)")
      ->type_name("TAG");
  command->add_option("--minutes", options->minutes, "How long the tour takes")
      ->type_name("MINUTES")
      ->check(CLI::Range(1, maps::kMaxTourMinutes));
  return stops;
}

}  // namespace

void AddMapsTourCommands(CLI::App* group, Invocation* invocation) {
  CLI::App* tour = AddSubcommand(group, "tour", "Manage the tours, which lead visitors from map to map",
                                 "docent maps tour list --library museum.docent");
  tour->require_subcommand(1);
  const auto options = std::make_shared<MapsTourOptions>();
  const auto add = [&](const char* name, LibraryUse use, const char* description, const char* example,
                       MapsTourAction action) {
    CLI::App* command = AddSubcommand(tour, name, description, example);
    AddLibraryOption(command, use, &options->library, invocation);
    command->callback([=] { invocation->run = [=] { action(*options); }; });
    return command;
  };
  const auto add_name = [&](CLI::App* command) {
    command->add_option("NAME", options->name, "Name of the tour")->required();
    return command;
  };
  const auto add_json = [&](CLI::App* command) {
    command->add_flag("--json", options->as_json, "Print JSON");
  };

  add_json(add("list", LibraryUse::kRead, "List the tours", "docent maps tour list --library museum.docent",
               ListTours));
  add_json(add_name(add("show", LibraryUse::kRead, "Show one tour with its stops",
                        "docent maps tour show Highlights --library museum.docent", ShowTour)));
  CLI::App* create = add_name(add(
      "create", LibraryUse::kChange, "Create a tour",
      "docent maps tour create Highlights --stops Elephants \"Desk 3\" --minutes 20 --library museum.docent",
      CreateTour));
  AddTourContents(create, options.get())->required();
  CLI::App* edit = add_name(
      add("edit", LibraryUse::kChange, "Change the stops, the language or the minutes of a tour",
          "docent maps tour edit Highlights --stops \"Desk 3\" Elephants Foxes --library museum.docent",
          EditTour));
  AddTourContents(edit, options.get());
  edit->add_flag_callback(
          "--no-language", [=] { options->language = ""; }, "Show texts in the visitor's language")
      ->excludes("--language");
  edit->add_flag_callback(
          "--no-minutes", [=] { options->minutes = 0; }, "Do not say how long the tour takes")
      ->excludes("--minutes");
  edit->callback([=] {
    if (options->stops.empty() && !options->language && !options->minutes)
      throw CLI::ValidationError("Nothing to change was given");
    invocation->run = [=] { EditTour(*options); };
  });
  add_name(add("rename", LibraryUse::kChange, "Rename a tour",
               "docent maps tour rename Highlights Masterpieces --library museum.docent", RenameTour))
      ->add_option("NEW_NAME", options->new_name, "New name of the tour")
      ->required();
  add_name(add("remove", LibraryUse::kChange, "Remove a tour; its maps stay",
               "docent maps tour remove Highlights --library museum.docent", RemoveTour));
}

}  // namespace docent::app
