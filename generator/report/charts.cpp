// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/charts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include "report/html.h"
#include "report/naming.h"

namespace brdfc::report {
namespace {

/// Draws labelled lines at powers of 10 from `left` to `right`; y(value) is a value's position.
template <class Y>
void put_decades(std::string& out, double left, double right, double bottom, double top, const Y& y) {
  for (double decade = bottom; decade <= top; ++decade) {
    const double at = y(std::pow(10, decade));
    put(out, "<line class=\"axis\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>", left, right, at, at);
    put(out, "<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">10<tspan dy=\"-5\">{}</tspan></text>\n", left - 8, at + 5,
        with_minus(fmt::format("{:.0f}", decade)));
  }
}

}  // namespace

void put_overview(std::string& out, const std::vector<SceneReport>& scenes) {
  constexpr const char* kGreys[] = {"#8a8f98", "#b9bec6", "#5f646c"};
  constexpr const char* kColors[] = {"#2a6f97", "#2e9e5b", "#e07a1f", "#c0392b", "#a63d8f", "#8c6d31"};
  constexpr double kWidth = 860, kHeight = 300, kLeft = 70, kRight = 20, kTop = 34, kBottom = 42;
  double cheap = 1, dear = 1, low = 1e300, high = 0;
  std::size_t points = 0;
  for (const SceneReport& s : scenes)
    for (const FormReport& f : s.forms)
      if (f.cost && f.difference.rel_mse > 0) {
        ++points;
        cheap = std::min(cheap, *f.cost), dear = std::max(dear, *f.cost);
        low = std::min(low, f.difference.rel_mse), high = std::max(high, f.difference.rel_mse);
      }
  if (points < 2) return;
  cheap /= 1.15, dear *= 1.15;
  const double bottom = std::floor(std::log10(low)), top = std::max(bottom + 1, std::ceil(std::log10(high)));
  const auto x = [&](double c) {
    return kLeft + std::log(c / cheap) / std::log(dear / cheap) * (kWidth - kLeft - kRight);
  };
  const auto y = [&](double e) { return kTop + (top - std::log10(e)) / (top - bottom) * (kHeight - kTop - kBottom); };
  put(out, "<svg id=\"overview\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"relMSE over CPU time, all scenes\">\n",
      kWidth, kHeight);
  put_decades(out, kLeft, kWidth - kRight, bottom, top, y);
  for (const double tick : {0.125, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 8.0, 16.0, 32.0, 64.0})
    if (tick > cheap && tick < dear)
      put(out, "<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:g}</text>\n", x(tick), kHeight - kBottom + 18,
          tick);
  put(out, "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">CPU time / Glossy node</text>\n",
      (kLeft + kWidth - kRight) / 2, kHeight - 6);
  put(out, "<text x=\"14\" y=\"{}\" transform=\"rotate(-90 14 {})\" text-anchor=\"middle\">relMSE</text>\n",
      kHeight / 2, kHeight / 2);
  const std::vector<std::string> forms = all_forms(scenes);
  double legend = kLeft;
  std::size_t greys = 0, colors = 0;
  for (std::size_t i = 0; i < forms.size(); ++i) {
    FormReport named;
    named.form = forms[i];
    const char* color = is_native(named) ? kGreys[greys++ % std::size(kGreys)] : kColors[colors++ % std::size(kColors)];
    put(out, "<circle style=\"fill:{}\" cx=\"{:.0f}\" cy=\"14\" r=\"4\"/><text x=\"{:.0f}\" y=\"18\">{}</text>\n",
        color, legend, legend + 8, escaped(label(named)));
    legend += 24 + 6.4 * double(label(named).size());
    for (const SceneReport& s : scenes)
      for (const FormReport& f : s.forms)
        if (f.form == forms[i] && f.cost && f.difference.rel_mse > 0)
          put(out,
              "<a href=\"#{}\" {}><circle style=\"fill:{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\"><title>{}, {}: relMSE "
              "{:.2g}, from noise {:.2g}; CPU {:.2f} of the Glossy node</title></circle></a>\n",
              escaped(s.scene), marked(s), color, x(*f.cost), y(f.difference.rel_mse), escaped(s.scene),
              escaped(label(f)), f.difference.rel_mse, f.difference.noise, *f.cost);
  }
  out += "</svg>\n";
}

void put_chart(std::string& out, const SceneReport& s) {
  std::vector<const FormReport*> points;
  for (const FormReport& f : s.forms)
    if (f.cost && f.difference.rel_mse > 0) points.push_back(&f);
  if (points.size() < 2) return;
  constexpr double kWidth = 560, kHeight = 240, kLeft = 70, kRight = 130, kTop = 16, kBottom = 42;
  double most = 1, low = 1e300, high = 0;
  for (const FormReport* f : points) {
    most = std::max(most, *f->cost);
    low = std::min({low, f->difference.rel_mse, f->difference.noise > 0 ? f->difference.noise : 1e300});
    high = std::max(high, f->difference.rel_mse);
  }
  const double x_end = std::ceil(most * 1.05 * 2) / 2;
  const double bottom = std::floor(std::log10(low)), top = std::max(bottom + 1, std::ceil(std::log10(high)));
  const auto x = [&](double c) { return kLeft + c / x_end * (kWidth - kLeft - kRight); };
  const auto y = [&](double e) { return kTop + (top - std::log10(e)) / (top - bottom) * (kHeight - kTop - kBottom); };
  put(out, "<svg viewBox=\"0 0 {} {}\" width=\"{}\" role=\"img\" aria-label=\"relMSE over CPU time\">\n", kWidth,
      kHeight, kWidth);
  put_decades(out, kLeft, kWidth - kRight, bottom, top, y);
  for (double tick = 0; tick <= x_end; tick += x_end > 4 ? 1 : 0.5)
    put(out, "<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:g}</text>\n", x(tick), kHeight - kBottom + 18, tick);
  put(out, "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">CPU time / Glossy node</text>\n",
      (kLeft + kWidth - kRight) / 2, kHeight - 6);
  put(out, "<text x=\"14\" y=\"{}\" transform=\"rotate(-90 14 {})\" text-anchor=\"middle\">relMSE</text>\n",
      kHeight / 2 - 10, kHeight / 2 - 10);
  // From bottom to top: a label that would overlap another moves up until there is room.
  std::ranges::stable_sort(points, std::less(), [](const FormReport* f) { return f->difference.rel_mse; });
  constexpr double kLine = 13, kLetter = 7;
  struct Name {
    double left, right, base;
  };
  std::vector<Name> names;
  for (const FormReport* f : points) {
    const double at_x = x(*f->cost), at_y = y(f->difference.rel_mse);
    if (f->difference.noise > 0)
      put(out, "<line class=\"floor\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>", at_x - 12, at_x + 12,
          y(f->difference.noise), y(f->difference.noise));
    Name name{at_x + 9, at_x + 9 + kLetter * double(label(*f).size()), at_y + 4};
    const auto covers = [&](const Name& n) {
      return n.left < name.right && name.left < n.right && std::abs(n.base - name.base) < kLine;
    };
    for (auto other = names.begin(); (other = std::ranges::find_if(names, covers)) != names.end();)
      name.base = other->base - kLine;
    names.push_back(name);
    put(out,
        "<circle{} cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\"><title>relMSE {:.2g}, from noise {:.2g}; CPU {:.2f} of the "
        "Glossy "
        "node</title></circle><text class=\"name\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
        on_front(s, *f) ? "" : " class=\"behind\"", at_x, at_y, f->difference.rel_mse, f->difference.noise, *f->cost,
        name.left, name.base, escaped(label(*f)));
  }
  out += "</svg>\n";
}

}  // namespace brdfc::report
