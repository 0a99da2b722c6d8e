#!/bin/sh
# Writes one page per program from the program itself. usage: scripts/generate-docs.sh BIN_DIR OUT_DIR
set -eu
bin=$1
out=$2
mkdir -p "$out"
for program in "$bin"/toile-*; do
  "$program" --docs > "$out/$(basename "$program" | sed 's/^toile-//').md"
done
