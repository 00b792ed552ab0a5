// SPDX-License-Identifier: Apache-2.0
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "app/command_line/evaluate_sequence.h"
#include "app/command_line/interruption.h"
#include "app/command_line/progress.h"
#include "app/command_line/runs.h"
#include "app/evaluation/html_report.h"
#include "app/evaluation/json_report.h"
#include "app/files/checked_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

// Throws Error for a frame index beyond the sequence before it is run.
void CheckDumpFrames(const EvaluateOptions& options, const EvaluatedSequence& sequence) {
  if (!sequence.frame_count) return;
  for (const std::size_t number : options.dump_frames) {
    if (number < *sequence.frame_count) continue;
    throw Error("--dump-frame " + std::to_string(number) + ": '" + sequence.name + "' has " +
                std::to_string(*sequence.frame_count) + " frames, numbered from 0.");
  }
}

// Name of the sequence's folder below the output: without separators, and unique among `taken`.
std::string UniqueFolderName(std::string name, std::set<std::string>* taken) {
  for (char& c : name) {
    if (c == '/' || c == ':') c = '-';
  }
  if (name.empty() || name == "." || name == "..") name = "sequence";
  std::string unique = name;
  for (int number = 2; !taken->insert(unique).second; ++number) unique = name + "-" + std::to_string(number);
  return unique;
}

EvaluateOptions WithOtherEngine(EvaluateOptions options) {
  options.engine = options.engine == EngineKind::kHybrid ? EngineKind::kSixDof : EngineKind::kHybrid;
  return options;
}

void Print(const std::string& text, Verbosity verbosity) {
  if (verbosity == Verbosity::kQuiet) return;
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

void WarnOfCoverage(const std::string& name, int compared_frames, int tracked_frames) {
  const std::string warning = CoverageWarning(compared_frames, tracked_frames);
  if (!warning.empty()) {
    spdlog::warn("{}: {}; check the times of the ground truth and what it covers.", name, warning);
  }
}

EvaluatedRun Evaluate(const EvaluateOptions& options, const EvaluatedSequence& sequence,
                      const std::string& name, Verbosity verbosity) {
  EvaluatedRun run;
  const TrackRequest request{name, options.output / name, {.seed = options.seed}};
  run.run = Track(options, sequence, request, verbosity, &run.panoramas);
  run.truth = sequence.truth;
  run.segments = sequence.segments;
  run.report = EvaluateRun(run.run, run.truth, run.segments);
  Print(FormatSummary(run.report), verbosity);
  if (run.report.has_truth) WarnOfCoverage(name, run.report.compared_frames, run.report.tracked);
  return run;
}

// Runs one of many runs and keeps only its figures.
RunRow EvaluateOneOfMany(const EvaluateOptions& options, const EvaluatedSequence& sequence,
                         const std::string& name, const RunKey& key) {
  const std::string folder = "seed-" + std::to_string(key.seed) + "-start-" + std::to_string(key.start);
  const TrackRequest request{name, options.output / name / folder, key, true};
  const RunRecord run = Track(options, sequence, request, Verbosity::kQuiet, nullptr);
  std::optional<std::vector<InitializationResult>> starts =
      ClassifyInitializationsOf(options, sequence, key, run);
  return MakeRunRow(key, run, EvaluateRun(run, sequence.truth, sequence.segments), std::move(starts));
}

// Runs all seeds and starts, options.jobs at a time. The rows keep the order of RunsOf. After the first
// failure no further run is started; the rows are then those of the finished runs.
RunDistribution EvaluateMany(const EvaluateOptions& options, const EvaluatedSequence& sequence,
                             const std::string& name, Verbosity verbosity, std::exception_ptr* failure) {
  const std::vector<RunKey> keys = RunsOf(options, sequence);
  RunDistribution distribution{name,
                               ToString(options.engine),
                               options.seeds,
                               options.starts,
                               ToSeconds(options.window),
                               !sequence.truth.empty(),
                               {}};
  std::vector<std::optional<RunRow>> rows(keys.size());
  Progress progress(name + ", runs", keys.size(), verbosity);
  std::mutex mutex;  // Guards next, done and failure, and the output to the terminal.
  std::size_t next = 0, done = 0;
  const auto work = [&] {
    std::unique_lock lock(mutex);
    while (next < keys.size() && !*failure) {
      const std::size_t i = next++;
      lock.unlock();
      std::exception_ptr fault;
      try {
        rows[i] = EvaluateOneOfMany(options, sequence, name, keys[i]);
      } catch (...) {
        fault = std::current_exception();
      }
      lock.lock();
      if (fault) {
        if (!*failure) *failure = fault;
        continue;
      }
      progress.Update(++done);
      Print(FormatRunLine(*rows[i], distribution), verbosity);
    }
  };
  {
    std::vector<std::jthread> others;
    for (std::size_t i = 1; i < std::min(options.jobs, keys.size()); ++i) others.emplace_back(work);
    work();
  }
  for (std::optional<RunRow>& row : rows) {
    if (row) distribution.rows.push_back(std::move(*row));
  }
  if (!distribution.rows.empty()) Print("\n" + FormatTable(distribution), verbosity);
  if (distribution.has_truth) {
    int compared = 0, tracked = 0;
    for (const RunRow& row : distribution.rows) compared += row.compared_frames, tracked += row.tracked;
    WarnOfCoverage(name, compared, tracked);
  }
  return distribution;
}

void WriteReports(const std::filesystem::path& folder, const std::vector<EvaluatedRun>& runs) {
  std::vector<SequenceReport> reports, compared;
  for (const EvaluatedRun& run : runs) {
    reports.push_back(run.report);
    if (run.compared) compared.push_back(run.compared->report);
  }
  WriteJsonReport(folder / "report.json", reports, compared);
  WriteHtmlReport(folder / "report.html", runs);
}

void WriteReports(const std::filesystem::path& folder, const std::vector<RunDistribution>& distributions,
                  const std::vector<RunDistribution>& compared) {
  WriteJsonReport(folder / "report.json", distributions, compared);
  std::vector<RunDistribution> shown;
  for (std::size_t i = 0; i < distributions.size(); ++i) {
    shown.push_back(distributions[i]);
    if (i < compared.size()) shown.push_back(compared[i]);
  }
  WriteHtmlReport(folder / "report.html", shown);
}

}  // namespace

void RunEvaluate(const EvaluateOptions& options, Verbosity verbosity) {
  const Interruption interruption;
  std::vector<EvaluatedRun> runs;
  std::vector<RunDistribution> distributions, compared;
  std::set<std::string> taken;
  std::exception_ptr failure;
  const auto add_many = [&](const EvaluateOptions& many, const EvaluatedSequence& sequence,
                            const std::string& name, std::vector<RunDistribution>* all) {
    RunDistribution distribution = EvaluateMany(many, sequence, name, verbosity, &failure);
    if (!distribution.rows.empty()) all->push_back(std::move(distribution));
  };
  const EvaluateOptions other = WithOtherEngine(options);
  for (std::size_t i = 0; i < options.sequences.size() && !failure; ++i) {
    try {
      const EvaluatedSequence sequence = DescribeSequence(options, i);
      CheckDumpFrames(options, sequence);
      const std::string name = UniqueFolderName(sequence.name, &taken);
      CheckRunFolder(options, options.output / name);
      std::string other_name;
      if (options.compare) {
        other_name = UniqueFolderName(name + "-" + ToString(other.engine), &taken);
        CheckRunFolder(options, options.output / other_name);
      }
      MakeFolder(options.output);  // Only created when a sequence could be opened.
      if (options.many_runs()) {
        add_many(options, sequence, name, &distributions);
      } else {
        runs.push_back(Evaluate(options, sequence, name, verbosity));
      }
      if (!options.compare || failure) continue;
      if (options.many_runs()) {
        add_many(other, sequence, other_name, &compared);
      } else {
        runs.back().compared =
            std::make_shared<EvaluatedRun>(Evaluate(other, sequence, other_name, verbosity));
      }
    } catch (...) {
      // The runs that were finished are still reported.
      failure = std::current_exception();
    }
  }
  if (!runs.empty()) WriteReports(options.output, runs);
  if (!distributions.empty()) WriteReports(options.output, distributions, compared);
  if (failure) std::rethrow_exception(failure);
}

}  // namespace docent::app
