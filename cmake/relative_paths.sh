#!/bin/sh
# relative_paths.sh COMMAND...: runs it with the paths below this folder written from here. Clang stores the paths of a precompiled header's
# sources as they are given: relative ones are the same in every clone, which the compiler cache can then share.
for word; do
  shift
  case "$word" in
    -I"$PWD"/*) word="-I${word#-I"$PWD"/}" ;;
    "$PWD"/*) word="${word#"$PWD"/}" ;;
  esac
  set -- "$@" "$word"
done
exec "$@"
