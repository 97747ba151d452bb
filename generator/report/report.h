// SPDX-License-Identifier: GPL-3.0-or-later
// Error against run time for every scene and form: a page to look at, JSON and CSV to compute with.
//
// Input: a folder with one folder a scene, each holding `runs.json` and the images it names:
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
//     "runs": [                              one element a form; "glossy", "principled", "metallic" are Blender's own
//     nodes
//       {
//         "form": "exact",                   unique within the scene
//         "images": ["exact-0.exr", ...],    equal samples, different seeds; their mean is shown
//         "spp": 64,                         samples a pixel of each image
//         "cpu_seconds": [1.9, ...],         one an image: rendering alone, all threads together
//         "wall_seconds": [1.0, ...],        one an image
//         "materials": [                     may be empty (Blender's own nodes)
//           {"id": "ball", "model": "coupled", "representation": "exact", "closures": 3,
//            "error": {"relative_l1": 0.0, "albedo": 1e-7, "note": "..."}}     error: null = not measured
//         ]
//       }
//     ],
//     "convergence": [                       optional: the same scene, smaller, with more and more samples
//       {"form": "exact", "spp": 16, "images": ["convergence/exact-16-1.exr", ...], "cpu_seconds": [0.4, ...]}
//     ],
//     "provenance": {"Blender": "4.5.15", ...},   text by name, shown at the end of the page
//     "commands": ["build/brdfc render ...", ...]
//   }
//
// A file flip.json beside it, if there is one, holds {"FORM": mean FLIP of its picture against the reference, ...}.
//
// A file links.json in the folder itself, if there is one, holds {"TEXT": "../demo-5.0/index.html", ...}: pages of the
// same scenes in other versions of Blender, which the page links on its top.
//
// CPU times of different forms are comparable when images with the same index were rendered in turns in one
// process; the cost of a form is the median over the images of its time divided by the time of "glossy": of the images
// for "convergence" with one number of samples where those took longer, and of none where "glossy" took less than
// kShortestTime.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "reference/image.h"
#include "report/statistics.h"

namespace brdfc::report {

/// The form that is Blender's own Glossy node.
inline constexpr const char* kNativeForm = "glossy";

/// CPU seconds. Of shorter times, differences of two renders, a good part is chance.
inline constexpr double kShortestTime = 0.5;

struct MaterialForm {
  std::string id, model, representation;
  int closures = 0;
  std::optional<double> relative_l1, albedo_error;  ///< of the form, as measured when it was compiled
};

/// Noise of one picture with so many samples a pixel, and what it cost.
struct ConvergencePoint {
  int spp = 0;
  double noise = 0;                 ///< relMSE of one picture against its own expectation
  std::vector<double> cpu_seconds;  ///< of each picture
};

/// Samples a pixel at which forms are compared at equal error.
inline constexpr int kEqualErrorAt[] = {16, 256, 1024};

struct FormReport {
  std::string form;
  std::vector<std::string> images;
  int spp = 0;  ///< of all images together
  std::vector<double> cpu_seconds, wall_seconds;
  std::vector<MaterialForm> materials;
  Difference difference;
  std::optional<WelchTest> test;              ///< of several images against the reference
  std::optional<double> flip;                 ///< mean FLIP, if flip.json has it
  std::vector<ConvergencePoint> convergence;  ///< by increasing samples
  /// CPU time to the noise that Blender's Glossy node has with kEqualErrorAt samples, in units of the time that takes.
  std::vector<std::optional<double>> equal_error;
  /// What the time that Blender's Glossy node takes for all its images is enough for: this many of them, their mean
  /// and its difference from the reference. 0 if the cost is not known.
  int equal_time_images = 0;
  reference::Rendering equal_time_picture;
  Difference equal_time;
  /// CPU time / CPU time of Blender's Glossy node; nothing if that was not rendered, or in less than kShortestTime.
  std::optional<double> cost;
  reference::Rendering picture;  ///< mean of the images

  /// Largest over the materials; nothing if there is none.
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

/// Reads every scene under `folder`, in alphabetical order. Throws InputError naming the file and the key where
/// something is missing, malformed or, in an image, not finite.
std::vector<SceneReport> load_report(const std::filesystem::path& folder);

/// What the closure conformance tests measured of one closure.
struct ConformanceRow {
  std::string closure;
  std::string verdict;                  ///< ok, fault, or mended: a known fault that is gone
  std::optional<double> evaluation_l1;  ///< of its evaluation against our definition; none for deltas
  double sampling_share = 0;            ///< light found by its own sampling against its evaluation, -1; 0 within noise
  double sampling_resolution = 0;       ///< the smallest share that would have been noticed
  std::string fault;                    ///< in words
};
struct ConformanceTable {
  std::string blender;  ///< version
  std::vector<ConformanceRow> rows;
};

/// The tables that tests/blender/test_conformance.py writes, VERSION.json each; none without such a folder. Throws
/// InputError naming file and key.
std::vector<ConformanceTable> load_conformance(const std::filesystem::path& folder);
/// Appends the page's section about closures, nothing without tables.
void put_conformance(std::string& page, const std::vector<ConformanceTable>&);

/// Previews made for the page; names are relative to the report's folder.
struct Previews {
  struct Form {
    std::string picture, difference;
    std::string p_values;    ///< empty if there was no test
    std::string equal_time;  ///< empty if that is not known
  };
  std::string reference;
  std::vector<Form> forms;   ///< in the order of the scene's forms
  double exposure = 1;       ///< factor before the sRGB curve, common to all pictures of the scene
  double difference_at = 0;  ///< radiance difference at the ends of the colour map
};

/// Writes the PNG files of one scene into folder/scene.
Previews write_previews(const std::filesystem::path& folder, const SceneReport&);

/// Addresses of other pages by what they are called; none without links.json in the folder. Throws InputError naming
/// file and key.
std::map<std::string, std::string> load_links(const std::filesystem::path& folder);

/// The page's text; `previews` in the order of `scenes`.
std::string report_html(const std::vector<SceneReport>& scenes, const std::vector<Previews>& previews,
                        const std::vector<ConformanceTable>& closures, const std::map<std::string, std::string>& links);
std::string report_json(const std::vector<SceneReport>& scenes);
std::string report_csv(const std::vector<SceneReport>& scenes);

/// Writes index.html, report.json, report.csv and the previews; what the conformance tests found is taken from the
/// folder `conformance` beside this one, if there is one. Throws as load_report, and InputError when the
/// folder can't be written. Returns what it measured.
std::vector<SceneReport> write_report(const std::filesystem::path& folder);

}  // namespace brdfc::report
