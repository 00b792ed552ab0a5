// SPDX-License-Identifier: Apache-2.0
#include <csignal>

#include "app/command_line/program.h"

int main(int argc, char** argv) {
  // A file that may grow no further is then a write that fails and is told, not the end of the program.
  std::signal(SIGXFSZ, SIG_IGN);
  return docent::app::RunProgram(argc, argv);
}
