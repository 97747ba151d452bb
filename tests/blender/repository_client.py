# SPDX-License-Identifier: GPL-3.0-or-later
"""A separate Blender that installs the extension from a repository over HTTP; test_repository.py
runs it.

    python repository_client.py RESOURCES ROOT STAGE...

ROOT contains a folder for each stage, with index.json and zips. A local server serves these folders
one after the other; the client looks for updates and installs what it finds. If a stage ends in
":torn", the server drops the connection halfway through a zip; if it ends in ":altered", it changes
a byte. Prints a JSON list with the state after each stage.
"""

import contextlib
import hashlib
import http.server
import json
import os
import sys
import tempfile
import threading
from pathlib import Path

PACKAGE_ID = "brdfc_shaders"


class Handler(http.server.BaseHTTPRequestHandler):
    """Serves the files of `folder`, and zips in the `manner` of the stage."""

    folder, manner = None, ""

    def do_GET(self):
        path = self.folder / self.path.split("?")[0].lstrip("/")
        if not path.is_file():
            self.send_error(404)
            return
        data = path.read_bytes()
        self.send_response(200)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        half = len(data) // 2
        if path.suffix == ".zip" and self.manner == "torn":
            data = data[:half]
            self.close_connection = True
        elif path.suffix == ".zip" and self.manner == "altered":
            data = data[:half] + bytes([data[half] ^ 1]) + data[half + 1 :]
        self.wfile.write(data)

    def log_message(self, *_):
        pass


def attempt(operator, **arguments):
    """The error message of an operator; "" if it finishes."""
    try:
        return "" if "FINISHED" in operator(**arguments) else "did not finish"
    except RuntimeError as error:
        return str(error)


def state(bpy, repository):
    folder = Path(repository.directory) / PACKAGE_ID
    module = f"bl_ext.{repository.module}.{PACKAGE_ID}"
    found = {
        "beside": sorted(p.name for p in folder.parent.iterdir() if not p.name.startswith(".")),
        "files": {
            p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest()
            for p in folder.rglob("*")
            if p.is_file() and p.suffix != ".pyc"
        },
        "enabled": module in bpy.context.preferences.addons,
    }
    if api := sys.modules.get(f"{module}.api"):
        found["marks"] = getattr(api, "MARK", None)
        scene = bpy.context.scene
        kept = bpy.data.materials.get("Kept") or api.new_material("phong", e=20.0)
        kept.name = "Kept"
        fresh = api.new_material("ward", ax=0.25)
        found["values"] = [api.get_parameters(kept)["e"], api.get_parameters(fresh)["ax"]]
        found["codes"] = sorted({w.code for w in api.warnings(kept, scene)})
        bpy.data.materials.remove(fresh)
    return found


def main():
    resources, root, *stages = sys.argv[1:]
    os.environ["BLENDER_USER_RESOURCES"] = resources
    # Blender leaves the bytecode of each script that it compiles in the folder for temporary files.
    tempfile.tempdir = resources
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.cycles.device = "CPU"
    bpy.context.scene.cycles.shading_system = True
    bpy.context.preferences.system.use_online_access = True
    bpy.ops.preferences.addon_enable(module="bl_pkg")

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    bpy.ops.preferences.extension_repo_add(
        name="Local",
        remote_url=f"http://127.0.0.1:{server.server_port}/index.json",
        type="REMOTE",
    )
    repositories = bpy.context.preferences.extensions.repos
    repository = repositories["Local"]
    # Excludes Blender's own repositories.
    for other in repositories:
        other.enabled = other == repository

    result = []
    for i, stage in enumerate(stages):
        name, _, Handler.manner = stage.partition(":")
        Handler.folder = Path(root) / name
        said = [attempt(bpy.ops.extensions.repo_sync, repo_directory=repository.directory)]
        if i == 0:
            install = bpy.ops.extensions.package_install
            where = {"repo_directory": repository.directory, "pkg_id": PACKAGE_ID}
            said.append(attempt(install, **where, enable_on_install=True))
        else:
            said.append(attempt(bpy.ops.extensions.package_upgrade_all))
        result.append({"said": said, **state(bpy, repository)})
    return result


if __name__ == "__main__":
    with contextlib.redirect_stdout(sys.stderr):
        saved = os.dup(1)
        os.dup2(2, 1)  # output of Blender's native code
        answer = main()
    os.dup2(saved, 1)
    os.write(1, json.dumps(answer).encode())
