// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/film.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <thread>

namespace brdfc::reference {

void PixelMoments::write(std::size_t i, Image& mean, Image& variance) const {
  for (std::size_t c = 0; c < 3; ++c) {
    mean.rgb[3 * i + c] += float(channels_[c].mean);
    if (count_ > 1) variance.rgb[3 * i + c] += float(channels_[c].m2 / (double(count_) * (count_ - 1)));
  }
}

int threads_of(const RenderOptions& options) {
  return options.threads > 0 ? options.threads : int(std::max(1u, std::thread::hardware_concurrency()));
}

void in_arena(int threads, const std::function<void()>& f) {
  // By default TBB limits the number of threads to the number of cores.
  const tbb::global_control allow(
      tbb::global_control::max_allowed_parallelism,
      std::max(std::size_t(threads), tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)));
  tbb::task_arena(threads).execute(f);
}

nlohmann::json render_metadata(const Scene& scene, const RenderSettings& settings, int least, int most, int threads,
                               const RenderClock& clock) {
  return {{"scene", scene.name},     {"scene_hash", scene.hash},   {"seed", settings.seed},
          {"samples", least},        {"samples_max", most},        {"max_bounces", settings.max_bounces},
          {"threads", threads},      {"seconds", clock.seconds()}, {"seconds_tracing", clock.tracing()},
          {"version", BRDFC_VERSION}};
}

}  // namespace brdfc::reference
