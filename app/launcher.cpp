// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

// The `docent` of a package that brings two builds of the program, one for processors of the level x86-64-v3
// (AVX2) and one for all of x86-64: it runs the one that the processor can run, with the same arguments. It
// links no library but the C++ one, so that it costs no time. DOCENT_PROGRAMS is the folder of the builds,
// relative to the launcher's own.
namespace {

// Chosen by hand with DOCENT_PROCESSOR, for instance to compare the two.
const char* BuildForThisProcessor() {
  __builtin_cpu_init();
  const bool has_avx2 = __builtin_cpu_supports("x86-64-v3") != 0;
  const char* wanted =
      std::getenv("DOCENT_PROCESSOR");  // NOLINT(concurrency-mt-unsafe): there is one thread.
  return has_avx2 && !(wanted != nullptr && std::strcmp(wanted, "x86-64") == 0) ? "x86-64-v3" : "x86-64";
}

}  // namespace

int main(int, char** argv) {
  std::error_code error;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program =
      (own.parent_path() / DOCENT_PROGRAMS / BuildForThisProcessor() / "docent").string();
  if (!error) execv(program.c_str(), argv);
  std::fprintf(stderr, "docent: '%s' cannot be run: %s.\n", program.c_str(),
               std::strerror(errno));  // NOLINT(concurrency-mt-unsafe): there is one thread.
  return EXIT_FAILURE;
}
