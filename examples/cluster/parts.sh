#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Makes those parts of an animation, or of a hologram in tiles, that fall to this process, by its
# number among those that Slurm, MPI's launchers or RANK and SIZE count. Parts are dealt out in turn.
#
# usage: raywave units SCENE >units.txt                          what a worker can make in 10 s
#        sbatch --wait --requeue --array=1-8 parts.sh COMMAND                an array of Slurm
#        mpirun -n 8 parts.sh COMMAND                                        or ranks of MPI
#        RANK=0 SIZE=8 parts.sh COMMAND                                      or by hand
#        raywave animate SCENE -o OUT                       one report of all, and the videos
#
# COMMAND: units.txt raywave animate SCENE -o OUT --pictures
#      or: units.txt raywave render SCENE -o OUT --tiles      and at last: ... --tiles all
set -eu
units=$1
shift
if [ ! -s "$units" ]; then
  echo "parts.sh: $units: no parts; raywave units SCENE >$units makes it" >&2
  exit 2
fi
if [ -n "${RANK:-}" ] && [ -z "${SIZE:-}" ] || [ -z "${RANK:-}" ] && [ -n "${SIZE:-}" ]; then
  echo "parts.sh: give both RANK and SIZE" >&2
  exit 2
fi
rank=${RANK:-${SLURM_ARRAY_TASK_ID:-${OMPI_COMM_WORLD_RANK:-${PMI_RANK:-${SLURM_PROCID:-0}}}}}
size=${SIZE:-${SLURM_ARRAY_TASK_COUNT:-${OMPI_COMM_WORLD_SIZE:-${PMI_SIZE:-${SLURM_NTASKS:-1}}}}}
for part in $(awk -v n="$size" -v i="$rank" 'NR % n == i % n {print $1}' "$units"); do
  "$@" "$part"
done
