// SPDX-License-Identifier: Apache-2.0
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/command_line/program.h"
#include "app/files/checked_file.h"
#include "app/visits/visit_log.h"
#include "app/visits/visit_report.h"

namespace docent::app {

namespace {

struct ReportOptions {
  std::filesystem::path folder, output;
};

// Also of "visits/", "." and "..", which have no name of their own.
std::string NameOfFolder(const std::filesystem::path& folder) {
  return std::filesystem::absolute(folder / "").lexically_normal().parent_path().filename().string();
}

void Report(const ReportOptions& options, Verbosity verbosity) {
  std::vector<std::string> problems;
  const std::vector<VisitRecord> visits = ReadVisits(options.folder, &problems);
  for (const std::string& problem : problems) spdlog::warn("{}", problem);
  CheckedFile file(options.output);
  file.Write(FormatVisitReport(visits, "Visits in " + NameOfFolder(options.folder)));
  file.Close();
  if (verbosity == Verbosity::kQuiet) return;
  std::printf("%zu %s; the report is in %s\n", visits.size(), visits.size() == 1 ? "visit" : "visits",
              options.output.string().c_str());
}

}  // namespace

void AddReportCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* command =
      AddSubcommand(program, "report", "Report on visits: how many, how long, and where visitors are lost",
                    "docent report visits --output report.html");
  const auto options = std::make_shared<ReportOptions>();
  command->add_option("FOLDER", options->folder, "The folder that docent tour --log writes to")->required();
  command->add_option("--output", options->output, "The page to write")->required()->type_name("FILE.html");
  command->callback([=] { invocation->run = [=] { Report(*options, invocation->verbosity); }; });
}

}  // namespace docent::app
