// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "report/charts.h"
#include "report/html.h"
#include "report/naming.h"
#include "report/page_style.h"
#include "report/report.h"

namespace brdfc::report {
namespace {

std::string cost(const FormReport& f) { return or_dash(f.cost, fmt::format("{:.2f}", f.cost.value_or(0))); }

/// True if the bias exceeds three standard deviations; noise alone does that once in 370 cases.
bool biased(const Difference& d) { return std::abs(d.bias) > 3 * d.bias_error && std::abs(d.bias) > 1e-5; }

std::string bias(const Difference& d) {
  return fmt::format("{} % \xc2\xb1 {:.3f}", with_minus(fmt::format("{:+.3f}", 100 * d.bias)), 100 * d.bias_error);
}

std::string models_of(const FormReport& f) {
  std::string out;
  for (const MaterialForm& m : f.materials) {
    const std::string text = m.model + " (" + m.representation + ")";
    if (out.find(text) == std::string::npos) out += (out.empty() ? "" : ", ") + text;
  }
  return out;
}

std::string accepted(const FormReport& f) {
  if (!f.test) return kDash;
  const std::string tiles =
      f.test->rejected_tiles ? fmt::format(", {}/{} tiles off", f.test->rejected_tiles, f.test->tiles) : std::string();
  return fmt::format("{:.2f} %{}", 100 * f.test->accepted(), tiles);
}

std::string equal_error(const FormReport& f) {
  std::string out;
  for (const std::optional<double>& v : f.equal_error)
    out += (out.empty() ? "" : " \xc2\xb7 ") + or_dash(v, fmt::format("{:.2f}", v.value_or(0)));
  return out.empty() ? kDash : out;
}

/// The form that materials have by default: the main subject of a report about one scene.
const FormReport* by_default(const SceneReport& s) {
  for (const char* name : {"auto", "exact", "aimed"})
    for (const FormReport& f : s.forms)
      if (f.form == name) return &f;
  return nullptr;
}

/// True if the picture differs from the reference by more than noise.
bool differs(const FormReport& f) { return f.test ? !f.test->passed() : biased(f.difference); }

std::string count(std::size_t n, const char* one, const char* many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

/// The result in three sentences: whether the pictures are right, what the forms cost, and which is worst.
void put_verdict(std::string& out, const std::vector<SceneReport>& scenes) {
  std::size_t judged = 0, same = 0;
  std::vector<double> costs;
  const SceneReport* worst_scene = nullptr;
  const FormReport* worst = nullptr;
  for (const SceneReport& s : scenes) {
    if (const FormReport* f = by_default(s)) {
      ++judged;
      same += !differs(*f);
      if (f->cost) costs.push_back(*f->cost);
    }
    for (const FormReport& f : s.forms)
      if (!is_native(f) && biased(f.difference) &&
          (!worst || std::abs(f.difference.bias) > std::abs(worst->difference.bias)))
        worst_scene = &s, worst = &f;
  }
  out += "<p class=\"verdict\">";
  if (judged > 0)
    put(out, "In {} of {}, the default form of the materials differs from the models themselves only by noise. ", same,
        count(judged, "scene", "scenes"));
  if (!costs.empty()) {
    std::sort(costs.begin(), costs.end());
    put(out, "It takes {:.2f} times the CPU time of Blender's own Glossy node", costs[costs.size() / 2]);
    if (costs.size() > 1)
      put(out, " in the median over the scenes, and from {:.2f} to {:.2f} in single scenes", costs.front(),
          costs.back());
    out += ". ";
  }
  if (worst)
    put(out, "The largest bias is that of {} in <a href=\"#{}\">{}</a>: its total light is {} of the correct value.",
        escaped(label(*worst)), escaped(worst_scene->scene), escaped(worst_scene->scene),
        fmt::format("{:.2f} % \xc2\xb1 {:.2f}", 100 * (1 + worst->difference.bias),
                    100 * worst->difference.bias_error));
  else
    out += "In every scene and form, the total light is correct within the noise.";
  out += "</p>\n";
}

/// A table with a row per scene and a column per form: the error, whether it is only noise, and the time.
void put_summary(std::string& out, const std::vector<SceneReport>& scenes) {
  const std::vector<std::string> forms = all_forms(scenes);
  out += "<table class=\"summary\"><thead><tr><th class=\"left\">Scene</th>";
  for (const std::string& name : forms) {
    FormReport f;
    f.form = name;
    put(out, "<th>{}</th>", escaped(label(f)));
  }
  out += "</tr></thead><tbody>\n";
  for (const SceneReport& s : scenes) {
    put(out, "<tr {}><td class=\"left\"><a href=\"#{}\">{}</a></td>", marked(s), escaped(s.scene), escaped(s.scene));
    for (const std::string& name : forms) {
      const auto f = std::ranges::find(s.forms, name, &FormReport::form);
      if (f == s.forms.end()) {
        put(out, "<td class=\"soft\">{}</td>", kDash);
        continue;
      }
      const bool off = !is_native(*f) && differs(*f);
      put(out, "<td{} title=\"{}\"><b>{}</b><br>{}<br><span class=\"soft\">{}</span></td>", off ? " class=\"bad\"" : "",
          escaped(models_of(*f)), scientific(f->difference.rel_mse),
          is_native(*f) ? ""
          : off         ? "differs"
                        : "noise alone",
          or_dash(f->cost, cost(*f) + "\xc3\x97" + (on_front(s, *f) ? " \xe2\x97\x86" : "")));
    }
    out += "</tr>\n";
  }
  out +=
      "</tbody></table>\n<p class=\"soft\">In each cell: relMSE, whether it is more than noise, and CPU time in units "
      "of "
      "the Glossy node; \xe2\x97\x86 no other form of the scene has both a smaller error and a shorter time.</p>\n";
}

/// All figures of one scene.
void put_figures(std::string& out, const SceneReport& s) {
  out += R"(<details><summary>All figures</summary><div class="wide"><table>
<thead><tr><th class="left">Form</th><th>relMSE</th><th>noise<br>in it</th><th>Mean, against<br>the reference</th>
<th>Pixels<br>accepted</th><th>FLIP</th><th>CPU time /<br>Glossy</th><th>Samples<br>per pixel</th><th>Closures</th>
<th>Form's own<br>error (L1)</th><th>CPU time to<br>equal error</th></tr></thead><tbody>
)";
  for (const FormReport& f : s.forms) {
    put(out, "<tr{}><td class=\"left\">{}</td><td>{}</td><td>{}</td><td{}>{}</td>",
        is_native(f) ? " class=\"native\"" : "", escaped(label(f)), scientific(f.difference.rel_mse),
        scientific(f.difference.noise), biased(f.difference) ? " class=\"bad\"" : "", bias(f.difference));
    put(out, "<td{}>{}</td><td>{}</td>", f.test && !f.test->passed() ? " class=\"bad\"" : "", accepted(f),
        or_dash(f.flip, fmt::format("{:.4f}", f.flip.value_or(0))));
    put(out, "<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", cost(f), f.spp,
        or_dash(f.closures(), fmt::format("{}", f.closures().value_or(0))),
        or_dash(f.relative_l1(), scientific(f.relative_l1().value_or(0))), equal_error(f));
  }
  out += "</tbody></table></div></details>\n";
}

/// A menu of models; a selection shows only that model's scenes. Without JavaScript all scenes are shown.
void put_filter(std::string& out, const std::vector<SceneReport>& scenes) {
  std::set<std::string> models;
  for (const SceneReport& s : scenes) models.merge(models_of(s));
  if (models.size() < 2 || scenes.size() < 2) return;
  out += "<p><label>Scenes with <select id=\"model\"><option value=\"\">any model</option>";
  for (const std::string& m : models) put(out, "<option>{}</option>", escaped(m));
  out += "</select></label></p>\n";
  out += R"(<script>
document.getElementById("model").addEventListener("change", event => {
  for (const part of document.querySelectorAll("[data-models]"))
    part.style.display = !event.target.value || part.dataset.models.split(" ").includes(event.target.value) ? "" : "none";
});
</script>
)";
}

std::string number(double v) { return fmt::format("{:.3g}", v); }

void put_scale(std::string& out, double at) {
  // The colours are those of difference_image().
  put(out,
      "<div class=\"scale\">Difference of radiance: darker in Blender {}{} <span class=\"bar\" style=\"background:"
      "linear-gradient(to right,#00f,#fff,#f00)\"></span> +{} brighter in Blender</div>\n",
      kMinus, number(at), number(at));
}

/// `alone` is true for the only scene of a report; its chart is at the top of the page.
void put_scene(std::string& out, const SceneReport& s, const Previews& p, bool alone) {
  put(out, "<section id=\"{}\" {}><h2>{}</h2>\n<p>{}</p>\n", escaped(s.scene), marked(s), escaped(s.scene),
      escaped(s.description));
  put(out,
      "<p class=\"soft\">{} \xc3\x97 {} pixels, at most {} bounces; pictures are sRGB{}. Point at a picture to see "
      "the reference in its place.</p>\n",
      s.width, s.height, s.max_bounces,
      p.exposure == 0 ? "" : fmt::format(", exposure {} stops", with_minus(fmt::format("{:.2f}", p.exposure))));
  put(out,
      "<div class=\"pictures\">\n<figure><a href=\"{}\"><img src=\"{}\" alt=\"Reference of {}\" width=\"{}\" "
      "height=\"{}\"></a><figcaption><b>Reference</b><br>{} samples a pixel, {:.1f} s</figcaption></figure>\n",
      escaped(p.reference), escaped(p.reference), escaped(s.scene), s.width, s.height, s.reference_spp,
      s.reference_seconds);
  for (std::size_t i = 0; i < s.forms.size(); ++i) {
    const FormReport& f = s.forms[i];
    const std::string picture = escaped(p.forms[i].picture), difference = escaped(p.forms[i].difference);
    put(out,
        "<figure><a class=\"flip\" href=\"{}\"><img src=\"{}\" alt=\"{} in Blender\" width=\"{}\" height=\"{}\">"
        "<img class=\"under\" src=\"{}\" alt=\"\"></a>\n",
        picture, picture, escaped(label(f)), s.width, s.height, escaped(p.reference));
    put(out, "<a href=\"{}\"><img src=\"{}\" alt=\"{} minus reference\" width=\"{}\" height=\"{}\"></a>\n", difference,
        difference, escaped(label(f)), s.width, s.height);
    put(out, "<figcaption><b>{}</b>{}{}<br>relMSE {} (noise {}), mean {}, CPU {}{}{}</figcaption></figure>\n",
        escaped(label(f)), f.materials.empty() ? "" : "<br>", escaped(models_of(f)), scientific(f.difference.rel_mse),
        scientific(f.difference.noise), bias(f.difference), or_dash(f.cost, cost(f) + "\xc3\x97"),
        f.equal_time_images > 0 ? fmt::format("<br><a href=\"{}\">in the Glossy node's time</a>: relMSE {}",
                                              escaped(p.forms[i].equal_time), scientific(f.equal_time.rel_mse))
                                : std::string(),
        p.forms[i].p_values.empty() ? std::string()
                                    : fmt::format("<br>pixels accepted (<a href=\"{}\">p-values</a>): {}",
                                                  escaped(p.forms[i].p_values), accepted(f)));
  }
  out += "</div>\n";
  put_scale(out, p.difference_at);
  out += "<p></p>\n";
  if (!alone) put_chart(out, s);
  put_figures(out, s);
  out += "</section>\n";
}

void put_method(std::string& out) {
  put(out, R"(<section><h2>How to read this</h2><dl>
<dt>relMSE</dt><dd>Mean over pixels and channels of (picture {minus} reference)<sup>2</sup> /
(reference<sup>2</sup> + {epsilon:g}).</dd>
<dt>Noise in it</dt><dd>The relMSE of two pictures with the same expectation: the reference's variance layer plus, if a
form was rendered with several seeds, the variance of the mean of its pictures. A relMSE close to this value shows no
difference other than noise.</dd>
<dt>Mean, against the reference</dt><dd>Relative difference of the sums over all pixels, with one standard deviation. It
is marked if it exceeds three standard deviations.</dd>
<dt>Pixels accepted</dt><dd>Welch's t-test of each pixel's luminance against the reference, at 0.01 with Sidak's
correction for the number of pixels; and the same for the means of tiles of {tile} {times} {tile} pixels. It is marked
if fewer than {least:g} % of the pixels, or not all tiles, are accepted. A map of each form's p-values is linked below
its pictures: uniform grey noise means agreement, dark patches mean differences.</dd>
<dt>FLIP</dt><dd>Mean of HDR-FLIP, the visible difference between picture and reference, including noise.</dd>
<dt>CPU time / Glossy node</dt><dd>CPU time of rendering, divided by that of the same scene with Blender's own Glossy
node on every material; both take turns in the same process. The value is the median over the seeds. If the smaller
pictures with the largest number of samples took longer, as in the whole report, their times are used. {dash} means that
the Glossy node took less than {shortest} s, which is too short for a reliable ratio. A diamond marks forms for which no
other form has both a smaller error and a shorter time.</dd>
<dt>Closures</dt><dd>The largest number of closures that a point of any material passes to Cycles.</dd>
<dt>In the Glossy node's time</dt><dd>The mean of as many pictures of the form as fit into the CPU time of all pictures
of the Glossy node.</dd>
<dt>CPU time to equal error</dt><dd>CPU time until the form has as little noise as Blender's Glossy node with 16, 256 or
1024 samples per pixel, in units of the node's time.</dd>
<dt>Form's own error</dt><dd>The error of the form against the model, measured when the form was compiled. Aimed and
sampled forms are exact in expectation: their error is noise.</dd>
<dt>auto</dt><dd>The default of the materials, if it is not the same form for all: the exact form if there is one,
otherwise the aimed form.</dd>
<dt>planned, twin</dt><dd>Forms of a pack cut to the scene by <code>brdfc build --scene</code>. Planned: its choice if
forms may have a small error, that is closures fitted to the model, with light sampling. Twin: Blender's own nodes,
controlled by the view angle, for devices without Open Shading Language; only if every material can have them.</dd>
<dt>Blender's Glossy node</dt><dd>The unit of cost, and the look of the scene without these models.</dd>
<dt>Blender's nodes, fitted</dt><dd>What users would choose without this extension: nodes with the parameters nearest to
the model, by least squares of f cos over directions. Their own error is the remaining difference.</dd>
</dl></section>
)",
      fmt::arg("minus", kMinus), fmt::arg("epsilon", kRelMseEpsilon), fmt::arg("tile", kTestTile),
      fmt::arg("times", "\xc3\x97"), fmt::arg("least", 100 * kTestAccepted), fmt::arg("shortest", kShortestTime),
      fmt::arg("dash", kDash));
}

void put_provenance(std::string& out, const std::vector<SceneReport>& scenes) {
  out += "<section><h2>Provenance</h2>\n";
  put(out,
      "<p>Page written by brdfc {}. The same figures are in <a href=\"report.json\">report.json</a> and "
      "<a href=\"report.csv\">report.csv</a>.</p>\n",
      BRDFC_VERSION);
  // Provenance that all scenes share is stated once.
  std::map<std::string, std::string> shared = scenes.front().provenance;
  for (const SceneReport& s : scenes)
    std::erase_if(shared, [&](const auto& item) {
      const auto it = s.provenance.find(item.first);
      return it == s.provenance.end() || it->second != item.second;
    });
  const auto row = [&](const std::string& scene, const std::string& name, const std::string& value) {
    put(out, "<tr><td class=\"left\">{}</td><td class=\"left\">{}</td><td class=\"left mono\">{}</td></tr>\n",
        escaped(scene), escaped(name), escaped(value));
  };
  out +=
      "<div class=\"wide\"><table><thead><tr><th class=\"left\">Scene</th><th class=\"left\">What</th>"
      "<th class=\"left\">Value</th></tr></thead><tbody>\n";
  for (const auto& [name, value] : shared) row("all", name, value);
  for (const SceneReport& s : scenes)
    for (const auto& [name, value] : s.provenance)
      if (!shared.count(name)) row(s.scene, name, value);
  out += "</tbody></table></div>\n";
  for (const SceneReport& s : scenes) {
    put(out, "<p>{}</p><pre>", escaped(s.scene));
    for (const std::string& command : s.commands) put(out, "{}\n", escaped(command));
    out += "</pre>\n";
  }
  out += "</section>\n";
}

}  // namespace

std::string report_html(const std::vector<SceneReport>& scenes, const std::vector<Previews>& previews,
                        const std::vector<ConformanceTable>& closures,
                        const std::map<std::string, std::string>& links) {
  std::string out;
  put(out,
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>brdfc: error against run time</title>\n<style>{}</style></head>\n<body>\n",
      kPageStyle);
  std::size_t forms = 0;
  for (const SceneReport& s : scenes) forms += s.forms.size();
  out += "<h1>Error against run time</h1>\n";
  if (!links.empty()) {
    out += "<p class=\"soft\">The same scenes in";
    const char* separator = " ";
    for (const auto& [name, address] : links) {
      put(out, "{}<a href=\"{}\">{}</a>", separator, escaped(address), escaped(name));
      separator = ", ";
    }
    out += ".</p>\n";
  }
  put_verdict(out, scenes);
  if (scenes.size() == 1)
    put_chart(out, scenes.front());
  else
    put_overview(out, scenes);
  put(out,
      "<p>Every form of every model, rendered in Blender's Cycles and compared "
      "with an independent path tracer that evaluates the model itself in double precision. {}, {}. "
      "<span class=\"soft\">The meaning of the figures is <a href=\"#method\">explained below</a>.</span></p>\n",
      count(scenes.size(), "scene", "scenes"), count(forms, "picture", "pictures"));
  put_filter(out, scenes);
  put_summary(out, scenes);
  for (std::size_t i = 0; i < scenes.size(); ++i) put_scene(out, scenes[i], previews[i], scenes.size() == 1);
  put_conformance(out, closures);
  out += "<div id=\"method\"></div>\n";
  put_method(out);
  put_provenance(out, scenes);
  out += "</body></html>\n";
  return out;
}

}  // namespace brdfc::report
