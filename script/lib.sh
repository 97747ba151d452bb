# SPDX-License-Identifier: GPL-3.0-or-later
# Common functions of the scripts: messages, installs that are skipped when nothing is missing, builds. Sourced by bash.
# shellcheck shell=bash disable=SC2034

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
BUILD=$ROOT/build
ENVS=$(realpath -m "$ROOT/.env") # where it is, if it is a link: the programs in environments contain that path
TOOL=$BUILD/brdfc
# The oiiotool of the tools' environment, because the first in PATH may be any version.
OIIOTOOL=$ENVS/tools/bin/oiiotool

# An inherited PYTHONPATH or virtual environment would leak packages into ours (and break that of bpy). Evidence is made with
# modules of script/.
unset PYTHONHOME VIRTUAL_ENV
export PYTHONPATH=$ROOT/script PYTHONNOUSERSITE=1

say() { printf '\n==> %s\n' "$*"; }
note() { printf '    %s\n' "$*"; }
die() {
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}
usage_error() {
  printf '%s: %s (see --help)\n' "$(basename "$0")" "$*" >&2
  exit 2
}

# print_help: the comment at the top of the calling script, between its second line and the first line of code.
print_help() { sed -n '3,/^[^#]/{/^#/!d;s/^# \{0,1\}//;p}' "$0"; }

version() { sed -n 's/^project(brdfc VERSION \([0-9.]*\).*/\1/p' "$ROOT/CMakeLists.txt"; }
all_scenes() { find "$ROOT/scenes" -name '*.json' ! -name schema.json | LC_ALL=C sort; }
extension_zip() { printf '%s/brdfc_shaders-%s.zip' "$BUILD" "$(version)"; }

# ---- Debian packages -------------------------------------------------------------------------------------

install_packages() { # install_packages PACKAGE...: those that are missing, through apt-get
  if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    note "no apt-get here: install the equivalents of script/packages.txt by hand if the build misses something"
    return
  fi
  local package missing=()
  for package in "$@"; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  local as_root=()
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null ||
      die "Debian packages are missing and neither root nor sudo is available; run as root: apt-get install ${missing[*]}"
    as_root=(sudo)
  fi
  say "Installing Debian packages: ${missing[*]}"
  "${as_root[@]}" apt-get update -qq || die "apt-get update failed"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null ||
    die "apt-get could not install: ${missing[*]}"
}

setup_packages() {
  local packages
  mapfile -t packages < <(sed 's/#.*//' "$ROOT/script/packages.txt" | grep -o '[^[:space:]]\+')
  install_packages "${packages[@]}"
}

# ---- Python environments ---------------------------------------------------------------------------------

# find_python 3.13: prints an interpreter of that version that runs and can make virtual environments. A pyenv
# shim exists for versions that are not selected, and then only prints an error: so each candidate is tried.
find_python() {
  local candidate pyenv_root=${PYENV_ROOT:-$HOME/.pyenv}
  while read -r candidate; do
    if [ -n "$candidate" ] && [ -x "$candidate" ] && "$candidate" - "$1" >/dev/null 2>&1 <<'PY'; then
import ensurepip, sys, venv
sys.exit("%d.%d" % sys.version_info[:2] != sys.argv[1])
PY
      printf '%s\n' "$candidate"
      return 0
    fi
  done < <(
    type -aP "python$1"
    compgen -G "$pyenv_root/versions/$1*/bin/python$1"
    command -v uv >/dev/null && uv python find "$1" 2>/dev/null
  )
  return 1
}

# env_is_ready FOLDER STAMP: whether it has those requirements, and its interpreter and programs run. Programs of an environment
# begin with the path of its interpreter, which is no longer there when the environment has been moved.
env_is_ready() {
  [ "$(cat "$1/.stamp" 2>/dev/null)" = "$2" ] && "$1/bin/python" -c '' 2>/dev/null &&
    [ -x "$(sed -n '1s/^#!//p' "$1/bin/pip" 2>/dev/null)" ]
}

# setup_env NAME PYTHON-VERSION: makes .env/NAME from script/requirements/NAME.txt. Does nothing, and uses no network,
# if the requirements are those of the stamp. Returns 1 if there is no such interpreter.
setup_env() {
  local name=$1 wanted=$2 env=$ENVS/$1 requirements=$ROOT/script/requirements/$1.txt python stamp
  stamp="$wanted $(sha256sum <"$requirements")"
  env_is_ready "$env" "$stamp" && return 0
  python=$(find_python "$wanted") || return 1
  mkdir -p "$ENVS"
  (
    # Two scripts at once could delete the environment while the other's pip runs, which then installs elsewhere.
    flock 9
    ! env_is_ready "$env" "$stamp" || exit 0
    say "Making Python environment .env/$name ($python; $(grep -v '^#' "$requirements" | tr '\n' ' '))"
    rm -rf "$env"
    "$python" -m venv "$env" || die "could not make the Python environment $env"
    "$env/bin/python" -m pip install --disable-pip-version-check --quiet -r "$requirements" ||
      die "pip could not install $requirements (if its index lacks a package, give another one in PIP_EXTRA_INDEX_URL)"
    printf '%s\n' "$stamp" >"$env/.stamp"
  ) 9>"$ENVS/.lock" || exit
}

# setup_blender 4.5: makes an environment with that Blender. If its interpreter is missing, prints that and returns 1.
setup_blender() {
  case $1 in
    4.5 | 5.0)
      find_python 3.11 >/dev/null || install_packages python3.11 python3.11-venv
      setup_env "blender-$1" 3.11 || die "Blender $1 needs Python 3.11: none was found"
      ;;
    5.2)
      setup_env blender-5.2 3.13 || {
        say "SKIPPED: Blender 5.2 needs a Python 3.13 interpreter, and none was found"
        return 1
      }
      ;;
    *) die "unknown Blender version $1" ;;
  esac
}

# blender_ext COMMAND...: runs Blender 4.5's own extension tool, a script in its wheel.
blender_ext() {
  local scripts=("$ENVS"/blender-4.5/lib/python3*/site-packages/bpy/4.5/scripts)
  "$ENVS/blender-4.5/bin/python" "${scripts[0]}/addons_core/bl_pkg/cli/blender_ext.py" "$@"
}

setup_tools() {
  find_python 3.11 >/dev/null || install_packages python3.11 python3.11-venv
  setup_env tools 3.11 || die "Python 3.11 was not found"
}

# setup_farm: installs Dask, for renders on several machines.
setup_farm() {
  find_python 3.11 >/dev/null || install_packages python3.11 python3.11-venv
  setup_env farm 3.11 || die "Python 3.11 was not found"
}

# setup_page: installs what makes pages: Jinja, and Matplotlib for their charts.
setup_page() {
  find_python 3.11 >/dev/null || install_packages python3.11 python3.11-venv
  setup_env page 3.11 || die "Python 3.11 was not found"
}

# make_page report|stability DIR: writes DIR/index.html about what `brdfc report DIR`, or `brdfc stability --maps DIR`, wrote
# there.
make_page() { "$ENVS/page/bin/python" -m "pages.$1" "$2"; }

# ---- build -----------------------------------------------------------------------------------------------

# slowest_sources FOLDER: the five sources in FOLDER that took longest to compile, in seconds of processor time, and the sum of
# all. Sources that were in the compiler cache take almost no time.
slowest_sources() {
  [ -f "$1/compile_times" ] || return 0
  note "The slowest sources of ${1#"$ROOT"/}, in seconds of processor time:"
  awk -F '\t' '{ seconds[$2] = $1 }
    END { for (object in seconds) { sum += seconds[object]; ++count; printf "%8.1f  %s\n", seconds[object], object }
          printf "%8.1f  all %d sources\n", sum, count }' "$1/compile_times" |
    sort -rn | sed -n -e 's,CMakeFiles/,,' -e 's,\.o$,,' -e 1,6p  # reads all, or else sort would fail now and then
}

build_preset() { # build_preset PRESET [TARGET...]
  local preset=$1 log=$BUILD/logs/configure-$1.log
  shift
  mkdir -p "$BUILD/logs"
  cd "$ROOT" || return
  cmake --preset "$preset" >"$log" 2>&1 || {
    cat "$log" >&2
    return 1
  }
  cmake --build --preset "$preset" ${1:+--target "$@"}
}
