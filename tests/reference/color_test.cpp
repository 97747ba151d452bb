// SPDX-License-Identifier: GPL-3.0-or-later
// Colour spaces of our OpenColorIO configuration compared with the standards; and messages about other configurations.
#include "reference/color.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>

#include "core/data_dir.h"
#include "core/error.h"

namespace brdfc::reference {
namespace {

using testing::AllOf;
using testing::HasSubstr;

ColorConfig ours() { return ColorConfig(data_dir() / "data" / "color" / "config.ocio"); }

Image pixel(double r, double g, double b) {
  Image image(1, 1);
  image.rgb = {float(r), float(g), float(b)};
  return image;
}

/// IEC 61966-2-1
double srgb_encode(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055; }

TEST(Color, SrgbIsThatOfTheStandard) {
  const ColorConfig config = ours();
  for (double x = 0; x <= 1; x += 0.01) {
    Image image = pixel(srgb_encode(x), 0, 1);
    config.to_scene_linear(image, "sRGB");
    // The standard's two pieces agree in slope and value to 1e-7.
    EXPECT_NEAR(image.rgb[0], x, 2e-6);
    image = pixel(x, 2, -1);
    config.to_display(image, "Standard");
    EXPECT_NEAR(image.rgb[0], srgb_encode(x), 2e-6);
    EXPECT_EQ(image.rgb[1], 1);
    EXPECT_EQ(image.rgb[2], 0);
  }
}

Eigen::Vector3d xyz(double x, double y) { return {x / y, 1, (1 - x - y) / y}; }

/// Linear RGB to XYZ with Y = 1 for white, from chromaticities (SMPTE RP 177).
Eigen::Matrix3d to_xyz(const Eigen::Vector3d& red, const Eigen::Vector3d& green, const Eigen::Vector3d& blue,
                       const Eigen::Vector3d& white) {
  Eigen::Matrix3d primaries;
  primaries << red, green, blue;
  return primaries * Eigen::Vector3d(primaries.inverse() * white).asDiagonal();
}

/// Bradford's chromatic adaptation.
Eigen::Matrix3d to_d65(const Eigen::Vector3d& white) {
  Eigen::Matrix3d bradford;
  bradford << 0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296;
  const Eigen::Vector3d gain = (bradford * xyz(0.3127, 0.3290)).cwiseQuotient(bradford * white);
  return bradford.inverse() * gain.asDiagonal() * bradford;
}

TEST(Color, MatricesAreThoseOfThePrimaries) {
  const Eigen::Vector3d d65 = xyz(0.3127, 0.3290), aces_white = xyz(0.32168, 0.33767);
  const Eigen::Matrix3d rec709 = to_xyz(xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06), d65);
  const Eigen::Matrix3d rec2020 = to_xyz(xyz(0.708, 0.292), xyz(0.170, 0.797), xyz(0.131, 0.046), d65);
  const Eigen::Matrix3d ap1 = to_xyz(xyz(0.713, 0.293), xyz(0.165, 0.830), xyz(0.128, 0.044), aces_white);
  const Eigen::Matrix3d ap0 = to_xyz(xyz(0.7347, 0.2653), xyz(0, 1), xyz(0.0001, -0.077), aces_white);
  const Eigen::Matrix3d adaptation = to_d65(aces_white);
  const std::pair<const char*, Eigen::Matrix3d> spaces[] = {{"Linear Rec.709", Eigen::Matrix3d::Identity()},
                                                            {"Linear Rec.2020", rec709.inverse() * rec2020},
                                                            {"ACEScg", rec709.inverse() * adaptation * ap1},
                                                            {"ACES2065-1", rec709.inverse() * adaptation * ap0},
                                                            {"Linear CIE-XYZ D65", rec709.inverse()}};
  const ColorConfig config = ours();
  for (const auto& [name, matrix] : spaces) {
    Image image = pixel(0.2, 0.5, 0.9);
    config.to_scene_linear(image, name);
    const Eigen::Vector3d expected = matrix * Eigen::Vector3d(0.2, 0.5, 0.9);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.rgb[c], expected[c], 1e-6) << name;
  }
  Image data = pixel(0.2, 5, -1);
  config.to_scene_linear(data, "raw");
  EXPECT_EQ(data.rgb, pixel(0.2, 5, -1).rgb);
}

/// The chromaticities in EXR files are those of the configuration's conversion.
TEST(Color, ChromaticitiesAreThoseOfTheWorkingSpaces) {
  const ColorConfig config = ours();
  EXPECT_EQ(config.working_space(), working_spaces()[0].name);
  for (const WorkingSpace& s : working_spaces()) {
    const ColorConfig other = config.with_working_space(s.interop_id);
    EXPECT_EQ(other.working_space(), s.name);
    const auto at = [&](std::size_t i) { return xyz(s.chromaticities[2 * i], s.chromaticities[2 * i + 1]); };
    const Eigen::Matrix3d matrix = to_d65(at(3)) * to_xyz(at(0), at(1), at(2), at(3));
    for (int c = 0; c < 3; ++c) {
      Image image = pixel(c == 0, c == 1, c == 2);
      config.with_working_space("Linear CIE-XYZ D65").to_scene_linear(image, s.name);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(image.rgb[i], matrix(i, c), 1e-6) << s.name;
    }
    // White is unchanged, and so are pixels that are in the space itself.
    Image image = pixel(1, 1, 1);
    other.to_scene_linear(image, "sRGB");
    for (const float v : image.rgb) EXPECT_NEAR(v, 1, 1e-6) << s.name;
    image = pixel(0.2, 0.5, 0.9);
    other.to_scene_linear(image, s.name);
    EXPECT_EQ(image.rgb, pixel(0.2, 0.5, 0.9).rgb) << s.name;
  }
}

std::string error_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Color, ErrorsNameTheFileAndWhatWasExpected) {
  const ColorConfig config = ours();
  Image image = pixel(0, 0, 0);
  EXPECT_THAT(error_of([&] { config.to_scene_linear(image, "Rec.77"); }),
              AllOf(HasSubstr("config.ocio"), HasSubstr("'Rec.77'"), HasSubstr("Linear Rec.709, sRGB")));
  EXPECT_THAT(error_of([&] { config.with_working_space("Rec.77"); }),
              AllOf(HasSubstr("config.ocio"), HasSubstr("'Rec.77'"), HasSubstr("Linear Rec.709, sRGB")));
  EXPECT_THAT(error_of([&] { config.to_display(image, "Kodak"); }),
              AllOf(HasSubstr("config.ocio"), HasSubstr("'Kodak'"), HasSubstr("Standard, Raw")));
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "later.ocio";
  EXPECT_THAT(error_of([&] { ColorConfig{file.parent_path() / "none.ocio"}; }), HasSubstr("none.ocio: expected"));
  std::ofstream(file) << "ocio_profile_version: 9.5\n";
  EXPECT_THAT(error_of([&] { ColorConfig{file}; }), AllOf(HasSubstr("later.ocio"), HasSubstr("of version 9.5")));
  std::ofstream(file) << "\x01\x02 no configuration";
  EXPECT_THAT(error_of([&] { ColorConfig{file}; }), HasSubstr("later.ocio"));
}

}  // namespace
}  // namespace brdfc::reference
