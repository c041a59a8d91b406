#!/usr/bin/env bash
# `./stack test` on a machine with nothing on it: the commit that is checked out, in a container of bare Debian 12. What
# a list of packages in `stack` has forgotten is missing there.
#
#   tests/fresh_machine.sh [ARGUMENT of ./stack test ...]        tests/fresh_machine.sh fast
#
# CONTAINER_TOOL names another engine than podman, BASE another image than debian:12, CONTAINER_RUN_OPTIONS further
# options of "run". Privileged, because tests make networks of their own.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
folder=$(mktemp --directory)
trap 'rm -rf "$folder"' EXIT
git clone --quiet --depth 1 "file://$root" "$folder/checkout"
# shellcheck disable=SC2086
tar --create --directory "$folder" checkout |
  "${CONTAINER_TOOL:-podman}" run --rm --interactive --privileged --shm-size 1g \
    ${CONTAINER_RUN_OPTIONS:-} "${BASE:-debian:12}" \
    bash -c 'tar --extract --no-same-owner && cd checkout && exec ./stack test "$@"' bash "$@"
