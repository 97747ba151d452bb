// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/addon.h"

#include <fmt/format.h>

#include <cctype>
#include <fstream>
#include <sstream>

#include "core/error.h"

namespace brdfc::pack {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "blender_manifest.toml";
constexpr const char* kTranslations = "translations";
constexpr const char *kId = "brdfc_shaders", *kName = "brdfc Shaders";

/// The text in small letters and digits, with single underscores for all other characters.
std::string slug(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool letter = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (letter)
      out += char(std::tolower(static_cast<unsigned char>(c)));
    else if (!out.empty() && out.back() != '_')
      out += '_';
  }
  while (!out.empty() && out.back() == '_') out.pop_back();
  return out;
}

}  // namespace

void stamp(std::string& manifest, const fs::path& path, const char* key, const std::string& before,
           const std::string& after) {
  const std::string line = fmt::format("\n{} = {}\n", key, before);
  const std::size_t at = manifest.find(line);
  if (at == std::string::npos) input_error("{}: expected the line {} = {}", path.string(), key, before);
  manifest.replace(at, line.size(), fmt::format("\n{} = {}\n", key, after));
}

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) input_error("{}: cannot be read", path.string());
  return text.str();
}

std::string extension_id(const std::string& cut) {
  if (cut.empty()) return kId;
  const std::string own = slug(cut);
  return fmt::format("{}_{}", kId, own.empty() ? "scene" : own);
}

std::map<std::string, std::string> addon_files(const fs::path& folder, const std::string& cut) {
  if (!fs::exists(folder / kManifest))
    input_error("{}: expected the add-on's folder with {}", folder.string(), kManifest);
  std::map<std::string, std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).generic_string();
    const std::string kind = entry.path().extension().string();
    const bool words = entry.path().parent_path().filename() == kTranslations && kind == ".json";
    // The library of ready-made materials uses all models, so only a pack of everything has it.
    const bool of_library = cut.empty() && name.starts_with("library/") && (kind == ".json" || kind == ".jpg");
    if (words || of_library || kind == ".py") files[name] = read_text(entry.path());
  }
  std::string& manifest = files[kManifest] = read_text(folder / kManifest);
  const fs::path path = folder / kManifest;
  stamp(manifest, path, "version", quoted("@version@"), quoted(BRDFC_VERSION));
  if (!cut.empty()) {
    const std::string id = extension_id(cut);
    stamp(manifest, path, "id", quoted(kId), quoted(id));
    stamp(manifest, path, "name", quoted(kName),
          quoted(fmt::format("{} ({})", kName, id.substr(std::string(kId).size() + 1))));
  }
  return files;
}

}  // namespace brdfc::pack
