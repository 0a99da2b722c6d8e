#!/bin/sh
# Installs what the build needs and is not there yet, as Debian packages. usage: scripts/install-deps.sh
set -eu

required="g++ cmake ninja-build make libeigen3-dev libfmt-dev libtbb-dev libxxhash-dev libyaml-cpp-dev nlohmann-json3-dev
libcli11-dev libcgal-dev libassimp-dev libfcl-dev libsuitesparse-dev libgtest-dev libpng-dev libembree-dev libzmq3-dev"

missing=""
for package in $required; do
  # "install ok installed" is the only state in which a package is complete.
  state=$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null || true)
  [ "$state" = "install ok installed" ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

if ! command -v apt-get >/dev/null; then
  echo "install-deps: this is not a Debian system; install the equivalents of:$missing" >&2
  exit 1
fi
if [ "$(id -u)" = 0 ]; then
  as_root=""
elif command -v sudo >/dev/null; then
  as_root="sudo"
else
  echo "install-deps: run as root, or install sudo, or install yourself:$missing" >&2
  exit 1
fi

echo "installing:$missing"
$as_root apt-get update -q
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing
