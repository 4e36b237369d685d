#!/usr/bin/env bash
# tests/results.sh FOLDER COUNT: what `tests/all.sh --full` measured, as Markdown on stdout: a heading for each file of FOLDER.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$1 count=$2

commit=$(git rev-parse --short=12 HEAD)
git diff --quiet HEAD -- . ':!docs/results.md' || commit="$commit, with changes"
cat <<HEAD
# Results

Written by \`tests/all.sh --full\`; do not edit.

| | |
|---|---|
| date | $(date -u +%Y-%m-%d) |
| commit | $commit |
| machine | $(sed -n 's/^model name\s*: //p' /proc/cpuinfo | head -n 1), $(nproc) processors, $(uname -sm) |
| compiler | $(rustc --version) |
| tests | $count |
HEAD
for file in "$folder"/*.md; do
  [ -e "$file" ] || continue
  name=$(basename "$file" .md)
  printf '\n## %s\n\n' "${name//_/ }"
  cat "$file"
done
