#!/bin/sh
# Usage: compile_cached.sh ROOT CCACHE COMPILER ARGUMENTS...
# Compiles through the compiler cache. Paths are relative to ROOT, so that every clone shares one cache; precompiled headers
# need the sloppiness. Beside a precompiled header (140 MB and more) lies its checksum, which the cache compares instead of
# reading all of it for each file; an old one would be taken for part of what the new one is made from.
export CCACHE_BASEDIR="$1" CCACHE_NOHASHDIR=1 CCACHE_PCH_EXTSUM=1
export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
ccache="$2"
shift 2
header=
for word; do
  case "$word" in *.gch) header="$word" ;; esac
done
[ -z "$header" ] || rm -f "$header" "$header.sum"
"$ccache" "$@" || exit
[ -z "$header" ] || md5sum < "$header" > "$header.sum"
