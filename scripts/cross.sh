#!/usr/bin/env bash
# Builds dense reconstruction for another processor, runs its unit tests under QEMU, and compares its results with those
# of this machine's program, bit by bit. Called by `./hm cross arm64`; needs the section [cross] of packages.txt.
#
# The libraries of the target are unpacked into a folder of the build: nothing is installed besides the compiler and
# QEMU, and none of this machine's own packages gives way to one of the other architecture.
set -euo pipefail
root="$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)"
build="$root/build/cross-arm64"
libraries="$build/root"
rooms=(core geometry sensors depth_camera io tsdf mesh sim evaluation mapping)

say() { printf 'hm: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

help() {
  cat <<'TEXT'
./hm cross arm64             build dense reconstruction for 64-bit ARM, test it, compare its results with x86
./hm cross arm64 --bits      only build the program, and compare its results with x86
./hm cross arm64 --build     only build
The program is then build/cross-arm64/bin/hm; it runs here with qemu-aarch64-static -L build/cross-arm64/root.
Settings: HM_MIRROR (where Debian's packages come from).
TEXT
}

# The packages of a section of packages.txt that hold libraries.
libraries_of() {  # SECTION...
  awk -v wanted=" $* " '{ sub(/#.*/, "") } /^\[/ { gsub(/[][[:space:]]/, ""); ours = index(wanted, " " $0 " "); next }
    ours && $1 ~ /-dev$|^nlohmann/ { print $1 }' "$root/packages.txt" | sort -u
}

# apt with lists, cache and installed packages of its own.
apt_arm64() {
  apt-get -qq -o Dir::State="$build/apt/state" -o Dir::State::status="$build/apt/status" -o Dir::Cache="$build/apt/cache" \
    -o Dir::Etc::sourcelist="$build/apt/sources.list" -o Dir::Etc::sourceparts=- \
    -o APT::Architecture=arm64 -o APT::Architectures=arm64 -o APT::Sandbox::User=root "$@"
}

unpack_libraries() {
  local wanted codename package
  wanted="$(libraries_of dense cross-test)"
  [ "$(cat "$libraries/.packages" 2>/dev/null)" != "$wanted" ] || return 0
  # shellcheck disable=SC1091
  codename="$(. /etc/os-release && echo "${VERSION_CODENAME:-bookworm}")"
  say "unpacking $(wc -w <<<"$wanted") libraries for arm64 and what they need"
  rm -rf "$libraries"
  mkdir -p "$libraries" "$build/apt/state/lists/partial" "$build/apt/cache/archives/partial"
  : >"$build/apt/status"
  echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] ${HM_MIRROR:-http://deb.debian.org/debian} $codename main" \
    >"$build/apt/sources.list"
  apt_arm64 update || die "the lists of Debian's arm64 packages could not be read"
  # shellcheck disable=SC2086
  apt_arm64 install -y --no-install-recommends --download-only $wanted
  for package in "$build"/apt/cache/archives/*.deb; do dpkg-deb --extract "$package" "$libraries"; done
  # Links to absolute paths would lead out of the folder.
  local link
  find "$libraries" -type l -lname '/*' -print0 | while IFS= read -r -d '' link; do
    ln -sfn "$libraries$(readlink "$link")" "$link"
  done
  # Some CMake packages name their files by absolute paths.
  grep -rlZ '[";:]/usr/' "$libraries/usr" --include='*.cmake' | xargs -0 -r sed -i "s|\([\";:]\)/usr/|\1$libraries/usr/|g"
  # assimp's names a library without its folder.
  sed -i "s|;minizip;|;$libraries/usr/lib/aarch64-linux-gnu/libminizip.so;|" \
    "$libraries"/usr/lib/aarch64-linux-gnu/cmake/assimp-*/assimpTargets.cmake
  printf '%s' "$wanted" >"$libraries/.packages"
}

# Compilations in parallel: one per processor, but no more than memory allows (about 1.5 GB each).
jobs_count() {
  awk -v cpus="$(nproc)" '/MemAvailable/ { n = int($2 / 1500000); print n < 1 ? 1 : n < cpus ? n : cpus }' /proc/meminfo
}

build_program() {
  cmake --preset arm64 -DHM_CROSS_ROOT="$libraries" "-DHM_TESTED_ROOMS=$(IFS=';'; echo "${rooms[*]}")" \
    >"$build/configure.log" 2>&1 || { tail -n 30 "$build/configure.log" >&2; die "configuring failed"; }
  ninja -C "$build" -j "${HM_JOBS:-$(jobs_count)}" "$@"
}

# The sum of what a map holds: all but when it was made.
sum_of_map() {  # MAP
  python3 - "$1" <<'PYTHON'
import hashlib, json, sqlite3, sys
database = sqlite3.connect(sys.argv[1])
(text,), = database.execute("SELECT content FROM header")
header = {key: value for key, value in json.loads(text).items() if key not in ("created_unix_ms", "updated_unix_ms")}
pages = database.execute("SELECT * FROM pages ORDER BY 1").fetchall()
print(hashlib.sha256(repr((header, pages)).encode()).hexdigest() + "  map.hmap")
PYTHON
}

# The map and the mesh that a program makes of a recording.
results_of() {  # OUTPUT PROGRAM...
  local output="$1"
  shift
  rm -rf "$output"
  "$@" reconstruct "$build/recording" -o "$output" --quiet --set reconstruction.pictures=false
  (cd "$output" && sum_of_map map.hmap && sha256sum mesh.ply)
}

compare_results() {
  local here there
  "$root/hm" build
  rm -rf "$build/recording"
  "$root/build/release/bin/hm" simulate room -o "$build/recording" --frames 12 --quiet
  here="$(results_of "$build/result_here" "$root/build/release/bin/hm")"
  there="$(results_of "$build/result_arm64" qemu-aarch64-static -L "$libraries" "$build/bin/hm")"
  printf '%s\n' "$here"
  [ "$here" = "$there" ] || die "arm64 gives other bits: $(printf '\n%s' "$there")"
  say "arm64_bits: map and mesh are the same bits as here"
}

case "${1:-} ${2:-}" in
  "arm64 " | "arm64 --bits" | "arm64 --build") ;;
  "-h " | "--help ") help; exit 0 ;;
  *) help >&2; exit 2 ;;
esac
cd "$root"
mkdir -p "$build"
unpack_libraries
case "${2:-}" in
  --bits) build_program hm; compare_results; exit 0 ;;
  --build) build_program; exit 0 ;;
esac
build_program
compare_results
# Tests that limit their memory would limit that of the emulator.
ctest --test-dir "$build" -j "$(nproc)" --output-on-failure --no-tests=error --exclude-regex 'WithoutMemory|TooMuchMemory'
