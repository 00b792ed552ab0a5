// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace docent {

// Gives the calling thread a third of the processor time of other threads of the program where there are
// fewer processors than busy threads. For what is not on the way from an image to its pose: a delayed image
// is lost time for the user, a delayed keyframe or surface is not. Only lowers; the priority cannot be raised
// again. When the system refuses, all threads keep the same priority.
void LowerThreadPriority();

}  // namespace docent
