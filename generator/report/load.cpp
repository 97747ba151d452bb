// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "reference/image.h"
#include "reference/json_view.h"
#include "report/report.h"

namespace brdfc::report {
namespace {

using reference::JsonView;
using reference::Rendering;

namespace fs = std::filesystem;

constexpr double kMost = 1e12;  // limit of seconds, samples and errors: larger figures are mistakes
constexpr int kMostCount = 1'000'000'000;

Rendering read_picture(const fs::path& folder, const JsonView& name) {
  const fs::path file = folder / name.text();
  if (!fs::exists(file)) name.fail("the name of an image in " + folder.string());
  return reference::read_rendering(file);
}

std::vector<double> read_times(const JsonView& view, std::size_t count) {
  std::vector<double> out;
  for (const JsonView& element : view.elements()) out.push_back(element.number(0, kMost));
  if (out.size() != count) view.fail(fmt::format("{} numbers, one an image", count));
  return out;
}

/// Reads an error; null means not measured.
std::optional<double> read_error(const JsonView& view) {
  return view.json().is_null() ? std::nullopt : std::optional(view.number(0, kMost));
}

MaterialForm read_material(const JsonView& view) {
  MaterialForm m;
  m.id = view.at("id").text();
  m.model = view.at("model").text();
  m.representation = view.at("representation").text();
  m.closures = view.at("closures").integer(0, kMostCount);
  const JsonView error = view.at("error");
  if (!error.json().is_null()) {
    m.relative_l1 = read_error(error.at("relative_l1"));
    m.albedo_error = read_error(error.at("albedo"));
  }
  return m;
}

/// A form and its images, which are needed until the costs are known.
struct FormImages {
  FormReport form;
  std::vector<Rendering> pictures;
};

FormImages read_form(const fs::path& folder, const JsonView& view, const SceneReport& scene) {
  FormReport form;
  form.form = view.at("form").text();
  // The name becomes part of file names.
  if (form.form == "reference" || form.form.find_first_of("/\\") != std::string::npos)
    view.at("form").fail("a name without slashes other than \"reference\"");
  const JsonView images = view.at("images");
  std::vector<Rendering> pictures;
  for (const JsonView& image : images.elements()) {
    form.images.push_back(image.text());
    pictures.push_back(read_picture(folder, image));
    reference::to_working_space_of(pictures.back(), scene.reference);
    const reference::Image& mean = pictures.back().mean;
    if (mean.width != scene.width || mean.height != scene.height)
      image.error(fmt::format("expected an image of {} x {} pixels, this one has {} x {}", scene.width, scene.height,
                              mean.width, mean.height));
  }
  if (pictures.empty()) images.fail("at least one image");
  form.spp = view.at("spp").integer(1, kMostCount / int(pictures.size())) * int(pictures.size());
  form.cpu_seconds = read_times(view.at("cpu_seconds"), pictures.size());
  form.wall_seconds = read_times(view.at("wall_seconds"), pictures.size());
  for (const JsonView& material : view.at("materials").elements()) form.materials.push_back(read_material(material));
  form.picture = mean_of(pictures);
  if (pictures.size() > 1)
    form.test = welch_test(pictures, scene.reference, (folder / form.images.front()).string(),
                           (folder / scene.reference_image).string());
  form.difference = measure_difference(form.picture, scene.reference, (folder / form.images.front()).string(),
                                       (folder / scene.reference_image).string());
  return {std::move(form), std::move(pictures)};
}

/// Computes the difference at equal render time. For a form that costs more than the Glossy node, fewer images fit into
/// the Glossy node's time. A cheaper form has no more images than were rendered.
void set_equal_time(FormReport& form, const std::vector<Rendering>& pictures, const SceneReport& scene) {
  if (!form.cost || !(*form.cost > 0)) return;
  const double count = double(pictures.size());
  form.equal_time_images = int(std::clamp(std::round(count / *form.cost), 1.0, count));
  form.equal_time_picture = mean_of({pictures.data(), std::size_t(form.equal_time_images)});
  form.equal_time =
      measure_difference(form.equal_time_picture, scene.reference, form.images.front(), scene.reference_image);
}

/// Render times of a form's pictures. With convergence_spp, those of the convergence pictures with that many samples;
/// empty if there are none.
std::vector<double> times_of(const FormReport& form, std::optional<int> convergence_spp) {
  if (!convergence_spp) return form.cpu_seconds;
  for (const ConvergencePoint& p : form.convergence)
    if (p.spp == *convergence_spp) return p.cpu_seconds;
  return {};
}

/// Computes the costs from the pictures that took longest. Times are paired by index, because a slowdown of the machine
/// affects both pictures of a pair.
void set_costs(std::vector<FormReport>& forms) {
  const auto glossy =
      std::find_if(forms.begin(), forms.end(), [](const FormReport& f) { return f.form == kNativeForm; });
  if (glossy == forms.end()) return;
  std::optional<int> longest;
  for (const ConvergencePoint& p : glossy->convergence)
    if (median(p.cpu_seconds) > median(times_of(*glossy, longest))) longest = p.spp;
  const std::vector<double> unit = times_of(*glossy, longest);
  if (median(unit) < kShortestTime) return;
  for (FormReport& form : forms) {
    const std::vector<double> times = times_of(form, longest);
    std::vector<double> ratios;
    for (std::size_t i = 0; i < std::min(unit.size(), times.size()); ++i)
      if (unit[i] > 0) ratios.push_back(times[i] / unit[i]);
    if (!ratios.empty()) form.cost = median(ratios);
  }
}

ConvergencePoint read_convergence(const fs::path& folder, const JsonView& view, const SceneReport& scene) {
  ConvergencePoint point;
  point.spp = view.at("spp").integer(1, kMostCount);
  const JsonView images = view.at("images");
  std::vector<Rendering> pictures;
  for (const JsonView& image : images.elements()) {
    pictures.push_back(read_picture(folder, image));
    reference::to_working_space_of(pictures.back(), scene.reference);
    if (pictures.back().mean.width != pictures.front().mean.width ||
        pictures.back().mean.height != pictures.front().mean.height)
      image.fail("an image of the size of the others");
  }
  if (pictures.size() < 2) images.fail("at least two images");
  const Rendering mean = mean_of(pictures);
  for (std::size_t i = 0; i < mean.mean.rgb.size(); ++i)
    // The variance is that of the mean of n images; that of a single image is n times larger.
    point.noise += double(mean.variance->rgb[i]) * double(pictures.size()) /
                   (sqr(double(mean.mean.rgb[i])) + kRelMseEpsilon) / double(mean.mean.rgb.size());
  if (!std::isfinite(point.noise)) images.fail("images of finite numbers");
  point.cpu_seconds = read_times(view.at("cpu_seconds"), pictures.size());
  return point;
}

/// The number of samples per pixel for a given noise, by linear interpolation between the points of a log-log plot.
/// Beyond the points noise is assumed to be inversely proportional to the number of samples.
std::optional<double> samples_for(const std::vector<ConvergencePoint>& points, double noise) {
  if (points.size() < 2 || !(noise > 0)) return std::nullopt;
  for (const ConvergencePoint& p : points)
    if (!(p.noise > 0)) return std::nullopt;
  const auto as_of_a_mean = [&](const ConvergencePoint& p) { return p.spp * p.noise / noise; };
  if (noise >= points.front().noise) return as_of_a_mean(points.front());
  if (noise <= points.back().noise) return as_of_a_mean(points.back());
  std::size_t i = 1;
  while (i + 1 < points.size() && points[i].noise > noise) ++i;
  const double x0 = std::log(points[i - 1].spp), x1 = std::log(points[i].spp);
  const double y0 = std::log(points[i - 1].noise), y1 = std::log(points[i].noise);
  if (!(y1 < y0)) return std::nullopt;
  return std::exp(x0 + (std::log(noise) - y0) / (y1 - y0) * (x1 - x0));
}

void set_equal_error(std::vector<FormReport>& forms) {
  const auto glossy =
      std::find_if(forms.begin(), forms.end(), [](const FormReport& f) { return f.form == kNativeForm; });
  if (glossy == forms.end()) return;
  const std::vector<ConvergencePoint> unit = glossy->convergence;
  const auto seconds_a_sample = [](const ConvergencePoint& p) { return median(p.cpu_seconds) / p.spp; };
  for (FormReport& form : forms) {
    if (form.convergence.empty()) continue;
    for (const int spp : kEqualErrorAt) {
      form.equal_error.emplace_back();
      const auto at = std::find_if(unit.begin(), unit.end(), [&](const ConvergencePoint& p) { return p.spp == spp; });
      if (at == unit.end() || !(median(at->cpu_seconds) > 0)) continue;
      // The time per sample is measured best with the largest number of samples.
      if (const auto needed = samples_for(form.convergence, at->noise))
        form.equal_error.back() =
            *needed * seconds_a_sample(form.convergence.back()) / (spp * seconds_a_sample(unit.back()));
    }
  }
}

void read_flip(const fs::path& file, std::vector<FormReport>& forms) {
  if (!fs::exists(file)) return;
  const nlohmann::json content = reference::read_json(file);
  const JsonView top(content, file.string());
  for (FormReport& form : forms)
    if (const auto v = top.find(form.form)) form.flip = v->number(0, 1);
}

SceneReport load_scene(const fs::path& folder) {
  const fs::path file = folder / "runs.json";
  if (!fs::exists(file)) input_error("{}: missing, although {} holds a scene", file.string(), folder.string());
  const nlohmann::json content = reference::read_json(file);
  const JsonView top(content, file.string());
  top.at("format").integer(1, 1);

  SceneReport scene;
  scene.scene = top.at("scene").choice({folder.filename().string()});
  scene.description = top.at("description").text();
  const JsonView settings = top.at("settings");
  scene.width = settings.at("width").integer(1, kMostCount);
  scene.height = settings.at("height").integer(1, kMostCount);
  scene.max_bounces = settings.at("max_bounces").integer(0, kMostCount);
  const JsonView reference = top.at("reference");
  scene.reference_image = reference.at("image").text();
  scene.reference_spp = reference.at("spp").integer(1, kMostCount);
  scene.reference_seconds = reference.at("wall_seconds").number(0, kMost);
  scene.reference = read_picture(folder, reference.at("image"));
  if (scene.reference.mean.width != scene.width || scene.reference.mean.height != scene.height)
    reference.at("image").error(fmt::format("expected an image of {} x {} pixels, this one has {} x {}", scene.width,
                                            scene.height, scene.reference.mean.width, scene.reference.mean.height));
  if (!scene.reference.variance) reference.at("image").error("expected an image with a variance layer");

  std::set<std::string> seen;
  const JsonView runs = top.at("runs");
  std::vector<std::vector<Rendering>> pictures;
  for (const JsonView& run : runs.elements()) {
    FormImages read = read_form(folder, run, scene);
    scene.forms.push_back(std::move(read.form));
    pictures.push_back(std::move(read.pictures));
    if (!seen.insert(scene.forms.back().form).second) run.at("form").fail("each form once");
  }
  if (scene.forms.empty()) runs.fail("at least one form");
  if (const auto convergence = top.find("convergence")) {
    for (const JsonView& point : convergence->elements()) {
      const std::string name = point.at("form").text();
      const auto form =
          std::find_if(scene.forms.begin(), scene.forms.end(), [&](const FormReport& f) { return f.form == name; });
      if (form == scene.forms.end()) point.at("form").fail("the name of a form among the runs");
      form->convergence.push_back(read_convergence(folder, point, scene));
    }
    for (FormReport& form : scene.forms) {
      std::sort(form.convergence.begin(), form.convergence.end(),
                [](const ConvergencePoint& a, const ConvergencePoint& b) { return a.spp < b.spp; });
      for (std::size_t i = 1; i < form.convergence.size(); ++i)
        if (form.convergence[i].spp == form.convergence[i - 1].spp) convergence->fail("each number of samples once");
    }
    set_equal_error(scene.forms);
  }
  set_costs(scene.forms);
  for (std::size_t i = 0; i < scene.forms.size(); ++i) set_equal_time(scene.forms[i], pictures[i], scene);
  read_flip(folder / "flip.json", scene.forms);
  for (const auto& [name, value] : top.at("provenance").members()) scene.provenance[name] = value.text();
  for (const JsonView& command : top.at("commands").elements()) scene.commands.push_back(command.text());
  return scene;
}

}  // namespace

std::optional<int> FormReport::closures() const {
  std::optional<int> most;
  for (const MaterialForm& m : materials) most = std::max(most.value_or(0), m.closures);
  return most;
}

std::optional<double> FormReport::relative_l1() const {
  std::optional<double> worst;
  for (const MaterialForm& m : materials)
    if (m.relative_l1) worst = std::max(worst.value_or(0), *m.relative_l1);
  return worst;
}

std::vector<fs::path> not_rendered(const fs::path& folder) {
  std::vector<fs::path> out;
  if (!fs::is_directory(folder)) return out;
  for (const auto& entry : fs::directory_iterator(folder))
    if (fs::exists(entry.path() / "scene.json") && !fs::exists(entry.path() / "runs.json")) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<SceneReport> load_report(const fs::path& folder) {
  if (!fs::is_directory(folder)) input_error("{}: not a folder", folder.string());
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder))
    if (fs::exists(entry.path() / "runs.json")) folders.push_back(entry.path());
  if (folders.empty()) input_error("{}: no folder in it holds a runs.json", folder.string());
  std::sort(folders.begin(), folders.end());
  std::vector<SceneReport> scenes;
  for (const fs::path& scene : folders) scenes.push_back(load_scene(scene));
  return scenes;
}

}  // namespace brdfc::report
