// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "maps/hub/sync.h"
#include "maps/library/library.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {

// The base of suites in which two devices, whose libraries are `a` and `b`, share a hub.
class WithTwoDevices : public WithHubServer {
 protected:
  SyncReport PushFrom(const std::string& name) { return Push(SampleSync(Url(), folder_ / name)); }
  SyncReport PullTo(const std::string& name) { return Pull(SampleSync(Url(), folder_ / name)); }
  Library Open(const std::string& name) { return OpenSampleLibrary(folder_ / name); }

  // A map that both devices have. Returns its key on `b`.
  std::uint64_t ShareMap(const std::string& name, Policy policy = Policy::kOpen) {
    {
      Library a = Open("a");
      AddSampleMap(&a, name, 7, policy);
    }
    PushFrom("a");
    PullTo("b");
    return Open("b").FindByName(name).key;
  }

  TemporaryFolder folder_;
};

}  // namespace docent::maps
