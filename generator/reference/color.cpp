// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/color.h"

#include <OpenColorIO/OpenColorIO.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string_view>

#include "core/data_dir.h"
#include "core/error.h"
#include "core/text.h"

namespace brdfc::reference {

namespace ocio = OCIO_NAMESPACE;
namespace fs = std::filesystem;

namespace {

/// Prefix of the configurations built into OpenColorIO, from version 2.2 on.
constexpr const char* kBuiltIn = "ocio://";

/// The version that a configuration file states; empty if it states none.
std::string stated_version(const fs::path& file) {
  std::ifstream in(file);
  constexpr std::string_view kKey = "ocio_profile_version:";
  constexpr const char* kSpace = " \t\r\v\f";
  for (std::string line; std::getline(in, line);) {
    line.erase(0, line.find_first_not_of(kSpace));
    if (!line.starts_with(kKey)) continue;
    line.erase(0, line.find_first_not_of(kSpace, kKey.size()));
    line.resize(std::min(line.size(), line.find_first_not_of("0123456789.")));
    if (!line.empty()) return line;
  }
  return {};
}

/// True if a configuration states a later version than this library can read.
bool is_later(const fs::path& file) {
  int major = 0, minor = 0, own_major = 0, own_minor = 0;
  if (file.string().starts_with(kBuiltIn) || file.extension() == ".ocioz")
    major = 2, minor = 2;
  else
    std::sscanf(stated_version(file).c_str(), "%d.%d", &major, &minor);
  std::sscanf(ocio::GetVersion(), "%d.%d", &own_major, &own_minor);
  return std::pair(major, minor) > std::pair(own_major, own_minor);
}

/// The transform from CIE XYZ with white D65 to the space of the role aces_interchange, or back.
ocio::ConstTransformRcPtr xyz_of_aces(ocio::TransformDirection direction) {
  const auto transform = ocio::BuiltinTransform::Create();
  transform->setStyle("UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD");
  transform->setDirection(direction);
  return transform;
}

/// Names of our spaces in the ACES configurations: 1.0 to 1.2, then 1.3 and 2.0.
const std::map<std::string, std::vector<const char*>> kOtherNames{
    {"Linear Rec.709", {"Linear Rec.709 (sRGB)", "lin_rec709_scene", "lin_rec709", "Utility - Linear - Rec.709"}},
    {"Linear Rec.2020", {"lin_rec2020_scene", "lin_rec2020", "Utility - Linear - Rec.2020"}},
    {"ACEScg", {"lin_ap1_scene", "ACES - ACEScg"}},
    {"sRGB",
     {"sRGB Encoded Rec.709 (sRGB)", "srgb_rec709_scene", "sRGB - Texture", "srgb_tx", "Utility - sRGB - Texture"}}};

/// CIE XYZ of the chromaticity (x, y) with luminance 1.
Eigen::Vector3d xyz(double x, double y) { return {x / y, 1, (1 - x - y) / y}; }

/// The matrix from linear RGB to CIE XYZ with white D65, adapted with the Bradford matrix (SMPTE RP 177).
Eigen::Matrix3d xyz_d65_of(const Chromaticities& c) {
  const auto near = [&](std::size_t i, double x, double y) {
    return std::abs(c[i] - x) < 1e-3 && std::abs(c[i + 1] - y) < 1e-3;
  };
  if (near(0, 1, 0) && near(2, 0, 1) && near(4, 0, 0)) return Eigen::Matrix3d::Identity();
  Eigen::Matrix3d primaries;
  for (int i = 0; i < 3; ++i) primaries.col(i) << c[2 * i], c[2 * i + 1], 1. - c[2 * i] - c[2 * i + 1];
  const Eigen::Vector3d white = xyz(c[6], c[7]), d65 = xyz(0.3127, 0.3290);
  const Eigen::Matrix3d to_xyz = primaries * Eigen::Vector3d(primaries.inverse() * white).asDiagonal();
  Eigen::Matrix3d bradford;
  bradford << 0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296;
  const Eigen::Vector3d gain = (bradford * d65).cwiseQuotient(bradford * white);
  return bradford.inverse() * gain.asDiagonal() * bradford * to_xyz;
}

/// Uses the processor's exact formulas: the default ones approximate powers to 1e-4.
void convert(const ocio::ConstProcessorRcPtr& processor, Image& image) {
  const auto cpu =
      processor->getOptimizedCPUProcessor(ocio::BIT_DEPTH_F32, ocio::BIT_DEPTH_F32, ocio::OPTIMIZATION_LOSSLESS);
  ocio::PackedImageDesc pixels(image.rgb.data(), image.width, image.height, 3);
  cpu->apply(pixels);
}

}  // namespace

struct ColorConfig::Impl {
  ocio::ConstConfigRcPtr config;

  /// Finds a space by name, alias or role, or by the name that ACES configurations use for one of working_spaces().
  ocio::ConstColorSpaceRcPtr find(const std::string& space) const {
    if (const auto found = config->getColorSpace(space.c_str())) return found;
    const auto others = kOtherNames.find(space);
    if (others == kOtherNames.end()) return {};
    for (const char* name : others->second)
      if (const auto found = config->getColorSpace(name)) return found;
    return {};
  }

  ocio::ConstColorSpaceRcPtr find(const std::string& space, const ColorConfig& of) const {
    const ocio::ConstColorSpaceRcPtr found = find(space);
    if (!found)
      input_error("{} has no colour space '{}', expected one of {}", of.file().string(), space,
                  join(of.spaces(), ", "));
    return found;
  }
};

ColorConfig::ColorConfig(const fs::path& file) : file_(file), impl_(std::make_unique<Impl>()) {
  ocio::SetLoggingLevel(ocio::LOGGING_LEVEL_NONE);  // errors are reported as exceptions
  std::error_code ignored;
  const bool built_in = file.string().starts_with(kBuiltIn);
  if (!built_in && !fs::is_regular_file(file, ignored))
    input_error("{}: expected an OpenColorIO configuration", file.string());
  try {
    impl_->config = ocio::Config::CreateFromFile(file.c_str());
    impl_->config->validate();
  } catch (const ocio::Exception& e) {
    const std::string version = stated_version(file);
    input_error(
        "{}: an OpenColorIO configuration{} that OpenColorIO {} can't read; without the environment variable "
        "OCIO brdfc takes its own. {}",
        file.string(), version.empty() ? "" : " of version " + version, ocio::GetVersion(), e.what());
  }
  if (!impl_->config->getColorSpace(ocio::ROLE_SCENE_LINEAR))
    input_error("{}: expected the role {}, the space that renderers compute in", file.string(),
                ocio::ROLE_SCENE_LINEAR);
}

ColorConfig::ColorConfig(fs::path file, std::unique_ptr<Impl> impl) : file_(std::move(file)), impl_(std::move(impl)) {}
ColorConfig::ColorConfig(ColorConfig&&) noexcept = default;
ColorConfig::~ColorConfig() = default;

const std::array<WorkingSpace, 3>& working_spaces() {
  static const std::array<WorkingSpace, 3> spaces{{
      {"Linear Rec.709", "lin_rec709_scene", {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f}},
      {"Linear Rec.2020", "lin_rec2020_scene", {0.708f, 0.292f, 0.170f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.3290f}},
      {"ACEScg", "lin_ap1_scene", {0.713f, 0.293f, 0.165f, 0.830f, 0.128f, 0.044f, 0.32168f, 0.33767f}},
  }};
  return spaces;
}

const std::vector<LinearSpace>& linear_spaces() {
  static const std::vector<LinearSpace> spaces = [] {
    std::vector<LinearSpace> all;
    for (const WorkingSpace& s : working_spaces()) all.push_back({s.interop_id, s.chromaticities});
    all.push_back({"lin_ap0_scene", {0.7347f, 0.2653f, 0, 1, 0.0001f, -0.077f, 0.32168f, 0.33767f}});
    all.push_back({"lin_p3d65_scene", {0.68f, 0.32f, 0.265f, 0.69f, 0.15f, 0.06f, 0.3127f, 0.3290f}});
    all.push_back({"lin_adobergb_scene", {0.64f, 0.33f, 0.21f, 0.71f, 0.15f, 0.06f, 0.3127f, 0.3290f}});
    all.push_back({"lin_ciexyzd65_scene", {1, 0, 0, 1, 0, 0, 1.f / 3, 1.f / 3}});
    return all;
  }();
  return spaces;
}

const ColorConfig& ColorConfig::current() {
  static const ColorConfig config = [] {
    const fs::path own = data_path("data/color/config.ocio");
    const char* given = std::getenv("OCIO");
    if (!given || !*given) return ColorConfig(own);
    // Blender sets OCIO for the programs that it starts.
    if (is_later(given)) {
      const std::string version = stated_version(given);
      fmt::print(stderr, "brdfc: {} {}, later than OpenColorIO {} reads: taking {}\n", given,
                 version.empty() ? "needs OpenColorIO 2.2" : "is of version " + version, ocio::GetVersion(),
                 own.string());
      return ColorConfig(own);
    }
    return ColorConfig(given);
  }();
  return config;
}

std::vector<std::string> ColorConfig::spaces() const {
  std::vector<std::string> out;
  for (int i = 0; i < impl_->config->getNumColorSpaces(); ++i)
    out.emplace_back(impl_->config->getColorSpaceNameByIndex(i));
  return out;
}

std::vector<std::string> ColorConfig::views() const {
  const ocio::ConstConfigRcPtr& c = impl_->config;
  std::vector<std::string> out;
  for (int i = 0; i < c->getNumViews(c->getDefaultDisplay()); ++i)
    out.emplace_back(c->getView(c->getDefaultDisplay(), i));
  return out;
}

std::string ColorConfig::standard_view() const {
  const std::vector<std::string> known = views();
  if (std::ranges::find(known, "Standard") != known.end()) return "Standard";
  return impl_->config->getDefaultView(impl_->config->getDefaultDisplay());
}

bool ColorConfig::has_space(const std::string& space) const { return bool(impl_->find(space)); }

ColorConfig ColorConfig::with_working_space(const std::string& space) const {
  auto impl = std::make_unique<Impl>();
  const ocio::ConfigRcPtr config = impl_->config->createEditableCopy();
  config->setRole(ocio::ROLE_SCENE_LINEAR, impl_->find(space, *this)->getName());
  impl->config = config;
  return {file_, std::move(impl)};
}

std::string ColorConfig::working_space() const {
  return impl_->config->getColorSpace(ocio::ROLE_SCENE_LINEAR)->getName();
}

void ColorConfig::to_scene_linear(Image& image, const std::string& space) const {
  const ocio::ConstColorSpaceRcPtr found = impl_->find(space, *this);
  if (found->isData()) return;
  convert(impl_->config->getProcessor(found->getName(), ocio::ROLE_SCENE_LINEAR), image);
}

void ColorConfig::srgb_to_scene_linear(Image& image) const {
  if (const auto found = impl_->find("sRGB"); found && !found->isData()) {
    convert(impl_->config->getProcessor(found->getName(), ocio::ROLE_SCENE_LINEAR), image);
    return;
  }
  // The transfer curve of IEC 61966-2-1 and the Rec.709 primaries.
  const auto curve = ocio::ExponentWithLinearTransform::Create();
  curve->setGamma({2.4, 2.4, 2.4, 1});
  curve->setOffset({0.055, 0.055, 0.055, 0});
  convert(impl_->config->getProcessor(curve), image);
  to_scene_linear(image, working_spaces()[0].chromaticities);
}

void ColorConfig::to_scene_linear(Image& image, const Chromaticities& stated) const {
  const Eigen::Matrix3d to_xyz = xyz_d65_of(stated);
  Image unit(3, 1);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) unit.rgb[std::size_t(3 * i + k)] = float(to_xyz(k, i));
  convert(impl_->config->getProcessor(xyz_of_aces(ocio::TRANSFORM_DIR_INVERSE)), unit);
  convert(impl_->config->getProcessor(interchange().c_str(), ocio::ROLE_SCENE_LINEAR), unit);
  const Eigen::Matrix3f matrix = Eigen::Map<const Eigen::Matrix3f>(unit.rgb.data());
  // The tolerance allows for chromaticities rounded to four digits.
  if ((matrix - Eigen::Matrix3f::Identity()).cwiseAbs().maxCoeff() < 2e-4f) return;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    Eigen::Map<Eigen::Vector3f> pixel(&image.rgb[i]);
    pixel = (matrix * pixel).eval();
  }
}

std::string ColorConfig::interchange() const {
  // The role exists since OpenColorIO 2; older ACES configurations have the space.
  for (const char* name : {"aces_interchange", "ACES2065-1", "ACES - ACES2065-1"})
    if (impl_->config->getColorSpace(name)) return name;
  input_error("{}: expected the role aces_interchange, which relates spaces to CIE XYZ", file_.string());
}

std::array<double, 3> ColorConfig::from_xyz(const Xyz& xyz) const {
  const std::string space = interchange();
  const char* interchange_space = space.c_str();
  Image pixel;  // the white point first
  pixel.width = pixel.height = 1;
  pixel.rgb = {1, 1, 1};
  convert(impl_->config->getProcessor(ocio::ROLE_SCENE_LINEAR, interchange_space), pixel);
  convert(impl_->config->getProcessor(xyz_of_aces(ocio::TRANSFORM_DIR_FORWARD)), pixel);
  for (std::size_t c = 0; c < 3; ++c) pixel.rgb[c] = float(pixel.rgb[c] * xyz[c]);
  convert(impl_->config->getProcessor(xyz_of_aces(ocio::TRANSFORM_DIR_INVERSE)), pixel);
  convert(impl_->config->getProcessor(interchange_space, ocio::ROLE_SCENE_LINEAR), pixel);
  return {pixel.rgb[0], pixel.rgb[1], pixel.rgb[2]};
}

ToRgb ColorConfig::to_rec709() const {
  auto config = std::make_shared<ColorConfig>(with_working_space(working_spaces()[0].name));
  return [config](const Xyz& xyz) { return config->from_xyz(xyz); };
}

void ColorConfig::to_display(Image& image, const std::string& view) const {
  const std::vector<std::string> known = views();
  if (!view.empty() && std::find(known.begin(), known.end(), view) == known.end())
    input_error("{} has no view '{}', expected one of {}", file_.string(), view, join(known, ", "));
  const auto transform = ocio::DisplayViewTransform::Create();
  transform->setSrc(ocio::ROLE_SCENE_LINEAR);
  transform->setDisplay(impl_->config->getDefaultDisplay());
  transform->setView((view.empty() ? standard_view() : view).c_str());
  convert(impl_->config->getProcessor(transform), image);
  for (float& v : image.rgb) v = std::clamp(v, 0.0f, 1.0f);
}

}  // namespace brdfc::reference
