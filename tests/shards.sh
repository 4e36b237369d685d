# The slow proofs, for tests/all.sh: each function `shard_K` is one of at most 8 minutes on two cores. `debian_packages[K]` are those
# that .ci/run installs for it.
declare -A debian_packages=()

# title TEXT: heading of its section in docs/results.md
title() { printf 'title\t%s\n' "$1" > "$logs/section.tsv"; }

# text TEST HEADING, markdown TEST HEADING: the output of a test belongs into the section
text() { printf 'text\t%s\t%s\n' "$@" >> "$logs/section.tsv"; }
markdown() { printf 'markdown\t%s\t%s\n' "$@" >> "$logs/section.tsv"; }

# file PATH HEADING: a text
file() { printf 'file\t%s\t%s\n' "$@" >> "$logs/section.tsv"; }

# slow_rust FILTER: Rust tests at their full size, those too that are ignored for their slowness
slow_rust() { stage "Rust tests" rust_tests rust "${everything[@]}" --lib --bins --tests --run-ignored all --filterset "$1"; }

# slow_python_packages REQUIREMENTS: what only slow proofs need, into the environment of the quick checks
slow_python_packages() {
  stage "Python packages" python_packages &&
    stage "more Python packages" "$venv/bin/python" -m pip install --quiet --disable-pip-version-check -r "$1" || note failed "Python packages"
}

# slow_python FILE...: of tests/python, at their full size
slow_python() {
  slow_python_packages tests/python/requirements-full.txt
  stage "Python tests" python_tests python "$PWD" "${@/#/tests/python/}"
}

# checked NAME COMMAND...: counts as a test
checked() {
  local name=$1; shift
  if stage "$name" "$@"; then note passed "$name"; else note failed "$name"; fi
}

# fuzzing guided by coverage, with counters at every branch
shard_1() {
  title "Guided fuzzing"
  fuzz/run 120 > "$logs/fuzz.log" 2>&1
  cat "$logs/fuzz.log"
  awk '$1 ~ /^[a-z]/ && $3 == "executions" { end[$1] = "passed" } /^failed: fuzz target / { sub(/;/, "", $4); end[$4] = "failed" }
       END { for (name in end) print end[name] "\tfuzz " name "\t" }' "$logs/fuzz.log" >> "$logs/notes.tsv"
  grep -q '^[0-9]* executions: [0-9]* passed' "$logs/fuzz.log" || note failed "fuzz/run" "it did not count"
  file "$logs/fuzz.log" "Executions, and edges of the code that they reached"
}

# of the node on r2r what it adds, as far as it goes where no ROS is installed; and the library without features
shard_2() {
  title "Other builds"
  checked "lint of r2r" cargo clippy --lib --no-default-features --features r2r-check -- -D warnings
  stage "tests of r2r" rust_tests r2r --package touchup --lib --no-default-features --features r2r-check --filterset 'test(/r2r/)'
  checked "without features" cargo check --lib --no-default-features
  checked "lint of the wheel" cargo clippy --package touchup-python --features abi3 -- -D warnings
}

# as it is handed out: release profile, weighed, in an environment of its own
shard_3() {
  title "The wheel"
  local wheel_venv=$target/wheel_python wheel weight limit=12000000
  stage "Python packages" python_environment "$wheel_venv" "$wheel_crate/tests/requirements.txt" || { note failed "Python packages"; return; }
  rm -rf "$target/wheel"
  checked "wheel" "$wheel_venv/bin/python" -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$target/wheel" "./$wheel_crate"
  wheel=$(echo "$target"/wheel/touchup-*.whl)
  weight=$(stat -c %s "$wheel") || { note failed "weight of the wheel"; return; }
  echo "$(basename "$wheel"): $weight bytes of at most $limit"
  if [ "$weight" -le "$limit" ]; then note passed "weight of the wheel"; else note failed "weight of the wheel" "$weight bytes, more than $limit"; fi
  checked "installation of the wheel" "$wheel_venv/bin/python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps "$wheel"
  python=$wheel_venv/bin/python stage "tests of the wheel" package_tests wheel ""
}

shard_4() {
  title "Sweeps of the published rule and of the robust mode"
  slow_rust 'test(/^haptic::(sweeps|push::extreme)/)'
  text haptic::sweeps::the_published_rule_converges_where_no_face_leans_out_of_its_basin_and_only_there "Where the published rule converges"
  text haptic::sweeps::the_guard_lets_the_published_rule_starve_no_face "The published rule, throttled by the longest step of the guard"
  text haptic::sweeps::the_robust_mode_never_blows_up_with_noise_larger_than_half_an_edge "The robust mode"
}

# engines of a sweep, on a cluster of this machine
debian_packages[5]="slurm-wlm munge"
shard_5() {
  title "Engines of a sweep"
  slow_python_packages "$wheel_crate/tests/requirements-full.txt" || return
  stage "Python package" install_package || { note failed "Python package"; return; }
  stage "engines" package_tests engines test_ray.py test_engines.py
}

# the site, and what it shows beside what a forge shows
shard_6() {
  title "Site of the documentation, and judged cases"
  slow_python test_docs_site.py test_judge.py
}

shard_count=$(declare -F | grep -c ' shard_[0-9]*$')
