// SPDX-License-Identifier: Apache-2.0
#pragma once

// A disk that is full from a chosen write on, or may only be read, for every library that this process opens
// while one exists: SQLite's own layer to the system, with a door before its writes. One at a time.
namespace docent::maps {

class FailingDisk {
 public:
  FailingDisk();
  ~FailingDisk();
  FailingDisk(const FailingDisk&) = delete;
  FailingDisk& operator=(const FailingDisk&) = delete;

  // This many more writes go well; all that follow find the disk full.
  void FailAfter(int writes);
  void Repair();
  // Files can be opened for reading alone.
  void SetReadOnly(bool read_only);
};

}  // namespace docent::maps
