// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <vector>

// Limits what a process can write, so that a weakness in a decoder of other people's files (models, images,
// videos, libraries) cannot be used to change the user's files. The kernel enforces it (Landlock, Linux 5.13
// and later, which Debian 12 has switched on).
namespace docent::app {

// The folder itself, or the nearest one that contains `path` and exists.
std::filesystem::path ExistingFolderOf(const std::filesystem::path& path);

// From now on, the calling thread, the threads that it starts later and the programs that they start can
// create, change and remove files only in these folders; reading is not limited. It cannot be undone. Folders
// that do not exist are left out. Returns false if the kernel does not offer this; nothing is limited then.
bool ConfineWritesTo(std::span<const std::filesystem::path> folders);

// The folders that programs with a window and sound write to, whatever they are for: devices, temporary
// files, the session's sockets, and caches.
std::vector<std::filesystem::path> SystemFolders();

}  // namespace docent::app
