// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>

#include "engine/base/error.h"
#include "maps/library/library.h"
#include "maps/maintenance/recovery.h"
#include "maps/storage/snapshot_reader.h"
#include "tests/fuzz/allocation_limit.h"
#include "tests/fuzz/small_library.h"

// Feeds a whole library file to all code that reads one: opening, listing, thumbnails, maps, scenes,
// verification and recovery. The input modifies a small valid library: it is a sequence of patches, each an
// offset of 3 bytes, a length of 1 byte and that many bytes; an incomplete last patch truncates the file at
// its offset. An input that begins with SQLite's magic number is the file itself. The recovered library must
// verify. No allocation may be larger than four times the file, or than what SQLite allocates for any
// database: its lookaside memory of 48,000 bytes, which is less than four times the smallest library. The
// recovery, which writes a library, may allocate four times the size of an empty one.
namespace {

namespace fs = std::filesystem;
using docent::maps::Bytes;

docent::maps::LibraryOptions FastOptions() {
  docent::maps::LibraryOptions options;
  options.make_features = docent::maps::MakeSizesOnly;
  options.load_threads = 1;
  return options;
}

Bytes MakeSeed() {
  using namespace docent;
  const fs::path path = docent::fuzz::TemporaryFolder() / "seed.docent";
  {
    maps::Library library =
        maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes, FastOptions());
    for (const char* name : {"map 0", "map 1"})
      library.Save({library.NewKey(), name, maps::Policy::kOpen, fuzz::SmallMap(), fuzz::SmallScene()});
  }
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::size_t EmptyLibrarySize() {
  const fs::path path = docent::fuzz::TemporaryFolder() / "empty.docent";
  docent::maps::Library::Open(path, docent::maps::Access::kReadWrite, docent::maps::CreateIfMissing::kYes,
                              FastOptions());
  return fs::file_size(path);
}

Bytes Patched(Bytes file, std::span<const std::uint8_t> patches) {
  constexpr std::size_t kHead = 4;
  while (patches.size() > kHead) {
    const std::size_t offset =
        (patches[0] | std::size_t{patches[1]} << 8 | std::size_t{patches[2]} << 16) % file.size();
    const std::size_t length = patches[3];
    patches = patches.subspan(kHead);
    if (length > patches.size()) {
      file.resize(offset);
      break;
    }
    for (std::size_t i = 0; i < length && offset + i < file.size(); ++i) file[offset + i] = patches[i];
    patches = patches.subspan(length);
  }
  return file;
}

void ReadAll(const fs::path& path) {
  using namespace docent::maps;
  const Library library = Library::Open(path, Access::kReadOnly, CreateIfMissing::kNo, FastOptions());
  library.Verify();
  library.LoadAppearance([](const MapInfo&, const Library::Appearance&) {});
  for (const MapInfo& info : library.List()) {
    try {
      library.Load(info.key);
    } catch (const docent::Error&) {
      // The next map may be undamaged.
    }
  }
}

void Recover(const fs::path& path) {
  using namespace docent::maps;
  const fs::path target = docent::fuzz::TemporaryFolder() / "recovered.docent";
  std::error_code error;
  fs::remove(target, error);
  docent::maps::Recover(path, target);
  const Library library = Library::Open(target, Access::kReadOnly, CreateIfMissing::kNo, FastOptions());
  if (!library.Verify().empty()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Bytes seed = MakeSeed();
  constexpr char kMagic[] = "SQLite format 3";
  const bool whole = size >= sizeof(kMagic) && std::memcmp(data, kMagic, sizeof(kMagic)) == 0;
  const Bytes file = whole ? Bytes(data, data + size) : Patched(seed, {data, size});
  const fs::path path = docent::fuzz::TemporaryFolder() / "input.docent";
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
  constexpr std::size_t kSqliteLookasideBytes = 48'000;
  static const std::size_t empty_size = EmptyLibrarySize();
  for (const bool recover : {false, true}) {
    const AllocationLimit limit(
        std::max({4 * file.size(), kSqliteLookasideBytes, recover ? 4 * empty_size : std::size_t{0}}));
    try {
      recover ? Recover(path) : ReadAll(path);
    } catch (const docent::Error&) {
      // An error is the expected result for most inputs.
    }
  }
  return 0;
}
