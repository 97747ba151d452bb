// SPDX-License-Identifier: GPL-3.0-or-later
// The report: error against run time for every scene and form, as JSON and as CSV. script/report makes its page.
//
// Input: a folder with one folder for each scene, which contains `runs.json` and the images that it names:
//
//   {
//     "format": 1,
//     "scene": "as-fig2",                    the name of the folder
//     "description": "...",
//     "settings": {"width": 256, "height": 256, "max_bounces": 4},
//     "reference": {
//       "image": "reference.exr",            radiance, with its variance layer
//       "spp": 1024, "wall_seconds": 3.1
//     },
//     "runs": [                              one element per form; "glossy", "principled" and "metallic" are
//                                            Blender's own nodes
//       {
//         "form": "exact",                   unique within the scene
//         "images": ["exact-0.exr", ...],    equal numbers of samples, different seeds; their mean is shown
//         "spp": 64,                         samples per pixel of each image
//         "cpu_seconds": [1.9, ...],         one per image: rendering only, sum of all threads
//         "wall_seconds": [1.0, ...],        one per image
//         "materials": [                     may be empty (Blender's own nodes)
//           {"id": "ball", "model": "coupled", "representation": "exact", "closures": 3,
//            "error": {"relative_l1": 0.0, "albedo": 1e-7, "note": "..."}}     error: null = not measured
//         ]
//       }
//     ],
//     "convergence": [                       optional: the same scene, smaller, with increasing numbers of samples
//       {"form": "exact", "spp": 16, "images": ["convergence/exact-16-1.exr", ...], "cpu_seconds": [0.4, ...]}
//     ],
//     "provenance": {"Blender": "4.5.15", ...},   names and texts, shown at the end of the page
//     "commands": ["build/brdfc render ...", ...]
//   }
//
// An optional file flip.json beside it contains {"FORM": mean FLIP of its picture against the reference, ...}.
//
// CPU times of different forms are comparable if images with the same index were rendered in turns in one process. The
// cost of a form is its CPU time divided by that of "glossy", as the median over the images. If the images for
// "convergence" with one number of samples took longer, the cost is computed from those. If "glossy" took less than
// kShortestTime, there is no cost.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "reference/image.h"
#include "report/statistics.h"

namespace brdfc::report {

/// The name of the form that is Blender's own Glossy node.
inline constexpr const char* kNativeForm = "glossy";

/// CPU seconds. Shorter times are too uncertain, because they are differences of two renders.
inline constexpr double kShortestTime = 0.5;

struct MaterialForm {
  std::string id, model, representation;
  int closures = 0;
  std::optional<double> relative_l1, albedo_error;  ///< errors of the form, as measured when it was compiled
};

/// Noise and time of one picture with `spp` samples per pixel.
struct ConvergencePoint {
  int spp = 0;
  double noise = 0;                 ///< relMSE of a picture against its own expectation
  std::vector<double> cpu_seconds;  ///< of each picture
};

/// Numbers of samples of the Glossy node at which forms are compared at equal error.
inline constexpr int kEqualErrorAt[] = {16, 256, 1024};

struct FormReport {
  std::string form;
  std::vector<std::string> images;
  int spp = 0;  ///< samples per pixel of all images together
  std::vector<double> cpu_seconds, wall_seconds;
  std::vector<MaterialForm> materials;
  Difference difference;
  std::optional<WelchTest> test;              ///< several images against the reference
  std::optional<double> flip;                 ///< mean FLIP, if flip.json has it
  std::vector<ConvergencePoint> convergence;  ///< in order of increasing samples
  /// CPU time to reach the noise that Blender's Glossy node has with kEqualErrorAt samples, in units of the node's
  /// time.
  std::vector<std::optional<double>> equal_error;
  /// Equal-time comparison: the number of images that fit into the time of all images of Blender's Glossy node, their
  /// mean, and the difference from the reference. The number is 0 if the cost is not known.
  int equal_time_images = 0;
  reference::Rendering equal_time_picture;
  Difference equal_time;
  /// CPU time divided by that of Blender's Glossy node; nullopt if the node was not rendered, or in less than
  /// kShortestTime.
  std::optional<double> cost;
  reference::Rendering picture;  ///< mean of the images

  /// The largest over the materials; nullopt if there are none.
  std::optional<int> closures() const;
  std::optional<double> relative_l1() const;
};

struct SceneReport {
  std::string scene, description;
  int width = 0, height = 0, max_bounces = 0;
  std::string reference_image;
  int reference_spp = 0;
  double reference_seconds = 0;
  reference::Rendering reference;
  std::vector<FormReport> forms;
  std::map<std::string, std::string> provenance;
  std::vector<std::string> commands;
};

/// The folders under `folder` whose scene was not rendered: they have a scene.json and no runs.json.
std::vector<std::filesystem::path> not_rendered(const std::filesystem::path& folder);
/// Reads every scene under `folder` that was rendered, in alphabetical order. Throws InputError that names the file and
/// the key if something is missing or malformed, or if an image is not finite.
std::vector<SceneReport> load_report(const std::filesystem::path& folder);

/// Preview images. Names are relative to the report's folder.
struct Previews {
  struct Form {
    std::string picture, difference;
    std::string p_values;    ///< empty if there was no test
    std::string equal_time;  ///< empty if it is not known
  };
  std::string reference;
  std::vector<Form> forms;   ///< in the same order as the scene's forms
  double exposure = 1;       ///< factor before the sRGB curve, the same for all pictures of the scene
  double difference_at = 0;  ///< difference in radiance at the ends of the colour map
};

/// Writes the PNG files of one scene to folder/scene.
Previews write_previews(const std::filesystem::path& folder, const SceneReport&);

/// report.json: every measurement, what it means (verdict.h), and the names of the previews, which are in the order of
/// `scenes`. What it says is said nowhere else: the page states these facts and computes none.
std::string report_json(const std::vector<SceneReport>& scenes, const std::vector<Previews>& previews);
std::string report_csv(const std::vector<SceneReport>& scenes);

/// Writes report.json, report.csv and the previews. Throws as load_report(), and InputError if the folder can't be
/// written. Returns the measured scenes.
std::vector<SceneReport> write_report(const std::filesystem::path& folder);

}  // namespace brdfc::report
