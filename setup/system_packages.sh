#!/bin/sh
# Makes sure that what the Python wheels expect from the system is there: EGL and a Mesa driver to
# draw without a screen (VTK), libusb and libgomp (Open3D); and venv, which Debian keeps apart.
# Installs what is missing as root with apt; otherwise says the one command that does. The compiler
# that tests the shaders, and the browser that tests the viewer, are only tried to be had: without
# them, these tests say so.
set -eu

exists() { for path in "$@"; do [ -e "$path" ] && return 0; done; return 1; }
has() {
    ldconfig -p 2>/dev/null | grep -q "$1" || exists /usr/lib/*/"$1"* /usr/lib64/"$1"* /usr/lib/"$1"*
}
has_driver() { # Mesa's software renderer: a driver of its own, or part of one library
    exists /usr/lib/*/dri/*swrast_dri.so /usr/lib64/dri/*swrast_dri.so || has libgallium
}

packages=""
"${PYTHON:-python3}" -c 'import ensurepip, venv' 2>/dev/null || packages="$packages python3-venv"
has libEGL.so.1 || packages="$packages libegl1"
has libGL.so.1 || packages="$packages libgl1"
has libEGL_mesa.so.0 || packages="$packages libegl-mesa0"
has_driver || packages="$packages libgl1-mesa-dri"
has libusb-1.0.so.0 || packages="$packages libusb-1.0-0"
has libgomp.so.1 || packages="$packages libgomp1"
has libX11.so.6 || packages="$packages libx11-6"
has libXrender.so.1 || packages="$packages libxrender1"

try_to_have() { # a program, and its package
    if [ "$(id -u)" = 0 ] && ! command -v "$1" >/dev/null; then
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
            -o Acquire::Retries=0 -o Acquire::http::Timeout=10 "$2" >/dev/null 2>&1 || true
    fi
}
for_tests() {
    try_to_have glslangValidator glslang-tools
    try_to_have chromium chromium
}
[ -z "$packages" ] && { for_tests; exit 0; }

if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing system packages:$packages"
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq
    # shellcheck disable=SC2086  # a list of names
    apt-get install -y -qq --no-install-recommends $packages >/dev/null
    for_tests
elif command -v apt-get >/dev/null; then
    echo "System packages are missing; install them with: sudo apt-get install -y$packages" >&2
    exit 1
else
    echo "System packages are missing; install what your system calls (Debian's names):$packages" >&2
    exit 1
fi
