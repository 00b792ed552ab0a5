// SPDX-License-Identifier: Apache-2.0
#include <malloc.h>

#include <csignal>

#include <opencv2/core/utility.hpp>

#include "app/command_line/program.h"

int main(int argc, char** argv) {
  // Exceeding the file size limit then makes the write fail with a reported error instead of ending the
  // program.
  std::signal(SIGXFSZ, SIG_IGN);
  // Trackers and mapper use the processors; OpenCV's own threads would only compete with them.
  cv::setNumThreads(1);
  // A fixed threshold returns images and published map snapshots to the system when they are freed. By
  // default glibc raises the threshold after the first such blocks are freed, and then keeps about twice the
  // memory that is in use. There is one thread here.
  mallopt(M_MMAP_THRESHOLD, 256 * 1024);  // NOLINT(concurrency-mt-unsafe)
  return docent::app::RunProgram(argc, argv);
}
