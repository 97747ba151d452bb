// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>

#include "app/commands.h"
#include "app/numbers.h"
#include "app/scene_needs.h"
#include "core/process.h"
#include "core/text.h"
#include "pictures/pictures.h"
#include "reference/color.h"
#include "reference/image.h"
#include "reference/render.h"
#include "reference/scene.h"

namespace brdfc::app {

namespace {

std::atomic<bool> interrupted{false};

/// During its lifetime the first Ctrl-C asks the renderer to stop; the second one ends the program as usual.
class InterruptGuard {
 public:
  InterruptGuard() {
    interrupted = false;
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted = true; };
    action.sa_flags = SA_RESETHAND | SA_RESTART;
    sigaction(SIGINT, &action, &old_int_);
    sigaction(SIGTERM, &action, &old_term_);
  }
  ~InterruptGuard() {
    sigaction(SIGINT, &old_int_, nullptr);
    sigaction(SIGTERM, &old_term_, nullptr);
  }

 private:
  struct sigaction old_int_, old_term_;
};

std::string clock_text(double seconds) {
  const long s = std::lround(std::ceil(seconds));
  return s < 3600 ? fmt::format("{}:{:02}", s / 60, s % 60)
                  : fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

/// Progress messages: one line that is rewritten on a terminal; otherwise a line every ten seconds.
class ProgressLine {
 public:
  explicit ProgressLine(std::string name) : name_(std::move(name)), terminal_(is_terminal(Stream::Err)) {}
  void show(const reference::Progress& p) {
    if (!terminal_ && p.seconds < next_) return;
    next_ = p.seconds + 10;
    fmt::print(stderr, "{}{}: {:3.0f} %, {} of {} samples, {:.2f} Mpaths/s, {} left{}", terminal_ ? "\r\x1b[K" : "",
               name_, 100 * p.fraction, p.samples, p.spp, p.paths_per_second * 1e-6, clock_text(p.seconds_left),
               terminal_ ? "" : "\n");
    std::fflush(stderr);
    open_ = terminal_;
  }
  void close() {
    if (open_) fmt::print(stderr, "\n");
    open_ = false;
  }
  ~ProgressLine() { close(); }

 private:
  std::string name_;
  bool terminal_, open_ = false;
  double next_ = 10;
};

}  // namespace

void add_render_command(Command app) {
  struct Options {
    std::string scene, out, preview, view, strategy, pattern, from = "camera";
    int spp = 0, seed = -1, threads = 0, width = 0, height = 0;
    double max_seconds = 0, scale = 1, exposure = 0;
  };
  auto options = std::make_shared<Options>();
  const Command command = app.add_subcommand("render", "Renders the reference picture of a scene");
  command.add_option("SCENE", options->scene, "Scene file (.json)").required();
  command.add_option("--out", options->out, "EXR to write, with a variance layer; folders that are missing are made")
      .required();
  add_number(command, "--spp", options->spp, {1, 10000000}, "Samples per pixel (default: the scene's)");
  add_number(command, "--seed", options->seed, {0, 2147483647}, "Seed of the random numbers (default: the scene's)");
  add_number(command, "--threads", options->threads, {1, 1024},
             "Threads (default: all); the picture does not depend on it");
  add_number(command, "--max-seconds", options->max_seconds, {0.001, 1e7},
             "Stop after this time, with at least one sample per pixel");
  const Option width = add_number(command, "--width", options->width, {1, 16384}, "Pixels");
  const Option height = add_number(command, "--height", options->height, {1, 16384}, "Pixels");
  add_number(command, "--scale", options->scale, {0.001, 64}, "Factor on the scene's resolution")
      .excludes(width)
      .excludes(height);
  command
      .add_option("--strategy", options->strategy,
                  "Sample BRDF and lights (mis), or only one of them (default: the scene's)")
      .is_member(reference::strategy_names());
  command.add_option("--pattern", options->pattern, "Sampling pattern of a pixel (default: the scene's)")
      .is_member(reference::pattern_names());
  command
      .add_option("--from", options->from,
                  "Trace paths from the camera, or from the lamps. lamps-swapped assumes that models are reciprocal;\n"
                  "the picture then shows those that are not")
      .is_member({"camera", "lamps", "lamps-swapped"})
      .capture_default_str();
  const Option preview = command.add_option("--preview", options->preview, "Also write a PNG for display");
  command
      .add_option(
          "--view", options->view,
          "View transform of the preview, from the OpenColorIO configuration that the environment variable OCIO\n"
          "names, for example AgX in Blender's (default: Standard, or the display's default if there is none)")
      .needs(preview);
  add_number(command, "--exposure", options->exposure, {-64, 64}, "Exposure of the preview in stops").needs(preview);
  command.callback([options] {
    const std::filesystem::path out(options->out);
    if (out.extension() != ".exr") input_error("--out {}: expected a file name that ends in .exr", out.string());
    if (!options->preview.empty() && std::filesystem::path(options->preview).extension() != ".png")
      input_error("--preview {}: expected a file name that ends in .png", options->preview);
    if (!options->preview.empty() && !options->view.empty()) {
      const std::vector<std::string> views = reference::ColorConfig::current().views();
      if (std::find(views.begin(), views.end(), options->view) == views.end())
        input_error("--view {}: expected one of {}, the views of {}", options->view, join(views, ", "),
                    reference::ColorConfig::current().file().string());
    }
    const reference::Scene scene = load_scene(options->scene);
    print_notes(scene.notes);
    reference::RenderOptions r;
    r.settings = scene.settings;
    if (options->spp) r.settings.spp = options->spp;
    if (options->seed >= 0) r.settings.seed = options->seed;
    const auto scaled = [&](int n) { return int(std::clamp(std::lround(n * options->scale), 1L, 16384L)); };
    r.settings.width = options->width ? options->width : scaled(scene.settings.width);
    r.settings.height = options->height ? options->height : scaled(scene.settings.height);
    r.threads = options->threads;
    r.max_seconds = options->max_seconds;
    if (!options->strategy.empty()) r.settings.strategy = reference::strategy_named(options->strategy);
    if (!options->pattern.empty()) r.settings.pattern = reference::pattern_named(options->pattern);
    r.origin = options->from == "camera"  ? reference::Origin::Camera
               : options->from == "lamps" ? reference::Origin::Lamps
                                          : reference::Origin::LampsSwapped;
    if (r.origin != reference::Origin::Camera) {
      if (r.settings.pattern != reference::Pattern::Random)
        input_error("--from {}: expected the pattern random, not {}", options->from,
                    reference::pattern_names()[std::size_t(r.settings.pattern)]);
      if (r.settings.strategy != reference::Strategy::Mis)
        input_error("--from {}: expected the strategy mis, not {}", options->from,
                    reference::strategy_names()[std::size_t(r.settings.strategy)]);
    }
    pictures::require();
    ProgressLine line(scene.name);
    r.progress = [&](const reference::Progress& p) { line.show(p); };
    reference::RenderResult result;
    {
      const InterruptGuard guard;
      r.cancel = &interrupted;
      result = reference::render(scene, r);
    }
    line.close();
    result.rendering.metadata["strategy"] = reference::strategy_names()[std::size_t(r.settings.strategy)];
    result.rendering.metadata["from"] = options->from;
    result.rendering.metadata["pattern"] = reference::pattern_names()[std::size_t(r.settings.pattern)];
    reference::write_rendering(out, result.rendering);
    if (!options->preview.empty())
      reference::write_preview(options->preview, result.rendering, options->exposure, options->view);
    const std::string summary =
        fmt::format("{} has {} of {} samples a pixel", out.string(), result.samples, r.settings.spp);
    if (result.cancelled) throw CheckFailed("interrupted: " + summary);
    fmt::print(stderr, "{}: {}, {:.1f} s, {:.2f} Mpaths/s\n", scene.name, summary, result.seconds,
               result.paths_per_second * 1e-6);
  });
}

}  // namespace brdfc::app
