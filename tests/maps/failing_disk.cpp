// SPDX-License-Identifier: Apache-2.0
#include "tests/maps/failing_disk.h"

#include <sqlite3.h>

#include <atomic>
#include <limits>

namespace docent::maps {

namespace {

std::atomic<int> writes_left = std::numeric_limits<int>::max();
std::atomic<bool> only_read = false;
sqlite3_vfs* system_vfs = nullptr;

// The wrapper's file object, which precedes the system's in memory.
struct File {
  sqlite3_file base;
  sqlite3_file* system() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};
sqlite3_file* System(sqlite3_file* file) {
  return reinterpret_cast<File*>(file)->system();
}

int Write(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 offset) {
  if (writes_left.load() == std::numeric_limits<int>::max() || writes_left.fetch_sub(1) > 0)
    return System(file)->pMethods->xWrite(System(file), bytes, count, offset);
  writes_left = 0;
  return SQLITE_FULL;
}

// All other functions call the system's.
int Close(sqlite3_file* f) {
  return System(f)->pMethods ? System(f)->pMethods->xClose(System(f)) : SQLITE_OK;
}
int Read(sqlite3_file* f, void* to, int count, sqlite3_int64 at) {
  return System(f)->pMethods->xRead(System(f), to, count, at);
}
int Truncate(sqlite3_file* f, sqlite3_int64 size) {
  return System(f)->pMethods->xTruncate(System(f), size);
}
int Sync(sqlite3_file* f, int flags) {
  return System(f)->pMethods->xSync(System(f), flags);
}
int FileSize(sqlite3_file* f, sqlite3_int64* size) {
  return System(f)->pMethods->xFileSize(System(f), size);
}
int Lock(sqlite3_file* f, int level) {
  return System(f)->pMethods->xLock(System(f), level);
}
int Unlock(sqlite3_file* f, int level) {
  return System(f)->pMethods->xUnlock(System(f), level);
}
int CheckReservedLock(sqlite3_file* f, int* result) {
  return System(f)->pMethods->xCheckReservedLock(System(f), result);
}
int FileControl(sqlite3_file* f, int what, void* argument) {
  return System(f)->pMethods->xFileControl(System(f), what, argument);
}
int SectorSize(sqlite3_file* f) {
  return System(f)->pMethods->xSectorSize(System(f));
}
int DeviceCharacteristics(sqlite3_file* f) {
  return System(f)->pMethods->xDeviceCharacteristics(System(f));
}
int ShmMap(sqlite3_file* f, int page, int size, int extend, void volatile** to) {
  return System(f)->pMethods->xShmMap(System(f), page, size, extend, to);
}
int ShmLock(sqlite3_file* f, int offset, int count, int flags) {
  return System(f)->pMethods->xShmLock(System(f), offset, count, flags);
}
void ShmBarrier(sqlite3_file* f) {
  System(f)->pMethods->xShmBarrier(System(f));
}
int ShmUnmap(sqlite3_file* f, int remove) {
  return System(f)->pMethods->xShmUnmap(System(f), remove);
}

const sqlite3_io_methods kMethods = {2,
                                     Close,
                                     Read,
                                     Write,
                                     Truncate,
                                     Sync,
                                     FileSize,
                                     Lock,
                                     Unlock,
                                     CheckReservedLock,
                                     FileControl,
                                     SectorSize,
                                     DeviceCharacteristics,
                                     ShmMap,
                                     ShmLock,
                                     ShmBarrier,
                                     ShmUnmap,
                                     nullptr,
                                     nullptr};

int Open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  file->pMethods = nullptr;
  const int wanted =
      only_read ? (flags & ~(SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE)) | SQLITE_OPEN_READONLY : flags;
  System(file)->pMethods = nullptr;
  const int result = system_vfs->xOpen(system_vfs, name, System(file), wanted, out_flags);
  if (result == SQLITE_OK) file->pMethods = &kMethods;
  return result;
}

sqlite3_vfs failing_vfs;

}  // namespace

FailingDisk::FailingDisk() {
  system_vfs = sqlite3_vfs_find(nullptr);
  failing_vfs = *system_vfs;
  failing_vfs.zName = "failing-disk";
  failing_vfs.szOsFile = static_cast<int>(sizeof(File)) + system_vfs->szOsFile;
  failing_vfs.xOpen = Open;
  Repair();
  sqlite3_vfs_register(&failing_vfs, 1);
}

FailingDisk::~FailingDisk() {
  Repair();
  SetReadOnly(false);
  sqlite3_vfs_unregister(&failing_vfs);
  sqlite3_vfs_register(system_vfs, 1);
}

void FailingDisk::FailAfter(int writes) {
  writes_left = writes;
}
void FailingDisk::Repair() {
  writes_left = std::numeric_limits<int>::max();
}
void FailingDisk::SetReadOnly(bool read_only) {
  only_read = read_only;
}

}  // namespace docent::maps
