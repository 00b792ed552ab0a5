// SPDX-License-Identifier: Apache-2.0
#pragma once

// Simulates a disk that is full from a given write on, or read-only, for every library that this process
// opens while the object exists. It wraps SQLite's interface to the operating system. One at a time.
namespace docent::maps {

class FailingDisk {
 public:
  FailingDisk();
  ~FailingDisk();
  FailingDisk(const FailingDisk&) = delete;
  FailingDisk& operator=(const FailingDisk&) = delete;

  // This many more writes succeed; later ones fail because the disk is full.
  void FailAfter(int writes);
  void Repair();
  // Files can then only be opened for reading.
  void SetReadOnly(bool read_only);
};

}  // namespace docent::maps
