// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/program.h"

int main(int argc, char** argv) {
  return docent::app::RunProgram(argc, argv);
}
