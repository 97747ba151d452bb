// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "reference/image.h"
#include "report/report.h"

namespace brdfc::report {
namespace {

namespace fs = std::filesystem;

/// The value below which the given fraction of the values lies.
double quantile(std::vector<double> values, double fraction) {
  const auto nth = values.begin() + std::ptrdiff_t(fraction * double(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

template <class PerPixel> std::vector<double> per_pixel(const reference::Image& image, PerPixel value) {
  std::vector<double> out;
  out.reserve(image.rgb.size() / 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) out.push_back(value(x, y));
  return out;
}

/// The smallest number >= x that is 1, 2 or 5 times a power of ten; x > 0.
double round_up_125(double x) {
  const double power = std::pow(10, std::floor(std::log10(x)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * power >= x * (1 - 1e-9)) return step * power;
  return 10 * power;
}

}  // namespace

Previews write_previews(const fs::path& folder, const SceneReport& scene) {
  const reference::Image& reference = scene.reference.mean;
  Previews out;
  const auto luminances = per_pixel(reference, [&](int x, int y) { return luminance(reference.color(x, y)); });
  // Scenes that lie in [0, 1] except for noise, above all furnaces, are shown unchanged.
  const double bright = quantile(luminances, 0.98);
  out.exposure = bright > 1.1 ? -std::log2(bright) : 0;

  // One scale for all forms of a scene, so that they can be compared. The most extreme percent may saturate, and so may
  // Blender's own node, which always differs much from the model.
  double largest = 1e-6, mean = 0;
  for (const FormReport& form : scene.forms) {
    if (form.form == kNativeForm && scene.forms.size() > 1) continue;
    const reference::Image& picture = form.picture.mean;
    largest = std::max(largest, quantile(per_pixel(reference,
                                                   [&](int x, int y) {
                                                     return std::abs(luminance(picture.color(x, y)) -
                                                                     luminance(reference.color(x, y)));
                                                   }),
                                         0.99));
  }
  for (const float v : reference.rgb) mean += v;
  mean /= double(reference.rgb.size());
  out.difference_at = round_up_125(largest);

  out.reference = scene.scene + "/reference.png";
  reference::write_preview(folder / out.reference, scene.reference, out.exposure);
  for (const FormReport& form : scene.forms) {
    const std::string stem = scene.scene + "/" + form.form;
    out.forms.push_back({stem + ".png", stem + "-difference.png", form.test ? stem + "-p-values.png" : "",
                         form.equal_time_images > 0 ? stem + "-equal-time.png" : ""});
    reference::write_preview(folder / out.forms.back().picture, form.picture, out.exposure);
    reference::write_display(folder / out.forms.back().difference,
                             reference::difference_image(form.picture.mean, reference, out.difference_at / mean));
    if (form.equal_time_images > 0)
      reference::write_preview(folder / out.forms.back().equal_time, form.equal_time_picture, out.exposure);
    if (form.test) reference::write_display(folder / out.forms.back().p_values, form.test->p);
  }
  return out;
}

}  // namespace brdfc::report
