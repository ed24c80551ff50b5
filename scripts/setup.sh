# Sourced by ./run, ./test and the scripts that build: installs missing Debian packages. Sets `root` (the source folder)
# and `build`. `build_targets NAME...` configures the build if necessary, and builds these targets.

# Only Debian's tools are used, because compilers, CMake files and libraries of conda, pyenv or a module system are
# incompatible with the packages below.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
unset CC CXX CPP LD CFLAGS CXXFLAGS CPPFLAGS LDFLAGS LD_LIBRARY_PATH LD_PRELOAD LIBRARY_PATH CPATH C_INCLUDE_PATH \
  CPLUS_INCLUDE_PATH PKG_CONFIG_PATH PKG_CONFIG_LIBDIR CMAKE_PREFIX_PATH CMAKE_TOOLCHAIN_FILE CMAKE_GENERATOR PYTHONPATH \
  PYTHONHOME

root=$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")
build=$root/build

packages=(
  g++ cmake ninja-build ccache git
  liblcm-dev liblcm-bin libmujoco-dev libfcl-dev libeigen3-dev libyaml-cpp-dev libtinyxml2-dev libtinyobjloader-dev libssl-dev
  nlohmann-json3-dev libboost-math-dev libboost-dev libmsgpack-cxx-dev cppzmq-dev
  libcli11-dev libfmt-dev libspdlog-dev
  libgtest-dev libgmock-dev libbenchmark-dev
  libosmesa6-dev libegl-dev libcairo2-dev libturbojpeg0-dev fonts-dejavu-core ffmpeg pkgconf
  libjs-three zlib1g-dev libzstd-dev zstd libhdf5-dev
  iproute2 python3-pip python3-jsonschema python3-numpy python3-msgpack python3-websockets
)

# Packages that only the tests need, to inspect pages and files and to install the Python package:
# `install_missing "${test_packages[@]}"`.
test_packages=(chromium python3-h5py python3-setuptools python3-wheel slurm-wlm munge
  codespell mkdocs mkdocs-material)

say() { printf '%s\n' "$*" >&2; }

# took SECONDS_AT_START: prints the elapsed time as "7 s" or "3 min 20 s".
took() {
  local s=$((SECONDS - $1))
  [ $s -lt 60 ] && printf '%d s' $s || printf '%d min %d s' $((s / 60)) $((s % 60))
}

# install_missing PACKAGE...: installs the packages that are not installed yet.
install_missing() {
  local missing
  # dpkg-query fails for unknown packages; these count as missing.
  missing=$( (dpkg-query -W -f '${Package} ${db:Status-Abbrev}\n' "$@" 2>/dev/null || true) |
    awk -v all="$*" '$2 == "ii" { have[$1] = 1 }
      END { n = split(all, p, " "); for (i = 1; i <= n; i++) if (!(p[i] in have)) print p[i] }' | xargs)
  [ -z "$missing" ] && return
  local as_root=()
  if [ "$(id -u)" != 0 ]; then
    if ! command -v sudo >/dev/null; then
      say "error: these packages are missing, and installing them requires root: apt-get install $missing"
      exit 2
    fi
    as_root=(sudo)
  fi
  say "installing with apt: $missing"
  local log began=$SECONDS
  log=$(mktemp)
  # The package list is updated only if the installation fails, because the list may be missing or outdated.
  if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $missing \
      >"$log" 2>&1; then
    "${as_root[@]}" apt-get update -qq >>"$log" 2>&1 || true
    if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $missing \
        >>"$log" 2>&1; then
      tail -n 20 "$log" >&2
      say "error: apt could not install: $missing (whole log: $log)"
      exit 2
    fi
  fi
  rm -f "$log"
  say "installed in $(took $began)"
}

# download_mujoco FOLDER: downloads and unpacks PyPI's package of the MuJoCo version that Debian has. Its library gives
# bit-identical results, and is faster, because it is compiled for processors with AVX.
download_mujoco() {
  mkdir -p "$1"
  echo 'mujoco==2.2.2 --hash=sha256:a074ea3d63ecc504367df46aa73b3066cd9e7d7ebfe8a48261fba04a9ca232ea' >"$1/requirements.txt"
  timeout 120 python3 -m pip --disable-pip-version-check --quiet download --no-deps --only-binary :all: --python-version 3.10 \
    --timeout 10 --retries 1 --require-hashes --requirement "$1/requirements.txt" --dest "$1" &&
    python3 -m zipfile -e "$1"/mujoco-*.whl "$1"
}

# Downloads PyPI's MuJoCo for the programs of this build if the CPU has AVX. Otherwise, or if the download fails, they use
# Debian's MuJoCo.
prefer_fast_mujoco() {
  [ "$(uname -m)" = x86_64 ] && grep -q -w avx /proc/cpuinfo || return 0
  local new=$build/engine.new
  rm -rf "$new"
  if download_mujoco "$new" >"$build/engine.log" 2>&1; then
    mkdir -p "$build/engine"
    mv "$new/mujoco/libmujoco.so.2.2.2" "$build/engine/"
  else
    say "MuJoCo could not be downloaded from PyPI ($build/engine.log); Debian's build gives the same results more slowly"
  fi
  rm -rf "$new"
}

build_targets() {
  local log=$build/build.log began=$SECONDS
  if [ ! -f "$build/build.ninja" ]; then
    say "configuring and building in $build (a few minutes the first time)"
    mkdir -p "$build"
    prefer_fast_mujoco
    if ! (cd "$root" && cmake --preset release) >"$log" 2>&1; then
      tail -n 30 "$log" >&2
      exit 2
    fi
    # Only the first build shows its progress; later builds are short.
    if [ -t 2 ]; then
      ninja -C "$build" "$@" >&2 || exit 2
    fi
  fi
  ninja -C "$build" "$@" >"$log" 2>&1 || { tail -n 60 "$log" >&2; exit 2; }
  [ $((SECONDS - began)) -lt 3 ] || say "built in $(took $began)"
}

install_missing "${packages[@]}"
