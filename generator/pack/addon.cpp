// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/addon.h"

#include <fstream>
#include <sstream>

#include "core/error.h"

namespace brdfc::pack {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "blender_manifest.toml";

std::string stamped(std::string manifest, const fs::path& path) {
  const std::string line = "version = \"@version@\"";
  const std::size_t at = manifest.find(line);
  if (at == std::string::npos) input_error("{}: expected the line {}", path.string(), line);
  return manifest.replace(at, line.size(), std::string("version = \"") + BRDFC_VERSION + "\"");
}

}  // namespace

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) input_error("{}: cannot be read", path.string());
  return text.str();
}

std::map<std::string, std::string> addon_files(const fs::path& folder) {
  if (!fs::exists(folder / kManifest))
    input_error("{}: expected the add-on's folder with {}", folder.string(), kManifest);
  std::map<std::string, std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).generic_string();
    if (entry.path().extension() == ".py") files[name] = read_text(entry.path());
  }
  files[kManifest] = stamped(read_text(folder / kManifest), folder / kManifest);
  return files;
}

}  // namespace brdfc::pack
