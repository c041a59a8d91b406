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
# shellcheck disable=SC2086
git -C "$root" archive HEAD | "${CONTAINER_TOOL:-podman}" run --rm --interactive --privileged --shm-size 1g \
  ${CONTAINER_RUN_OPTIONS:-} "${BASE:-debian:12}" \
  bash -c 'mkdir /checkout && cd /checkout && tar --extract && exec ./stack test "$@"' bash "$@"
