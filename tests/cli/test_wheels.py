# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheels of script/release: their contents, and both of them in a new environment."""

import importlib.metadata
import json
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
from support import MODELS, ROOT, TOOL

#: Making the wheels takes most of the time of these tests.
pytestmark = pytest.mark.together("wheels")

VERSION = re.search(r"project\(brdfc VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]

sys.path.insert(0, str(ROOT / "python" / "tool"))
import brdfc_tool  # noqa: E402


def succeeded(command, **options):
    done = subprocess.run(command, capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """Both wheels, by name."""
    out = tmp_path_factory.mktemp("wheels")
    succeeded([ROOT / "script" / "release", "--wheels", out])
    return {path.name.split("-")[0]: path for path in out.iterdir()}


@pytest.fixture(scope="module")
def environment(wheels, tmp_path_factory):
    """A new environment in which `pip install FOLDER/*.whl` installed these wheels, without a
    network. Of the packages installed here, it has only NumPy."""
    folder = tmp_path_factory.mktemp("environment")
    succeeded([sys.executable, "-m", "venv", "--without-pip", folder / "venv"])
    numpy = folder / "numpy"
    numpy.mkdir()
    installed = importlib.metadata.distribution("numpy")
    for name in {Path(file).parts[0] for file in installed.files} - {".."}:
        (numpy / name).symlink_to(installed.locate_file(name))
    python = folder / "venv" / "bin" / "python"
    site = succeeded([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"])
    Path(site.strip(), "numpy.pth").write_text(f"{numpy}\n")
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "--no-index"]
    succeeded([*pip, *wheels.values()])
    return folder / "venv"


def run(environment, *arguments, **options):
    """Runs a program as in an activated environment without other settings."""
    path = f"{environment / 'bin'}:/usr/bin:/bin"
    return subprocess.run(
        [shutil.which(arguments[0], path=path), *arguments[1:]],
        capture_output=True,
        text=True,
        cwd=environment,
        env={"PATH": path},
        **options,
    )


@pytest.mark.slow
def test_that_of_the_package_is_python_alone(wheels):
    assert wheels["brdfc"].name == f"brdfc-{VERSION}-py3-none-any.whl"
    with zipfile.ZipFile(wheels["brdfc"]) as archive:
        names = archive.namelist()
        for name in names:
            if name.endswith(".py"):
                assert archive.read(name).startswith(b"# SPDX-License-Identifier: GPL-3.0-or-later")
    assert {f"brdfc/models/{name}.py" for name in MODELS} <= set(names)
    assert any(name.endswith("LICENSE") for name in names)
    assert all(name.endswith((".py", ".typed")) or ".dist-info/" in name for name in names)


@pytest.mark.slow
def test_that_of_the_tool_is_what_is_built_and_its_data(wheels):
    platform = re.sub(r"\W", "_", sysconfig.get_platform())
    assert wheels["brdfc_tool"].name == f"brdfc_tool-{VERSION}-py3-none-{platform}.whl"
    with zipfile.ZipFile(wheels["brdfc_tool"]) as archive:
        names = set(archive.namelist())
        built = {
            "bin/brdfc": "brdfc",
            "lib/brdfc/brdfc_pictures.so": "brdfc_pictures.so",
        }
        for file, name in built.items():
            assert (
                archive.read(f"brdfc_tool/tree/{file}") == Path(ROOT / "build", name).read_bytes()
            )
        assert archive.getinfo("brdfc_tool/tree/bin/brdfc").external_attr >> 16 & 0o111 == 0o111
    share = {"data", "blender_addon", "explorer", "scenes"}
    kept = succeeded(["git", "ls-files", "-z", *share], cwd=ROOT).split("\0")[:-1]
    assert {f"brdfc_tool/tree/share/brdfc/{file}" for file in kept} <= names


@pytest.mark.slow
def test_the_package_works_in_a_new_environment(environment):
    """No model is loaded before it is used."""
    code = (
        "import sys, brdfc\n"
        "loaded = [m for m in sys.modules if m.startswith('brdfc.models.')]\n"
        "f = brdfc.model('ward').eval([[0, 0, 1]] * 2, [0, 0, 1], ax=.1)\n"
        "print(brdfc.__version__, len(brdfc.models()), loaded, f.shape, brdfc.__file__)"
    )
    done = run(environment, "python", "-c", code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"{VERSION} {len(MODELS)} [] (2, 3) {environment}")


@pytest.mark.slow
def test_the_tool_works_in_a_new_environment(environment, tmp_path):
    """With its own data. It is where the extension looks: on the PATH, and where pip installs
    programs for the running Python."""
    assert shutil.which("brdfc", path=environment / "bin")
    scripts = "import sysconfig; print(sysconfig.get_path('scripts'))"
    assert run(environment, "python", "-c", scripts).stdout.strip() == str(environment / "bin")
    assert run(environment, "brdfc", "--version").stdout.strip() == VERSION
    listed = json.loads(run(environment, "brdfc", "list", "--json").stdout)
    assert [model["name"] for model in listed] == MODELS
    where = Path(run(environment, "brdfc", "where").stdout.strip())
    assert where.is_relative_to(environment) and (where / "data" / "fits").is_dir()
    done = run(environment, "brdfc", "build", "--model", "coupled", "--out", tmp_path)
    assert (done.returncode, list(tmp_path.glob("*.zip")) != []) == (0, True), done.stderr
    assert "no stored" not in done.stderr
    done = run(environment, "brdfc", "eval", "lambert", "rho=2")
    assert (done.returncode, done.stdout) == (2, "") and "rho" in done.stderr


@pytest.mark.slow
def test_what_is_missing_is_said(environment, tmp_path, monkeypatch):
    """Reports missing libraries by name; likewise a missing loader."""
    (tool,) = environment.glob("lib/python3*/site-packages/brdfc_tool")
    copy = shutil.copytree(tool, tmp_path / "brdfc_tool")
    program = copy / "tree" / "bin" / "brdfc"
    right = program.read_bytes()
    call = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import brdfc_tool as t; "

    def said(change):
        program.write_bytes(change(right))
        done = run(environment, "python", "-c", call + "sys.argv[1:] = ['--version']; t.main()")
        assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
        return done.stderr

    wrong = said(lambda b: b.replace(b"libembree3.so.3\0", b"libembree3.so.9\0"))
    assert wrong.startswith("brdfc: shared libraries are missing: libembree3.so.9; on Debian 12: ")
    assert wrong.endswith(f"install {' '.join(sorted(set(brdfc_tool.PACKAGES.values())))}\n")
    # A library that this system has, where the loader does not look: the wheel knows its package.
    program.write_bytes(right)
    known = call + "t.PACKAGES['libembree3.so.9'] = 'libembree3-9'; sys.argv[1:] = []; t.main()"
    program.write_bytes(right.replace(b"libembree3.so.3\0", b"libembree3.so.9\0"))
    assert run(environment, "python", "-c", known).stderr.endswith("install libembree3-9\n")
    wrong = said(lambda b: b.replace(b"/ld-linux-x86-64.so.2\0", b"/ld-linux-x86-65.so.2\0"))
    assert "expected a system like that on which this wheel was built" in wrong


@pytest.mark.skipif(not shutil.which("dpkg-query"), reason="packages are those of Debian")
def test_the_packages_that_are_named_hold_the_libraries():
    """All libraries that the program and its module are linked to, except the C library, which
    every system has."""
    read = ["readelf", "--dynamic", "--wide", TOOL, Path(TOOL).with_name("brdfc_pictures.so")]
    linked = re.findall(r"NEEDED.*\[(.*)\]", succeeded(read))
    everywhere = {"libc.so.6", "libm.so.6", "libmvec.so.1", "libgcc_s.so.1"}
    assert set(linked) - everywhere == set(brdfc_tool.PACKAGES)
    files = [f"*/{library}*" for library in brdfc_tool.PACKAGES]
    owners = succeeded(["dpkg-query", "-S", *files])
    for library, package in brdfc_tool.PACKAGES.items():
        assert re.search(rf"^{re.escape(package)}:.*/{re.escape(library)}", owners, re.M), library
    page = (ROOT / "docs" / "reference.md").read_text(encoding="utf-8").replace("\\\n", "")
    (install,) = re.findall(r"^    apt-get install --no-install-recommends (.*)$", page, re.M)
    assert install.split() == sorted(set(brdfc_tool.PACKAGES.values()))
