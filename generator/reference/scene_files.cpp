// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/scene_files.h"

#include <OpenImageIO/hash.h>

#include <algorithm>

#include "core/text.h"

namespace brdfc::reference {

namespace fs = std::filesystem;

namespace {

class Hasher {
 public:
  template <class T> void add(const std::vector<T>& data) {
    const std::uint64_t size = data.size();
    state_ = OIIO::xxhash::XXH64(&size, sizeof(size), state_);
    state_ = OIIO::xxhash::XXH64(data.data(), data.size() * sizeof(T), state_);
  }
  void add(const std::string& text) { state_ = OIIO::xxhash::XXH64(text.data(), text.size(), state_); }
  std::string hex() const { return fmt::format("{:016x}", state_); }

 private:
  unsigned long long state_ = 0;
};

std::string mesh_name(const Mesh& mesh) {
  Hasher hash;
  hash.add(mesh.vertices);
  hash.add(mesh.normals);
  hash.add(mesh.uvs);
  hash.add(mesh.triangles);
  return "mesh_" + hash.hex();
}

std::string image_name(const Image& image) {
  Hasher hash;
  hash.add(std::vector<int>{image.width, image.height});
  hash.add(image.rgb);
  return "image_" + hash.hex() + ".exr";
}

}  // namespace

std::string short_hash(const std::string& text) {
  Hasher hash;
  hash.add(text);
  return hash.hex();
}

fs::path SceneFiles::beside(const std::string& name) const {
  const fs::path file(name);
  return file.is_absolute() ? file : path_.parent_path() / file;
}

void SceneFiles::read_working_space(const JsonView& j) {
  std::vector<std::string> names;
  for (const WorkingSpace& s : working_spaces()) names.push_back(s.name);
  scene.resolved["working_space"] = scene.working_space = j.choice(names);
  try {
    with_working_space_.emplace(ColorConfig::current().with_working_space(scene.working_space));
  } catch (const InputError& e) {
    j.error(e.what());
  }
}

void SceneFiles::note(const std::string& text) {
  if (std::ranges::find(scene.notes, text) == scene.notes.end()) scene.notes.push_back(text);
}

std::shared_ptr<const Image> SceneFiles::keep(Image image, std::string& name) {
  name = image_name(image);
  auto& slot = scene.image_files[name];
  if (!slot) slot = std::make_shared<const Image>(std::move(image));
  return slot;
}

std::shared_ptr<const Mesh> SceneFiles::keep(Mesh mesh, std::string& stem) {
  stem = mesh_name(mesh);
  auto& slot = scene.mesh_files[stem];
  if (!slot) slot = std::make_shared<const Mesh>(std::move(mesh));
  return slot;
}

Image SceneFiles::read_picture(const JsonView& j, const std::string& space) {
  std::vector<std::string> notes;
  Image image = read_file(j, [&](const fs::path& f) { return read_image(f, colors(), space, &notes); });
  for (const std::string& text : notes) note(text);
  return image;
}

std::string SceneFiles::read_colorspace(const JsonView& j) const {
  const auto v = j.find("colorspace");
  if (!v) return "auto";
  const std::string space = v->text();
  std::vector<std::string> known{"auto", "linear", "srgb"};
  if (std::ranges::find(known, space) != known.end() || colors().has_space(space)) return space;
  for (const std::string& name : colors().spaces()) known.push_back(name);
  v->fail(fmt::format("one of {}", join(known, ", ")));
}

}  // namespace brdfc::reference
