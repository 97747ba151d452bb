// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/color.h"

#include <OpenColorIO/OpenColorIO.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <regex>

#include "core/data_dir.h"
#include "core/error.h"

namespace brdfc::reference {

namespace ocio = OCIO_NAMESPACE;
namespace fs = std::filesystem;

namespace {

/// What the file says of its version; nothing where it says none.
std::string stated_version(const fs::path& file) {
  std::ifstream in(file);
  static const std::regex line_of_version(R"(^\s*ocio_profile_version:\s*([0-9.]+))");
  std::smatch found;
  for (std::string line; std::getline(in, line);)
    if (std::regex_search(line, found, line_of_version)) return found[1];
  return {};
}

/// Whether a configuration says that it is of a later version than this library reads.
bool is_later(const fs::path& file) {
  int major = 0, minor = 0, own_major = 0, own_minor = 0;
  std::sscanf(stated_version(file).c_str(), "%d.%d", &major, &minor);
  std::sscanf(ocio::GetVersion(), "%d.%d", &own_major, &own_minor);
  return std::pair(major, minor) > std::pair(own_major, own_minor);
}

/// From CIE XYZ, white D65, to the space of the role aces_interchange, or back.
ocio::ConstTransformRcPtr xyz_of_aces(ocio::TransformDirection direction) {
  const auto transform = ocio::BuiltinTransform::Create();
  transform->setStyle("UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD");
  transform->setDirection(direction);
  return transform;
}

/// The processor's exact formulas: the default ones approximate powers to 1e-4.
void convert(const ocio::ConstProcessorRcPtr& processor, Image& image) {
  const auto cpu =
      processor->getOptimizedCPUProcessor(ocio::BIT_DEPTH_F32, ocio::BIT_DEPTH_F32, ocio::OPTIMIZATION_LOSSLESS);
  ocio::PackedImageDesc pixels(image.rgb.data(), image.width, image.height, 3);
  cpu->apply(pixels);
}

}  // namespace

struct ColorConfig::Impl {
  ocio::ConstConfigRcPtr config;

  ocio::ConstColorSpaceRcPtr find(const std::string& space, const ColorConfig& of) const {
    const ocio::ConstColorSpaceRcPtr found = config->getColorSpace(space.c_str());
    if (!found)
      input_error("{} has no colour space '{}', expected one of {}", of.file().string(), space,
                  fmt::join(of.spaces(), ", "));
    return found;
  }
};

ColorConfig::ColorConfig(const fs::path& file) : file_(file), impl_(std::make_unique<Impl>()) {
  ocio::SetLoggingLevel(ocio::LOGGING_LEVEL_NONE);  // what matters comes as an exception
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) input_error("{}: expected an OpenColorIO configuration", file.string());
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

const ColorConfig& ColorConfig::current() {
  static const ColorConfig config = [] {
    const fs::path own = data_dir() / "data" / "color" / "config.ocio";
    const char* given = std::getenv("OCIO");
    if (!given || !*given) return ColorConfig(own);
    // Blender sets it for what it starts.
    if (is_later(given)) {
      fmt::print(stderr, "brdfc: {} is of version {}, later than OpenColorIO {} reads: taking {}\n", given,
                 stated_version(given), ocio::GetVersion(), own.string());
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

std::array<double, 3> ColorConfig::from_xyz(const Xyz& xyz) const {
  constexpr const char* kInterchange = "aces_interchange";
  if (!impl_->config->hasRole(kInterchange))
    input_error("{}: expected the role {}, which relates spaces to CIE XYZ", file_.string(), kInterchange);
  Image pixel;  // first the white
  pixel.width = pixel.height = 1;
  pixel.rgb = {1, 1, 1};
  convert(impl_->config->getProcessor(ocio::ROLE_SCENE_LINEAR, kInterchange), pixel);
  convert(impl_->config->getProcessor(xyz_of_aces(ocio::TRANSFORM_DIR_FORWARD)), pixel);
  for (std::size_t c = 0; c < 3; ++c) pixel.rgb[c] = float(pixel.rgb[c] * xyz[c]);
  convert(impl_->config->getProcessor(xyz_of_aces(ocio::TRANSFORM_DIR_INVERSE)), pixel);
  convert(impl_->config->getProcessor(kInterchange, ocio::ROLE_SCENE_LINEAR), pixel);
  return {pixel.rgb[0], pixel.rgb[1], pixel.rgb[2]};
}

void ColorConfig::to_display(Image& image, const std::string& view) const {
  const std::vector<std::string> known = views();
  if (std::find(known.begin(), known.end(), view) == known.end())
    input_error("{} has no view '{}', expected one of {}", file_.string(), view, fmt::join(known, ", "));
  const auto transform = ocio::DisplayViewTransform::Create();
  transform->setSrc(ocio::ROLE_SCENE_LINEAR);
  transform->setDisplay(impl_->config->getDefaultDisplay());
  transform->setView(view.c_str());
  convert(impl_->config->getProcessor(transform), image);
  for (float& v : image.rgb) v = std::clamp(v, 0.0f, 1.0f);
}

}  // namespace brdfc::reference
