// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include "app/commands.h"
#include "app/scene_needs.h"
#include "reference/scene.h"

namespace brdfc::app {

void add_scene_command(Command app) {
  struct Options {
    std::string scene, out;
  };
  auto options = std::make_shared<Options>();
  const Command command = app.add_subcommand(
      "scene", "Writes a scene with its meshes as .npy and its images as .exr, to be loaded in another program");
  command.add_option("SCENE", options->scene, "Scene file (.json)").required();
  command.add_option("--out", options->out, "Folder to write scene.json to").required();
  command.callback([options] {
    const reference::Scene scene = load_scene(options->scene);
    print_notes(scene.notes);
    reference::require_models(scene.materials);
    reference::write_resolved(scene, options->out);
    fmt::print(stderr, "{}: {} objects, {} meshes, {} images, hash {} -> {}\n", scene.name, scene.objects.size(),
               scene.mesh_files.size(), scene.image_files.size(), scene.hash,
               (std::filesystem::path(options->out) / "scene.json").string());
  });
}

}  // namespace brdfc::app
