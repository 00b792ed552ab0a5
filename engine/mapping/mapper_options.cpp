// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/mapper_options.h"

#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> MapperOptions::Validate() const {
  return OptionCheck()
      .That(max_queue > 0, "The queue of the mapper must hold at least one keyframe.")
      .Positive(initial_baseline, "baseline of two initial views")
      .AtLeast(neighbours, 0, "number of neighbours of a keyframe")
      .AtLeast(min_neighbour_baseline, 0, "smallest baseline of a neighbour")
      .That(max_neighbour_baseline > min_neighbour_baseline,
            "The largest baseline of a neighbour must exceed the smallest.")
      .AtLeast(min_initial_points, 1, "number of points of a new map")
      .Contained(guided_matching.Validate())
      .Contained(creation.Validate())
      .Contained(infinite.Validate())
      .Contained(localization.Validate())
      .Contained(appearance.Validate())
      .Contained(culling.Validate())
      .AtLeast(min_initial_directions, 1, "number of infinite points of a new map")
      .Positive(min_infinite_parallax_deg, "parallax of an infinite point")
      .AtLeast(conversion_neighbours, 0, "number of neighbours of a localized keyframe")
      .Contained(adjustment.Validate())
      .Contained(loops.Validate())
      .Contained(joining.Validate())
      .Contained(lens.Validate())
      .Contained(readout.Validate())
      .Contained(track_readout.Validate())
      .Contained(search.Validate())
      .fault();
}

}  // namespace docent::engine
