#!/usr/bin/env bash
# What Python packages cannot bring: uv, and the system libraries that the gmsh wheel loads;
# with --tests also what only tests use: the library of the openseespy wheel, and a browser for the report page.
set -euo pipefail
cd "$(dirname "$0")/.."

gmsh_packages="libglu1-mesa libgl1 libxrender1 libxcursor1 libxft2 libxinerama1 libgomp1"
gmsh_libraries="libGLU.so.1 libGL.so.1 libXrender.so.1 libXcursor.so.1 libXft.so.2 libXinerama.so.1 libgomp.so.1"

missing_libraries() {
    local library known
    known="$(/sbin/ldconfig -p)"
    for library in "$@"; do
        [[ "$known" == *"$library"* ]] || echo -n "$library "
    done
}

install_packages() {
    local as_root=""
    if [ "$(id -u)" != 0 ]; then
        command -v sudo >/dev/null || { echo "type as root: apt-get install -y $*" >&2; exit 1; }
        as_root="sudo"
    fi
    echo "installing system packages: $*" >&2
    $as_root apt-get update -qq
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

# need_libraries NAME "LIBRARIES" "DEBIAN PACKAGES"
need_libraries() {
    local missing
    # shellcheck disable=SC2086
    missing="$(missing_libraries $2)"
    [ -z "$missing" ] && return
    if ! command -v apt-get >/dev/null; then
        echo "$1 needs these system libraries: $missing" >&2
        echo "install them with your package manager (Debian names: $3)" >&2
        exit 1
    fi
    # shellcheck disable=SC2086
    install_packages $3
}

# without one the tests of the page are skipped, so a machine that offers none still runs all others
need_browser() {
    local name
    for name in chromium-headless-shell chromium chromium-browser google-chrome google-chrome-stable; do
        command -v "$name" >/dev/null && return
    done
    if command -v apt-get >/dev/null; then
        (install_packages chromium-headless-shell) || (install_packages chromium) || true
    fi
    command -v chromium-headless-shell >/dev/null || command -v chromium >/dev/null ||
        echo "no Chromium could be installed: the tests of the report page in a browser are skipped" >&2
}

if [ "$(uname)" = Linux ]; then
    need_libraries gmsh "$gmsh_libraries" "$gmsh_packages"
    if [ "${1:-}" = --tests ]; then
        need_libraries openseespy libblas.so.3 libblas3
        need_browser
    fi
fi

export PATH="$PWD/.uv/bin:$HOME/.local/bin:$PATH"
if ! command -v uv >/dev/null; then
    # A Debian Python comes without pip and venv; a folder of our own touches nothing else on the machine.
    if ! python3 -c "import ensurepip, venv" 2>/dev/null && command -v apt-get >/dev/null; then
        install_packages python3-venv
    fi
    python3 -m venv .uv
    .uv/bin/pip install --quiet uv
fi
