// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/image.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <functional>

#include "core/error.h"
#include "core/text.h"
#include "core/write_beside.h"
#include "pictures/pictures.h"
#include "reference/color.h"

namespace brdfc::reference {

namespace fs = std::filesystem;

namespace {

constexpr int kMaxSide = 65536;
constexpr std::size_t kMaxPixels = std::size_t(1) << 30;

struct Channels {
  int r = -1, g = -1, b = -1;
};

int channel_index(const pictures::Header& header, const std::string& name) {
  const auto found = std::ranges::find(header.channels, name);
  return found == header.channels.end() ? -1 : int(found - header.channels.begin());
}

/// Selects the channels: R, G, B without a layer name; else those of the first layer that has all three; else the first
/// channel as grey.
Channels find_channels(const pictures::Header& header) {
  Channels c{channel_index(header, "R"), channel_index(header, "G"), channel_index(header, "B")};
  if (c.r >= 0 && c.g >= 0 && c.b >= 0) return c;
  for (const std::string& name : header.channels) {
    if (name.size() < 2 || name.substr(name.size() - 2) != ".R") continue;
    const std::string layer = name.substr(0, name.size() - 1);
    if (layer == "variance.") continue;
    c = {channel_index(header, layer + "R"), channel_index(header, layer + "G"), channel_index(header, layer + "B")};
    if (c.r >= 0 && c.g >= 0 && c.b >= 0) return c;
  }
  if (header.channels.size() <= 2) return {0, 0, 0};
  return {};
}

struct File {
  pictures::Header header;
  std::vector<float> data;  // interleaved channels

  Image extract(const Channels& c) const {
    Image image(header.width, header.height);
    const std::size_t pixels = std::size_t(header.width) * header.height;
    for (std::size_t i = 0; i < pixels; ++i) {
      const float* from = &data[i * header.channels.size()];
      image.rgb[3 * i] = from[c.r];
      image.rgb[3 * i + 1] = from[c.g];
      image.rgb[3 * i + 2] = from[c.b];
    }
    return image;
  }
};

struct Format {
  const char* name;
  std::vector<std::string> endings;
  std::vector<std::string> magic;  ///< a file of this format begins with one of these
};

const std::vector<Format>& formats() {
  static const std::vector<Format> all{
      {"OpenEXR", {".exr"}, {"\x76\x2f\x31\x01"}},
      {"Radiance", {".hdr"}, {"#?"}},
      {"PNG", {".png"}, {"\x89PNG"}},
      {"JPEG", {".jpg", ".jpeg"}, {"\xff\xd8"}},
      {"TIFF",
       {".tif", ".tiff"},
       {std::string("II*\0", 4), std::string("MM\0*", 4), std::string("II+\0", 4), std::string("MM\0+", 4)}}};
  return all;
}

/// The format whose magic number the file begins with; nullptr if it is none of formats().
const Format* format_of_content(const fs::path& path) {
  std::string start(4, '\0');
  std::ifstream(path, std::ios::binary).read(start.data(), std::streamsize(start.size()));
  for (const Format& f : formats())
    for (const std::string& magic : f.magic)
      if (start.starts_with(magic)) return &f;
  return nullptr;
}

/// OpenImageIO's message on one line.
std::string on_one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// Rejects an EXR file whose first header states that something is longer than the file: OpenEXR would reserve up to 2
/// GiB before it checks this.
void check_exr_header(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const auto size = std::int64_t(fs::file_size(path));
  in.seekg(8);  // skips magic number and version
  for (std::string name, type; std::getline(in, name, '\0') && !name.empty();) {
    std::array<unsigned char, 4> bytes{};
    std::getline(in, type, '\0');
    in.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
    const std::int64_t length = bytes[0] | bytes[1] << 8 | bytes[2] << 16 | std::int64_t(bytes[3]) << 24;
    if (!in || in.tellg() + length > size) input_error("{}: damaged image (its header does not end)", path.string());
    in.seekg(length, std::ios::cur);
  }
}

File read_file(const fs::path& path) {
  if (!fs::exists(path)) input_error("{}: no such image file", path.string());
  const std::string type = ending(path);
  std::vector<std::string> types;
  const Format* format = nullptr;
  for (const Format& f : formats())
    for (const std::string& e : f.endings) {
      types.push_back(e);
      if (e == type) format = &f;
    }
  if (!format) input_error("{}: expected an image file that ends in one of {}", path.string(), join(types, ", "));
  if (const Format* content = format_of_content(path); content != format)
    input_error("{}: not {} {} file, as its name says{}", path.string(), format->name[0] == 'O' ? "an" : "a",
                format->name, content ? fmt::format(", but {}", content->name) : "");
  if (type == ".exr") check_exr_header(path);
  // Uses only the reader for that file extension. Otherwise about thirty readers would try to open a damaged file.
  std::string reason;
  const QuietErrors quiet;  // libpng and libtiff also print the error themselves
  const auto in = pictures::open(path, reason, type.substr(1));
  if (!in) input_error("{}: damaged {} file: its header can't be read", path.string(), format->name);
  File file{in->header(), {}};
  const pictures::Header& h = file.header;
  const std::size_t channels = h.channels.size();
  if (h.width < 1 || h.height < 1 || h.width > kMaxSide || h.height > kMaxSide || h.depth > 1 || channels < 1 ||
      channels > 1024 || std::size_t(h.width) * h.height * channels > kMaxPixels)
    input_error("{}: {} x {} pixels with {} channels: expected a flat image with sides of at most {}", path.string(),
                h.width, h.height, channels, kMaxSide);
  // A few bytes may declare an image of gigabytes. None of the formats that are read here compresses a value to less
  // than a thousandth of its size; the densest codec, deflate, reaches at most 1 : 1032.
  const std::size_t values = std::size_t(h.width) * h.height * channels;
  if (values > (std::size_t(1) << 20) + 1032 * fs::file_size(path))
    input_error("{}: damaged image: {} x {} pixels with {} channels do not fit into {} bytes", path.string(), h.width,
                h.height, channels, fs::file_size(path));
  file.data.resize(values);
  if (in->read(file.data.data()))
    input_error("{}: damaged {} file: its pixels can't be read to the end", path.string(), format->name);
  return file;
}

void write_file(const fs::path& path, const pictures::Header& header, const std::vector<float>& data) {
  write_beside(path, [&](const fs::path& temporary) {
    if (const auto failed = pictures::write(temporary, header, data))
      input_error("{}: can't write{} ({})", path.string(), failed->unknown_format ? " this image format" : "",
                  on_one_line(failed->reason));
    // When OpenEXR closes a small file, it passes the last bytes to the operating system, and does not report if that
    // fails. So the file is read back.
    std::string reason;
    const auto back = pictures::open(temporary, reason);
    std::vector<float> same(data.size());
    if (!back || back->read(same.data()))
      input_error("{}: can't write (what was written can't be read: is the disk full?)", path.string());
  });
}

void expect_exr(const fs::path& path) {
  if (path.extension() != ".exr") input_error("{}: expected a file name that ends in .exr", path.string());
}

pictures::Header exr_header(int width, int height, std::vector<std::string> names) {
  pictures::Header header{width, height};
  header.channels = std::move(names);
  // OpenImageIO writes the present time unless one is set; with a fixed time equal pixels give equal files.
  header.attributes = {{"compression", "zip"}, {"DateTime", "1980:01:01 00:00:00"}};
  return header;
}

/// The working space that a file states for its colours; empty if it states none.
std::string stated_working_space(const pictures::Header& header, const fs::path& path) {
  const auto chromaticities = header.numbers("chromaticities", 8);
  const std::string id = header.text("colorInteropID");
  if (id.empty() && !chromaticities) return "";
  const auto same = [](float a, float b) { return std::abs(a - b) < 1e-4f; };
  std::vector<std::string> names;
  for (const WorkingSpace& s : working_spaces()) {
    if (id.empty() ? std::ranges::equal(*chromaticities, s.chromaticities, same) : id == s.interop_id) return s.name;
    names.push_back(s.name);
  }
  if (!id.empty()) input_error("{}: its colours are in '{}', expected one of {}", path.string(), id, join(names, ", "));
  input_error("{}: its colours have the chromaticities {}, expected those of one of {}", path.string(),
              join(*chromaticities, " "), join(names, ", "));
}

/// The current configuration with the working space of a rendering.
ColorConfig config_of(const Rendering& r) {
  const ColorConfig& current = ColorConfig::current();
  return current.with_working_space(r.working_space.empty() ? current.working_space() : r.working_space);
}

/// The primaries and white point that a file states for its colours; nullopt if it states none, or states that they are
/// not colours but data.
std::optional<Chromaticities> stated_primaries(const pictures::Header& header, const fs::path& path) {
  const std::string id = header.text("colorInteropID");
  if (id == "data" || id == "unknown") return std::nullopt;
  if (!id.empty()) {
    std::vector<std::string> known;
    for (const LinearSpace& s : linear_spaces()) {
      if (id == s.interop_id) return s.chromaticities;
      known.push_back(s.interop_id);
    }
    input_error("{}: its colours are in '{}', expected one of {}, or a \"colorspace\" that says what they are",
                path.string(), id, join(known, ", "));
  }
  Chromaticities stated;
  const auto numbers = header.numbers("chromaticities", stated.size());
  if (!numbers) return std::nullopt;
  std::ranges::copy(*numbers, stated.begin());
  // The chromaticities must span a triangle with an area, and the white must have a luminance.
  const double area =
      double(stated[2] - stated[0]) * (stated[5] - stated[1]) - double(stated[4] - stated[0]) * (stated[3] - stated[1]);
  if (!(std::abs(area) > 1e-6) || !(stated[7] > 0) ||
      !std::ranges::all_of(stated, [](float x) { return std::isfinite(x); }))
    input_error("{}: expected chromaticities of three primaries and a white, found {}", path.string(),
                join(stated, " "));
  return stated;
}

/// Replaces pixels that are not finite with black, as Cycles in Blender 5.2 does when it reads images. In 4.5 only the
/// channels concerned become 0.
void blacken_what_is_not_finite(Image& image, const std::string& name, std::vector<std::string>* notes) {
  std::size_t bad = 0, first = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    float* p = &image.rgb[i];
    if (std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2])) continue;
    if (bad++ == 0) first = i / 3;
    p[0] = p[1] = p[2] = 0;
  }
  if (bad && notes)
    notes->push_back(fmt::format("{}: {} NaN or infinite, the first at ({}, {}), taken for black as in Cycles", name,
                                 bad == 1 ? "1 pixel is" : fmt::format("{} pixels are", bad), first % image.width,
                                 first / image.width));
}

void check_finite(const Image& image, const std::string& name) {
  std::size_t bad = 0, first = 0;
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    if (!std::isfinite(image.rgb[i]) && bad++ == 0) first = i / 3;
  if (bad)
    input_error("{}: {} values are not finite, the first at pixel ({}, {})", name, bad, first % image.width,
                first / image.width);
}

}  // namespace

std::string ending(const fs::path& path) {
  std::string text = path.extension().string();
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

Rendering read_rendering(const fs::path& path) {
  const File file = read_file(path);
  if (!file.header.floating)
    input_error("{}: expected an image of floating-point numbers, such as .exr: these are encoded for a display",
                path.string());
  const Channels color = find_channels(file.header);
  if (color.r < 0)
    input_error("{}: expected channels R, G, B, found {}", path.string(), join(file.header.channels, ", "));
  Rendering rendering;
  rendering.mean = file.extract(color);
  const Channels variance{channel_index(file.header, "variance.R"), channel_index(file.header, "variance.G"),
                          channel_index(file.header, "variance.B")};
  if (variance.r >= 0 && variance.g >= 0 && variance.b >= 0) rendering.variance = file.extract(variance);
  rendering.working_space = stated_working_space(file.header, path);
  const std::string prefix = "brdfc:";
  for (const pictures::Attribute& attribute : file.header.attributes) {
    if (!attribute.name.starts_with(prefix)) continue;
    const std::string key = attribute.name.substr(prefix.size());
    if (const auto* text = std::get_if<std::string>(&attribute.value))
      rendering.metadata[key] = *text;
    else if (const auto* integer = std::get_if<int>(&attribute.value))
      rendering.metadata[key] = *integer;
    else if (const auto* number = std::get_if<float>(&attribute.value))
      rendering.metadata[key] = *number;
  }
  return rendering;
}

void write_rendering(const fs::path& path, const Rendering& rendering) {
  expect_exr(path);
  std::vector<std::string> names{"R", "G", "B"};
  if (rendering.variance) names.insert(names.end(), {"variance.R", "variance.G", "variance.B"});
  const Image& mean = rendering.mean;
  pictures::Header header = exr_header(mean.width, mean.height, names);
  for (const WorkingSpace& s : working_spaces())
    if (s.name == rendering.working_space) {
      header.attributes.push_back({"colorInteropID", s.interop_id});
      header.attributes.push_back(
          {"chromaticities", std::vector<float>(s.chromaticities.begin(), s.chromaticities.end())});
    }
  for (const auto& [key, value] : rendering.metadata.items()) {
    const std::string name = "brdfc:" + key;
    if (value.is_string())
      header.attributes.push_back({name, value.get<std::string>()});
    else if (value.is_number_integer())
      header.attributes.push_back({name, value.get<int>()});
    else if (value.is_number())
      header.attributes.push_back({name, value.get<float>()});
    else
      throw std::logic_error("metadata '" + key + "' must be a string or a number");
  }
  const std::size_t pixels = std::size_t(mean.width) * mean.height;
  std::vector<float> data;
  data.reserve(pixels * names.size());
  for (std::size_t i = 0; i < pixels; ++i) {
    data.insert(data.end(), &mean.rgb[3 * i], &mean.rgb[3 * i] + 3);
    if (rendering.variance)
      data.insert(data.end(), &rendering.variance->rgb[3 * i], &rendering.variance->rgb[3 * i] + 3);
  }
  write_file(path, header, data);
}

void to_working_space_of(Rendering& rendering, const Rendering& other) {
  if (rendering.working_space == other.working_space) return;
  const ColorConfig to = config_of(other);
  const std::string from = config_of(rendering).working_space();
  if (from != to.working_space()) {
    to.to_scene_linear(rendering.mean, from);
    rendering.variance.reset();
  }
  rendering.working_space = other.working_space;
}

Image read_image(const fs::path& path, const ColorConfig& colors, const std::string& space,
                 std::vector<std::string>* notes) {
  const File file = read_file(path);
  const Channels channels = find_channels(file.header);
  if (channels.r < 0)
    input_error("{}: expected channels R, G, B or one grey channel, found {}", path.string(),
                join(file.header.channels, ", "));
  Image image = file.extract(channels);
  blacken_what_is_not_finite(image, path.string(), notes);
  if (space == "srgb" || (space == "auto" && !file.header.floating)) {
    colors.srgb_to_scene_linear(image);
  } else if (space == "auto") {
    if (const auto primaries = stated_primaries(file.header, path)) colors.to_scene_linear(image, *primaries);
  } else if (space != "linear") {
    colors.to_scene_linear(image, space);
  }
  return image;
}

void write_image(const fs::path& path, const Image& image) {
  expect_exr(path);
  write_file(path, exr_header(image.width, image.height, {"R", "G", "B"}), image.rgb);
}

Comparison compare(const Rendering& a, const Rendering& b, const std::string& name_a, const std::string& name_b) {
  if (a.mean.width != b.mean.width || a.mean.height != b.mean.height)
    input_error("{} has {} x {} pixels, {} has {} x {}: expected equal sizes", name_a, a.mean.width, a.mean.height,
                name_b, b.mean.width, b.mean.height);
  check_finite(a.mean, name_a);
  check_finite(b.mean, name_b);
  Comparison c;
  const std::size_t count = a.mean.rgb.size();
  for (std::size_t i = 0; i < count; ++i) {
    const double x = a.mean.rgb[i], y = b.mean.rgb[i], d = x - y;
    c.rel_mse += d * d / (y * y + 0.01);
    c.mse += d * d;
    c.mean_a += x;
    c.mean_b += y;
    if (std::abs(d) > c.max) {
      c.max = std::abs(d);
      c.max_x = int(i / 3 % a.mean.width);
      c.max_y = int(i / 3 / a.mean.width);
    }
  }
  if (a.variance && b.variance) {
    check_finite(*a.variance, name_a + " (variance)");
    check_finite(*b.variance, name_b + " (variance)");
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += double(a.variance->rgb[i]) + b.variance->rgb[i];
    c.noise_mse = sum / double(count);
  }
  c.rel_mse /= double(count);
  c.mse /= double(count);
  c.mean_a /= double(count);
  c.mean_b /= double(count);
  c.bias = c.mean_a - c.mean_b;
  return c;
}

nlohmann::json to_json(const Comparison& c) {
  nlohmann::json j{{"relmse", c.rel_mse}, {"mse", c.mse}, {"mean_a", c.mean_a}, {"mean_b", c.mean_b},
                   {"bias", c.bias},      {"max", c.max}, {"max_x", c.max_x},   {"max_y", c.max_y}};
  j["noise_mse"] = c.noise_mse ? nlohmann::json(*c.noise_mse) : nlohmann::json(nullptr);
  return j;
}

Image difference_image(const Image& a, const Image& b, double scale) {
  if (a.width != b.width || a.height != b.height) throw std::logic_error("difference of images of different size");
  double mean = 0;
  for (float v : b.rgb) mean += v;
  mean /= double(b.rgb.size());
  const double full = std::max(scale * mean, 1e-12);
  Image out(a.width, a.height);
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      const double d = std::clamp((luminance(a.color(x, y)) - luminance(b.color(x, y))) / full, -1.0, 1.0);
      float* p = out.pixel(x, y);
      const float fade = float(1 - std::abs(d));
      p[0] = d > 0 ? 1.0f : fade;
      p[1] = fade;
      p[2] = d < 0 ? 1.0f : fade;
    }
  return out;
}

void write_display(const fs::path& path, const Image& display) {
  if (path.extension() != ".png") input_error("{}: expected a file name that ends in .png", path.string());
  pictures::Header header{display.width, display.height};
  header.channels = {"R", "G", "B"};
  header.floating = false;
  header.attributes = {{"oiio:ColorSpace", "sRGB"}};
  write_file(path, header, display.rgb);
}

void write_preview(const fs::path& path, const Rendering& rendering, double exposure, const std::string& view) {
  Image display = rendering.mean;
  const double gain = std::exp2(exposure);
  for (float& v : display.rgb) v = float(gain * v);
  config_of(rendering).to_display(display, view);
  write_display(path, display);
}

Rgb<double> bilinear(const Image& image, double u, double v, Wrap horizontal, Wrap vertical) {
  // Coordinates are in this tile or a neighbouring one, so no division is needed.
  const auto index = [](int i, int size, Wrap wrap) {
    if (i < 0) return wrap == Wrap::Clamp ? 0 : size - 1;
    if (i >= size) return wrap == Wrap::Clamp ? size - 1 : 0;
    return i;
  };
  const auto part = [](double z) { return z >= 0 && z < 1 ? z : z - std::floor(z); };
  const double x = part(u) * image.width - 0.5;
  const double fraction = vertical == Wrap::Repeat ? part(v) : std::clamp(v, 0.0, 1.0);
  const double y = (1 - fraction) * image.height - 0.5;
  // Rounds down; for coordinates below -1/2, truncation rounds up.
  const int column = int(x) - (x < 0), row = int(y) - (y < 0);
  const double s = x - column, t = y - row;
  const int x0 = index(column, image.width, horizontal), x1 = index(column + 1, image.width, horizontal);
  const int y0 = index(row, image.height, vertical), y1 = index(row + 1, image.height, vertical);
  const double w00 = (1 - s) * (1 - t), w10 = s * (1 - t), w01 = (1 - s) * t, w11 = s * t;
  const float *p00 = image.pixel(x0, y0), *p10 = image.pixel(x1, y0), *p01 = image.pixel(x0, y1),
              *p11 = image.pixel(x1, y1);
  return {w00 * p00[0] + w10 * p10[0] + w01 * p01[0] + w11 * p11[0],
          w00 * p00[1] + w10 * p10[1] + w01 * p01[1] + w11 * p11[1],
          w00 * p00[2] + w10 * p10[2] + w01 * p01[2] + w11 * p11[2]};
}

}  // namespace brdfc::reference
