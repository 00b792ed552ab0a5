// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/session/frame_loop.h"
#include "app/session/session.h"
#include "app/simulator/simulation.h"
#include "tests/bench/bench_sequence.h"

// The cost that a second camera adds to the first: two trackers and the mapper together, compared with each
// camera alone with the mapper. All run at the rate of real cameras with images in memory, one run after the
// other, so that a slow machine affects all three alike. Counters, for the hand-held camera (hand) and the
// one on the shoulder (shoulder):
//   *_alone_p95_ms, *_pair_p95_ms  wall time of tracking a frame, as in report.json
//   *_ratio                        the second divided by the first
//   *_cpu_ratio                    the same for the CPU time of the camera's thread, which does not include
//                                  waiting for a processor
//   *_pair_tracked                 ratio of the pair's frames, from the first with a pose on, that have one
//   dropped                        ratio of the pair's images that came too late
// DOCENT_BENCH_SECONDS shortens the walk of 24 s. --benchmark_repetitions gives medians. To be run on two
// processors (taskset) of an otherwise idle machine:
//
//   taskset -c 0,1 docent_bench --benchmark_filter=WearablePair --benchmark_repetitions=5
//       --benchmark_report_aggregates_only=true
namespace docent::bench {
namespace {

struct Film {
  std::string name;
  engine::CameraModel camera;
  double fps = 30;
  std::vector<engine::Frame> frames;
};

Film Shoot(const std::string& scene) {
  app::SimulationOptions options;
  if (const char* const seconds = std::getenv("DOCENT_BENCH_SECONDS"))
    options.duration_s = std::atof(seconds);
  const auto simulation = app::MakeSimulation(scene, options);
  Film film{scene, simulation->camera(), options.frame_rate_hz, {}};
  for (int i = 0; i < simulation->frame_count(); ++i) {
    engine::Frame& frame = film.frames.emplace_back();
    frame.index = static_cast<std::uint64_t>(i);
    frame.time = simulation->time(i);
    simulation->Render(i, &frame.image);
  }
  return film;
}

const std::vector<Film>& Films() {
  static const std::vector<Film> films = {Shoot("hand"), Shoot("shoulder")};
  return films;
}

class FilmSource : public app::FrameSource {
 public:
  explicit FilmSource(const Film* film) : film_(film) {
    info_.name = film->name;
    info_.nominal_fps = film->fps;
    info_.known_camera = film->camera;
  }
  bool Next(engine::Frame* frame) override {
    if (next_ == film_->frames.size()) return false;
    *frame = film_->frames[next_++];
    return true;
  }

 private:
  const Film* const film_;
  std::size_t next_ = 0;
};

// The frames of one camera in one run.
struct Measured {
  std::vector<double> wall_ms, cpu_ms;
  int dropped = 0, tracked = 0, since_first = 0;
};

std::vector<Measured> Run(const std::vector<const Film*>& films) {
  std::vector<app::CalibratedCamera> cameras;
  std::vector<std::shared_ptr<const engine::CameraModel>> models;
  for (const Film* film : films) {
    cameras.push_back(app::Calibrate(std::make_unique<FilmSource>(film), std::nullopt));
    models.push_back(cameras.back().model);
  }
  app::SessionOptions options;
  options.tracker.hybrid = true;
  options.first_map = "table";
  app::Session session(options, std::move(models), nullptr);
  std::vector<Measured> measured(films.size());
  std::vector<app::CameraRun> runs(films.size());
  for (std::size_t i = 0; i < films.size(); ++i) {
    runs[i].camera = &cameras[i];
    runs[i].options.camera = static_cast<int>(i);
    runs[i].options.pace = app::Pace::kRealtime;
    runs[i].shown = [camera = &measured[i],
                     before = std::optional<double>()](const engine::TrackedFrame& frame) mutable {
      const double now = ThreadMilliseconds();
      if (frame.state == engine::TrackingState::kDropped) {
        ++camera->dropped;
      } else {
        camera->wall_ms.push_back(1e3 * ToSeconds(frame.tracking_time));
        if (before) camera->cpu_ms.push_back(now - *before);
        camera->tracked += engine::HasPose(frame.state);
        camera->since_first += camera->tracked > 0;
      }
      before = ThreadMilliseconds();
    };
  }
  app::RunCameras(runs, &session, {});
  session.Finish();
  return measured;
}

void WearablePair(benchmark::State& state) {
  const std::vector<Film>& films = Films();
  for (auto _ : state) {
    auto& counters = state.counters;
    std::vector<std::vector<Measured>> alone;
    alone.push_back(Run({&films[0]}));
    std::vector<Measured> pair = Run({&films[0], &films[1]});
    alone.push_back(Run({&films[1]}));
    double dropped = 0, images = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      Measured& one = alone[i].front();
      const double alone_ms = Quantile(&one.wall_ms, 0.95), pair_ms = Quantile(&pair[i].wall_ms, 0.95);
      const std::string& name = films[i].name;
      counters[name + "_alone_p50_ms"] = Quantile(&one.wall_ms, 0.5);
      counters[name + "_pair_p50_ms"] = Quantile(&pair[i].wall_ms, 0.5);
      counters[name + "_alone_p95_ms"] = alone_ms;
      counters[name + "_pair_p95_ms"] = pair_ms;
      counters[name + "_ratio"] = pair_ms / alone_ms;
      counters[name + "_cpu_ratio"] = Quantile(&pair[i].cpu_ms, 0.95) / Quantile(&one.cpu_ms, 0.95);
      counters[name + "_pair_tracked"] = static_cast<double>(pair[i].tracked) / pair[i].since_first;
      dropped += pair[i].dropped;
      images += static_cast<double>(pair[i].wall_ms.size()) + pair[i].dropped;
    }
    counters["dropped"] = dropped / images;
  }
}

BENCHMARK(WearablePair)->Iterations(1)->UseRealTime()->Unit(benchmark::kSecond);

}  // namespace
}  // namespace docent::bench
