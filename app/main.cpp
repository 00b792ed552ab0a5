// SPDX-License-Identifier: Apache-2.0
#include <malloc.h>

#include <csignal>

#include "app/command_line/program.h"

int main(int argc, char** argv) {
  // A file that may grow no further is then a write that fails and is told, not the end of the program.
  std::signal(SIGXFSZ, SIG_IGN);
  // Images and published maps go back to the system when they are let go. Left to itself the allocator
  // learns from the first few to keep such blocks, and then holds twice of what is in use.
  mallopt(M_MMAP_THRESHOLD, 256 * 1024);
  return docent::app::RunProgram(argc, argv);
}
