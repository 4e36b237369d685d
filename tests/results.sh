#!/usr/bin/env bash
# tests/results.sh LOG FOLDER COUNT: what `tests/all.sh --full` measured, as Markdown on stdout: what the proofs below printed into
# the log of the Rust tests, then each file of FOLDER, which the Python tests wrote.
set -euo pipefail
cd "$(dirname "$0")/.."
log=$1 folder=$2 count=$3

commit=$(git rev-parse --short=12 HEAD)
git diff --quiet HEAD -- . ':!docs/results.md' || commit="$commit, with changes"
cat <<HEAD
# Results

Written by \`tests/all.sh --full\`; do not edit. What the program's own simulator made shows consistency, not truth: the judged cases
come from another one.

| | |
|---|---|
| date | $(date -u +%Y-%m-%d) |
| commit | $commit |
| machine | $(sed -n 's/^model name\s*: //p' /proc/cpuinfo | head -n 1), $(nproc) processors, $(uname -sm) |
| compiler | $(rustc --version) |
| tests | $count |
HEAD

# printed TEST: what it printed
printed() {
  awk -v test="$1" '$0 == "---- " test " stdout ----" { is_in = 1; next } /^---- .* ----$|^successes:$/ { is_in = 0 } is_in' "$log" \
    | sed -e '/./,$!d'
}

for file in "$folder"/*.md; do
  [ -e "$file" ] || continue
  name=$(basename "$file" .md)
  printf '\n## %s\n\n' "${name//_/ }"
  cat "$file"
done
while IFS='|' read -r test heading; do
  text=$(printed "$test")
  [ -n "$text" ] || { echo "$test printed nothing into $log" >&2; exit 1; }
  printf '\n## %s\n\n`%s`\n\n```text\n%s\n```\n' "$heading" "$test" "$text"
done <<'PROOFS'
features::touched::touched_features_are_found_within_their_stated_uncertainty|Features of the touched plate, fifty seeds
reconstruct::accuracy::other_tips_balls_hands_and_friction|Other balls, hands and friction, twenty seeds
reconstruct::accuracy::other_tips_flat_ends|Flat ends, twenty seeds
reconstruct::accuracy::other_tips_a_cone|A cone, twenty seeds
reconstruct::uncertainty::what_was_touched_is_as_well_known_as_it_says_where_errors_are_as_the_model_has_them|Stated uncertainty where errors are as the model has them
reconstruct::uncertainty::errors_outside_of_the_model_are_not_in_the_stated_uncertainty|Stated uncertainty where errors are others
reconstruct::tips::contacts_of_a_tip_are_located|Where a tip touched
haptic::sweeps::the_published_rule_converges_where_no_face_leans_out_of_its_basin_and_only_there|Where the published rule converges
haptic::sweeps::the_guard_lets_the_published_rule_starve_no_face|Sweeps of the published rule, throttled by the guard's longest step
haptic::sweeps::the_robust_mode_never_blows_up_with_noise_larger_than_half_an_edge|Sweeps of the robust mode
probing::arm::touching::a_hole_is_found_from_one_click_and_measured|A hole from one click, by a simulated arm
PROOFS
