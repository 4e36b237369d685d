#!/usr/bin/env bash
# Runs every test: cargo test, a minute of fuzz/run, tests/python against the binary that it built, and those of the wheel
# against the wheel in an environment of its own.
#
#   tests/all.sh [--full]      --full: also the slow proofs (more seeds, sweeps, judged cases, RViz, Fast DDS over networks of
#                              its own); what they measured goes into docs/results.md, with date, commit and machine
#
# Needs cargo and a C compiler. Python packages go into target/python, logs into target/test-logs. Nothing is tried twice, and
# nothing that failed is excused. A test that could not run is counted as skipped, with its reason. The last line is the count;
# the exit code is 0 only when nothing failed.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1

is_full= ignored_too=()
requirements=tests/python/requirements.txt wheel_requirements=crates/touchup-python/tests/requirements.txt
case "${1-}" in
  # property tests try the same cases in every run, here; others with --full
  "") export PROPTEST_RNG_SEED=1 ;;
  --full)
    is_full=yes ignored_too=(--include-ignored)
    requirements=tests/python/requirements-full.txt wheel_requirements=crates/touchup-python/tests/requirements-full.txt
    export TOUCHUP_FULL=1 PROPTEST_CASES=2560 PROPTEST_MAX_GLOBAL_REJECTS=10240
    ;;
  *) echo "usage: tests/all.sh [--full]" >&2; exit 2 ;;
esac

target=${CARGO_TARGET_DIR:-target}
case $target in /*) ;; *) target=$PWD/$target ;; esac
logs=$target/test-logs
venv=$target/python
wheel_crate=crates/touchup-python wheel_venv=$target/wheel_python
# what it may weigh, bytes
wheel_limit=12000000
passed=0 failed=0 skipped=0 left=0
reasons=() stages=()
features=() has_ur=
# what has Rust tests: the Python module has none, and its features would be those of all
workspace=(--workspace --exclude touchup-python)
rm -rf "$logs" && mkdir -p "$logs/results" || exit 1
# what a slow proof measured goes here as a file of Markdown
[ -z "$is_full" ] || export TOUCHUP_RESULTS=$logs/results

skip() { skipped=$((skipped + $1)); reasons+=("$1 skipped: $2"); }
fail() { failed=$((failed + 1)); reasons+=("failed: $1"); }

# stage NAME COMMAND...: runs it, and notes how long it took
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

python_environments() {
  python_environment "$venv" tests/python/requirements.txt docs/requirements.txt "$requirements" && python_environment "$wheel_venv" "$wheel_crate/tests/requirements.txt" "$wheel_requirements"
}

python_is_ready() { wait "$1" || { tail -n 5 "$logs/pip.log" >&2; return 1; }; }

# a UR arm needs a Python to link with, its shared library and what finds that; the tests install ur-rtde by themselves
ur_feature() {
  PYO3_PYTHON=$(command -v python3) && export PYO3_PYTHON && python3 - <<'PYTHON' && features+=(--features ur) && has_ur=yes
import os, sys, sysconfig
folder, library = map(sysconfig.get_config_var, ("LIBDIR", "LDLIBRARY"))
sys.exit(not (library.endswith(".so") and os.path.exists(os.path.join(folder, library))))
PYTHON
}

# the operator's page is built by npm; the tests drive it in a browser
web_feature() { command -v npm > /dev/null && features+=(--features web); }

# lines of passing tests, and of those that are left to --full, and what they print, go into the log alone
without_passing() {
  sed -u -e '/^successes:$/,/^\(failures:$\|test result: \)/{/^\(failures:$\|test result: \)/!d}' -e '/^test .* \.\.\. \(ok\|ignored, full\)$/d' -e '/^$/d'
}

# the names of the failed tests in a log of cargo test, each with its program; a program that ended before it counted has no test
failed_tests() {
  awk '/^     Running / { program = $0; sub(/^     Running (unittests )?/, "", program); sub(/ \(.*$/, "", program); begun[program] }
       /^   Doc-tests / { program = "documentation"; begun[program] }
       /^test result: / { counted[program] }
       /^test .* \.\.\. FAILED$/ { name = $0; sub(/^test /, "", name); sub(/ \.\.\. FAILED$/, "", name); print program ": " name }
       END { for (program in begun) if (!(program in counted)) print program ": ended before the end of its tests" }' "$1"
}

# unit tests are quick: without optimisation the crates are built for them in a seventh of the time, but for core and simulator, on which
# those of the arm touch for hours of its time
unoptimised=(--config profile.dev.package.touchup.opt-level=0)
for crate in io report session; do unoptimised+=(--config "profile.dev.package.touchup-$crate.opt-level=0"); done

# what tests, then the program and the stand-in for a controller, which by then are all but built: the other way round one core
# waits for the last crates of the program
build_tests() {
  cargo test "${workspace[@]}" --no-run "${features[@]}" "${programs[@]}" && cargo build "${features[@]}" --bins --examples || fail "the tests do not build"
}

# cargo_tests LOG ARGUMENT...
cargo_tests() {
  local log=$1 status passed_here ignored left_here line; shift
  cargo test --no-fail-fast "$@" -- --show-output "${ignored_too[@]}" 2>&1 | tee "$log" | without_passing
  status=${PIPESTATUS[0]}
  read -r passed_here ignored <<<"$(awk '/^test result: / { p += $4; i += $8 } END { print p + 0, i + 0 }' "$log")"
  # a test that could not run says so, once or oftener, and passes: it counts as what it is
  sed -n 's/^SKIPPED: //p' "$log" | awk -F': ' '!seen[$1]++' > "$log.skipped"
  passed=$((passed + passed_here - $(wc -l < "$log.skipped")))
  while read -r line; do skip 1 "$line"; done < "$log.skipped"
  # what is ignored for its slowness belongs to --full
  left_here=$(grep -c '^test .* \.\.\. ignored, full$' "$log")
  left=$((left + left_here)) ignored=$((ignored - left_here))
  [ "$ignored" -eq 0 ] || skip "$ignored" "ignored Rust tests"
  [ "$status" -ne 0 ] || return
  failed_tests "$log" > "$log.failed"
  [ -s "$log.failed" ] || fail "cargo test $* ended with $status, see $log"
  while read -r line; do fail "$line"; done < "$log.failed"
}

python_tests() {
  export TOUCHUP_BIN=$target/debug/touchup
  if [ -n "$has_ur" ]; then
    # of the Rust tests: with a UR arm, and the stand-in for its controller
    export TOUCHUP_UR_BIN=$target/debug/touchup TOUCHUP_UR_CONTROLLER=$target/debug/examples/ur_controller
  fi
  # two at a time, each file on one of them: many tests wait for a node, and each has a domain of its own
  counted_pytest python "$venv" "$PWD" tests/python --numprocesses 2 --dist loadfile --durations=20
}

# counted_pytest NAME ENVIRONMENT FOLDER ARGUMENT...: pytest of an environment, in a folder; its tests are counted
counted_pytest() {
  local name=$1 environment=$2 folder=$3 status summary line passed_here; shift 3
  (cd "$folder" && "$environment/bin/python" -m pytest "$@" -rs --tb=short --no-header -o "cache_dir=$logs/pytest_cache" --junitxml="$logs/$name.xml") 2>&1 |
    tee "$logs/$name.log"
  status=${PIPESTATUS[0]}
  summary=$(counted_by_pytest "$logs/$name.xml") || { fail "pytest ended with $status, see $logs/$name.log"; return; }
  read -r passed_here <<<"$summary"
  passed=$((passed + passed_here))
  while read -r line; do skip 1 "${line#skipped }"; done < <(grep '^skipped ' <<<"$summary")
  while read -r line; do fail "${line#failed }"; done < <(grep '^failed ' <<<"$summary")
  if [ "$status" -ne 0 ] && ! grep -q '^failed ' <<<"$summary"; then fail "pytest ended with $status, see $logs/$name.log"; fi
}

# the wheel as it is handed out; its weight counts as a test
build_wheel() {
  local wheel weight
  rm -rf "$target/wheel"
  "$venv/bin/python" -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$target/wheel" "./$wheel_crate" || { fail "the wheel does not build"; return 1; }
  wheel=$(echo "$target"/wheel/touchup-*.whl)
  weight=$(stat -c %s "$wheel") || { fail "no wheel in $target/wheel"; return 1; }
  echo "$(basename "$wheel"): $weight bytes of at most $wheel_limit"
  if [ "$weight" -le "$wheel_limit" ]; then passed=$((passed + 1)); else fail "the wheel has $weight bytes, more than $wheel_limit"; fi
  "$wheel_venv/bin/python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps "$wheel" || { fail "the wheel does not install"; return 1; }
}

# from outside of the source tree, where no file of it is imported
wheel_tests() {
  local outside tests=$PWD/$wheel_crate/tests; outside=$(mktemp -d)
  counted_pytest wheel "$wheel_venv" "$outside" "$tests" --numprocesses 2 --durations=10
  rm -rf "$outside"
}

# a target counts as a test
fuzz_targets() {
  fuzz/run 60 2>&1 | tee "$logs/fuzz.log"
  local passed_here line
  passed_here=$(sed -n 's/^[0-9]* executions: \([0-9]*\) passed, .*/\1/p' "$logs/fuzz.log")
  [ -n "$passed_here" ] || { fail "fuzz/run did not count, see $logs/fuzz.log"; return; }
  passed=$((passed + passed_here))
  while read -r line; do fail "${line#failed: }"; done < <(grep '^failed: ' "$logs/fuzz.log")
}

# of a report in JUnit's form: how many passed, then a line for each that failed or was skipped
counted_by_pytest() {
  "$venv/bin/python" - "$1" <<'PYTHON'
import sys, xml.etree.ElementTree as tree
passed, others = 0, []
for case in tree.parse(sys.argv[1]).iter("testcase"):
    name = case.get("classname", "") + "." + case.get("name")
    if case.find("failure") is not None or case.find("error") is not None:
        others.append(f"failed {name}")
    elif case.find("skipped") is not None:
        others.append(f"skipped {name}: " + case.find("skipped").get("message", ""))
    else:
        passed += 1
print(passed, *others, sep="\n")
PYTHON
}

# they arrive while the tests are built
python_environments > "$logs/pip.log" 2>&1 &
packages=$!
ur_feature || skip "$(cat tests/ur/*.rs | grep -c '^#\[test\]')" "a UR arm needs the shared library of Python (Debian: apt-get install python3-dev)"
web_feature || skip "$(cat src/ros/web/*.rs | grep -c '^ *#\[test\]')" "the operator's page is built by npm (Debian: apt-get install npm)"
programs=(--test rooms --test report)
[ -z "$has_ur" ] || programs+=(--test ur)
stage "build of the Rust tests" build_tests
stage "Rust tests" cargo_tests "$logs/rust.log" "${workspace[@]}" "${features[@]}" "${programs[@]}"
# with them the node on r2r, of which without ROS only its parts can run; a program of fuzz/ would fuzz for ever
stage "Rust unit tests" cargo_tests "$logs/rust_unit.log" "${workspace[@]}" --exclude touchup-fuzz "${unoptimised[@]}" "${features[@]}" --features r2r-check --lib --bins
stage "Rust documentation tests" cargo_tests "$logs/rust_doc.log" "${workspace[@]}" "${features[@]}" --doc
stage "Fuzzing" fuzz_targets
if [ ! -x "$target/debug/touchup" ]; then
  fail "cargo test built no $target/debug/touchup"
elif stage "Python packages" python_is_ready "$packages" && [ -e "$venv.made" ] && [ -e "$wheel_venv.made" ]; then
  if stage "wheel" build_wheel; then
    # what Python code of the documentation runs in
    export TOUCHUP_PYTHON=$wheel_venv/bin/python
    stage "tests of the wheel" wheel_tests
  fi
  stage "Python tests" python_tests
else
  count=$(cat tests/python/test_*.py $wheel_crate/tests/test_*.py | grep -c '^ *def test_')
  skip "$count" "tests/python needs a Python environment in $venv (Debian: apt-get install python3-venv; and access to the packages of $requirements)"
fi

echo
printf '%s\n' "${stages[@]}"
[ "${#reasons[@]}" -eq 0 ] || printf '%s\n' "${reasons[@]}"
[ "$left" -eq 0 ] || echo "$left Rust tests and what is marked full in tests/python belong to --full"
count="$passed passed, $failed failed, $skipped skipped"
[ -z "$is_full" ] || tests/results.sh "$logs/rust.log" "$logs/results" "$count" > docs/results.md || fail "docs/results.md could not be written"
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
