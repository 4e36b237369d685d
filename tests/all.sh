#!/usr/bin/env bash
# Runs the tests.
#
#   tests/all.sh                 the quick checks: unit tests, tests/rooms, tests/ur, documentation, the Python package, and
#                                tests/python against the program
#   tests/all.sh --shard K/N     one of the N shards of slow proofs in tests/shards.sh (more seeds, sweeps, judged cases, RViz,
#                                networks, fuzzing …), which writes its section of docs/results.md
#   tests/all.sh --full          the quick checks and all shards
#
# Needs cargo, cargo-nextest, a C compiler and Python 3.11. One build with the same features and the same profile serves all. Python
# packages go into target/python, logs into target/test-logs. No test runs twice, and no failure has an excuse. A test that could not run
# counts as skipped, with its reason. The last line is the count; the exit code is 0 only without failures.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1
command -v cargo-nextest > /dev/null || { echo "cargo-nextest is missing: cargo install --locked cargo-nextest" >&2; exit 2; }

target=${CARGO_TARGET_DIR:-target}
case $target in /*) ;; *) target=$PWD/$target ;; esac
export CARGO_TARGET_DIR=$target
reports=$target/test-logs
logs=$reports/quick
venv=$target/python
wheel_crate=crates/touchup-python
# members and features of every command of cargo: others would build shared libraries once more
everything=(--workspace --features everything)
stages=()

# note OUTCOME NAME [REASON]: counts a check without a report of its own
note() { printf '%s\t%s\t%s\n' "$1" "$2" "${3-}" >> "$logs/notes.tsv"; }

# stage NAME COMMAND...: runs it, and notes its duration
stage() {
  local name=$1 begun=$SECONDS; shift
  echo "== $name"
  "$@"
  local status=$?
  stages+=("$(printf '%-28s %4d s' "$name" $((SECONDS - begun)))")
  return $status
}

# python_environment FOLDER REQUIREMENTS...: makes it, once for each state of the requirements
python_environment() {
  local folder=$1 wanted; shift
  wanted=$(cat "$@" | cksum)
  [ "$(cat "$folder.made" 2>/dev/null)" = "$wanted" ] && return 0
  rm -rf "$folder" "$folder.made"
  python3 -m venv "$folder" && "$folder/bin/python" -m pip install --quiet --disable-pip-version-check "${@/#/-r}" || return 1
  echo "$wanted" > "$folder.made"
}

# those of the quick checks
python_packages() { python_environment "$venv" tests/python/requirements.txt "$wheel_crate/tests/requirements.txt"; }

# the program, its examples, the Python module and all Rust tests
build() {
  PYO3_PYTHON=$(command -v python3) && export PYO3_PYTHON
  cargo build "${everything[@]}" --lib --bins --examples --tests --timings || { note failed "build of the tests"; return 1; }
  export TOUCHUP_BIN=$target/debug/touchup TOUCHUP_UR_BIN=$target/debug/touchup TOUCHUP_UR_CONTROLLER=$target/debug/examples/ur_controller
}

# rust_tests NAME ARGUMENT...: of nextest, into the report NAME
rust_tests() {
  local name=$1 status; shift
  # one more than there are cores, as some wait for a controller
  cargo nextest run --test-threads $(($(nproc) + 1)) "$@" 2>&1 | tee "$logs/$name.log"
  status=${PIPESTATUS[0]}
  mv "$target/nextest/default/junit.xml" "$logs/$name.xml" || { note failed "$name" "nextest ended with $status, see $logs/$name.log"; return; }
  [ "$status" -eq 0 ] || [ "$status" -eq 100 ] || note failed "$name" "nextest ended with $status, see $logs/$name.log"
}

documentation_tests() {
  cargo test --no-fail-fast "${everything[@]}" --doc > "$logs/documentation.log" 2>&1
  local status=$?
  sed -nE 's/^test (.*) \.\.\. ok$/passed\t\1\t/p; s/^test (.*) \.\.\. FAILED$/failed\t\1\t/p; s/^test (.*) \.\.\. ignored.*$/skipped\t\1\tignored/p' \
    "$logs/documentation.log" >> "$logs/notes.tsv"
  [ "$status" -eq 0 ] && return
  grep -v '^test .* ok$' "$logs/documentation.log"
  grep -q '^test .* FAILED$' "$logs/documentation.log" || note failed "documentation" "cargo test --doc ended with $status, see $logs/documentation.log"
}

# python_tests NAME FOLDER ARGUMENT...: of pytest, in a folder, into the report NAME; three at a time, as some wait for a node, and
# no more, as each takes up to 15 of the 60 free DDS domains (ros_domains.py)
python_tests() {
  local name=$1 folder=$2 status; shift 2
  (cd "$folder" && "${python:-$venv/bin/python}" -m pytest "$@" --numprocesses 3 --dist loadfile -rs --tb=short --no-header --quiet \
    -o "cache_dir=$logs/pytest_cache" -o junit_logging=system-out --junitxml="$logs/$name.xml") 2>&1 | tee "$logs/$name.log"
  status=${PIPESTATUS[0]}
  # 1: tests failed, which the report says
  [ "$status" -le 1 ] && [ -e "$logs/$name.xml" ] || note failed "$name" "pytest ended with $status, see $logs/$name.log"
}

# the Python package as in the wheel, with the module of the common build: a shard builds a wheel
install_package() {
  local site; site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))') || return 1
  rm -rf "$site/touchup"
  cp -r "$wheel_crate/python/touchup" "$site/touchup" && cp "$target/debug/lib_touchup.so" "$site/touchup/_touchup.so" || return 1
  printf '#!%s\nimport sys\nfrom touchup.command import main\nsys.exit(main())\n' "$venv/bin/python" > "$venv/bin/touchup"
  chmod +x "$venv/bin/touchup"
}

# outside of the source tree, so that the tests import no file of it
package_tests() {
  local name=$1 outside tests=$PWD/$wheel_crate/tests; shift
  outside=$(mktemp -d)
  python_tests "$name" "$outside" "${@/#/$tests/}"
  rm -rf "$outside"
}

quick_checks() {
  local packages
  rm -rf "$logs" && mkdir -p "$logs" || exit 1
  # property tests try the same cases in every run, here; others in the shards
  export PROPTEST_RNG_SEED=1
  # they arrive during the build of the tests
  python_packages > "$logs/pip.log" 2>&1 &
  packages=$!
  stage "build" build || return
  stage "Rust tests" rust_tests rust "${everything[@]}" --lib --bins --tests
  stage "documentation tests" documentation_tests
  stage "Python packages" wait "$packages" || { tail -n 5 "$logs/pip.log" >&2; note failed "Python packages" "see $logs/pip.log"; return; }
  stage "Python package" install_package || { note failed "Python package"; return; }
  stage "tests of the package" package_tests package ""
  stage "Python tests" python_tests python "$PWD" tests/python
  echo "$(sed -nE 's/^ *Summary .*, ([0-9]+) skipped$/\1/p' "$logs/rust.log") Rust tests, and those of tests/python that are marked full, belong to the shards"
  unset PROPTEST_RNG_SEED
}

source tests/shards.sh

# one_shard K: runs it, and writes its section of docs/results.md
one_shard() {
  local number=$1
  logs=$reports/shard-$1
  rm -rf "$logs" && mkdir -p "$logs" || exit 1
  export TOUCHUP_FULL=1 PROPTEST_CASES=2560 PROPTEST_MAX_GLOBAL_REJECTS=10240
  stage "build" build && "shard_$number"
  python3 tests/results.py "$number/$shard_count" "$logs" || note failed "docs/results.md" "tests/results.py failed"
  unset TOUCHUP_FULL PROPTEST_CASES PROPTEST_MAX_GLOBAL_REJECTS
}

case "$#:${1-}:${2-}" in
  0::) counted=$logs; quick_checks ;;
  1:--full:) counted=$reports; rm -rf "$reports"; quick_checks; for number in $(seq "$shard_count"); do one_shard "$number"; done ;;
  2:--shard:[1-9]*/"$shard_count")
    [ "${2%/*}" -le "$shard_count" ] || { echo "--shard K/$shard_count: K is 1 to $shard_count" >&2; exit 2; }
    counted=$reports/shard-${2%/*}; one_shard "${2%/*}" ;;
  *) echo "usage: tests/all.sh [--full | --shard K/$shard_count]" >&2; exit 2 ;;
esac

echo
printf '%s\n' "${stages[@]}"
exec python3 tests/count.py "$counted"
