#!/usr/bin/env bash
# Coverage-guided fuzzing of one reader: ./hm fuzz READER [--minutes N]. Needs clang-16 and libclang-rt-16-dev.
# What it finds is kept in build/fuzz/findings/READER; what led somewhere new in build/fuzz/corpus/READER.
set -euo pipefail
root="$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)"
build="$root/build/fuzz"

say() { printf 'hm: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

reader='' minutes=5
while [ $# -gt 0 ]; do
  case "$1" in
    --minutes) [ $# -gt 1 ] || die "--minutes wants a number"; minutes="$2"; shift 2 ;;
    -h | --help) sed -n '2,3s/^# //p' "${BASH_SOURCE[0]}"; exit 0 ;;
    -*) die "unknown option $1 (see ./hm fuzz --help)" ;;
    *) reader="$1"; shift ;;
  esac
done
[[ $minutes =~ ^[0-9]+$ ]] || die "--minutes wants a whole number, not '$minutes'"

command -v clang++-16 >/dev/null ||
  die "clang is missing: apt-get install --no-install-recommends clang-16 libclang-rt-16-dev"
mkdir -p "$build"
{ [ -f "$build/build.ninja" ] || (cd "$root" && cmake --preset fuzz) && ninja -C "$build" -j "${HM_JOBS:-$(nproc)}" hm_fuzz; } \
  >"$build/build.log" 2>&1 || { tail -n 40 "$build/build.log" >&2; die "the build failed (whole output: $build/build.log)"; }

names="$("$build/tests/fuzz/hm_fuzz")"
[ -n "$reader" ] || { printf '%s\n' "$names"; exit 0; }
grep -qx -- "$reader" <<<"$names" || die "no reader '$reader'; there are: $(tr '\n' ' ' <<<"$names")"

corpus="$build/corpus/$reader" findings="$build/findings/$reader" seeds="$build/seeds/$reader"
mkdir -p "$corpus" "$findings" "$seeds"
folders=("$corpus" "$seeds")
[ ! -d "$root/tests/fuzz/corpus/$reader" ] || folders+=("$root/tests/fuzz/corpus/$reader")
# Readers of files read them from memory where the system has a folder of it.
[ -n "${TMPDIR:-}" ] || [ ! -w /dev/shm ] || export TMPDIR=/dev/shm
export HM_FUZZ_READER="$reader" HM_FUZZ_SEEDS="$seeds"
export ASAN_OPTIONS="${ASAN_OPTIONS:-detect_leaks=1:allocator_may_return_null=1}"
export UBSAN_OPTIONS="${UBSAN_OPTIONS:-print_stacktrace=1}"
status=0
nice "$build/tests/fuzz/hm_fuzz" -max_total_time=$((minutes * 60)) -timeout=10 -rss_limit_mb=1500 \
  -max_len=20000 -artifact_prefix="$findings/" -print_final_stats=1 "${folders[@]}" || status=$?
[ "$status" -eq 0 ] || say "the input is in $findings; once mended, keep it in tests/fuzz/corpus/$reader"
exit "$status"
