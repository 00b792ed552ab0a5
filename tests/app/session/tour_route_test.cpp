// SPDX-License-Identifier: Apache-2.0
#include "app/session/tour_route.h"

#include <gmock/gmock.h>

#include "app/session/library_scene.h"
#include "maps/exchange/exchange.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/maps/map_samples.h"

namespace docent::app {
namespace {

TEST(TourRoute, AMapWhoseCopyIsAStopTooIsOneStop) {
  const TemporaryFolder folder;
  maps::Library library =
      OpenLibrary(folder / "a.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  std::uint64_t seed = 0;
  for (const char* name : {"Elephants", "Lions"}) {
    library.Save({library.NewKey(), name, maps::Policy::kOpen, maps::MakeSampleMap(++seed, {.keyframes = 6}),
                  nullptr});
  }
  maps::ExportMap(library, 1, folder / "elephants.docent");
  maps::ImportMaps(OpenLibrary(folder / "elephants.docent", maps::Access::kReadOnly), folder / "a.docent",
                   LibrarySceneTools());
  const std::uint64_t copy = library.FindByName("Elephants (2)").key;
  maps::Tour tour;
  tour.name = "Highlights";
  tour.stops = {1, copy, 2};
  const Route route = RouteOf(library, tour);
  ASSERT_EQ(route.stops.size(), 2u);
  EXPECT_EQ(route.stops[0].key, copy);
  EXPECT_EQ(route.stops[0].name, "Elephants") << "visitors do not read that it is a copy";
  EXPECT_EQ(route.stops[1].name, "Lions");
}

}  // namespace
}  // namespace docent::app
