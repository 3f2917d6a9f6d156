#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# The table of docs/notes: ten generated worlds through compare_mapping. Arguments go on to it, e.g.
#   tests/benchmarks/mapping_worlds.sh build/release/tests/benchmarks/compare_mapping --threads 2
# One world takes some minutes of processor time.
set -e
program=$1
shift
exec "$program" "$@" \
  "synth:room?frames=600&texture=full&seed=1" "synth:room?frames=600&texture=weak&seed=2" \
  "synth:room?frames=600&texture=none&seed=3" "synth:office?frames=900&texture=full&seed=1" \
  "synth:office?frames=900&texture=weak&seed=2" "synth:office?frames=900&texture=none&seed=3" \
  "synth:structure?frames=600&texture=full&seed=1" "synth:structure?frames=600&texture=weak&seed=2" \
  "synth:structure?frames=600&texture=none&seed=3" "synth:room?frames=900&texture=weak&seed=4"
