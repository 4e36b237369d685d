#!/usr/bin/env bash
# Runs every test: cargo test, then tests/python against the binary that it built.
#
#   tests/all.sh [--full]      --full: also the slow proofs (TOUCHUP_FULL=1, ten times the property cases)
#
# Needs cargo and a C compiler. Python packages go into target/python; logs into target/test-logs. What cannot run here
# is counted as skipped, with its reason. Tests that keep time with a robot, a network or a disk fail where the machine stands
# still: one of them that failed is run once more, by itself, and told apart from what passed at once. Where it fails again, and
# the machine stood still meanwhile, that says nothing, and it is counted as skipped. Any other that fails has failed. The last
# line is the count; the exit code is 0 only when nothing failed.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1

case "${1-}" in
  "") ;;
  --full) export TOUCHUP_FULL=1 PROPTEST_CASES=2560 ;;
  *) echo "usage: tests/all.sh [--full]" >&2; exit 2 ;;
esac

target=${CARGO_TARGET_DIR:-target}
case $target in /*) ;; *) target=$PWD/$target ;; esac
logs=$target/test-logs
venv=$target/python
passed=0 failed=0 skipped=0 again=0
reasons=()
ur=()
# ten periods of an arm
too_late_ms=20
rm -rf "$logs" && mkdir -p "$logs" || exit 1

skip() { skipped=$((skipped + $1)); reasons+=("$1 skipped: $2"); }
fail() { failed=$((failed + 1)); reasons+=("failed: $1"); }

# the system libraries that open3d and pymeshlab load, each with its Debian package
missing_packages() {
  local known; known=$(PATH=$PATH:/sbin:/usr/sbin ldconfig -p 2>/dev/null)
  while read -r library package; do
    grep -qF "$library" <<<"$known" || printf '%s ' "$package"
  done <<'LIBRARIES'
libusb-1.0.so.0 libusb-1.0-0
libGL.so.1 libgl1
libgomp.so.1 libgomp1
libEGL.so.1 libegl1
libX11.so.6 libx11-6
LIBRARIES
}

# makes target/python, once for each state of requirements.txt
python_environment() {
  local wanted; wanted=$(cksum < tests/python/requirements.txt)
  [ "$(cat "$venv.made" 2>/dev/null)" = "$wanted" ] && return 0
  rm -rf "$venv" "$venv.made"
  {
    python3 -m venv "$venv" && "$venv/bin/python" -m pip install --quiet --disable-pip-version-check -r tests/python/requirements.txt
  } > "$logs/pip.log" 2>&1 || { tail -n 5 "$logs/pip.log" >&2; return 1; }
  echo "$wanted" > "$venv.made"
}

# a UR arm needs a Python to link with, its shared library and what finds that; the tests install ur-rtde by themselves
ur_feature() {
  PYO3_PYTHON=$(command -v python3) && export PYO3_PYTHON && python3 - <<'PYTHON' && ur=(--features ur)
import os, sys, sysconfig
folder, library = map(sysconfig.get_config_var, ("LIBDIR", "LDLIBRARY"))
sys.exit(not (library.endswith(".so") and os.path.exists(os.path.join(folder, library))))
PYTHON
}

# lines of passing tests, and what they print, go into the log alone
without_passing() {
  sed -u -e '/^successes:$/,/^\(failures:$\|test result: \)/{/^\(failures:$\|test result: \)/!d}' -e '/^test .* \.\.\. ok$/d' -e '/^$/d'
}

# of a log of cargo test: "target<TAB>test" for each that failed; a target that ended without counting has no name of a test
failed_tests() {
  awk '/^     Running unittests src\/lib\.rs/ { target = "--lib"; begun[target] }
       /^     Running unittests src\/main\.rs/ { target = "--bin touchup"; begun[target] }
       /^     Running tests\// { target = $2; sub(/^tests\//, "", target); sub(/\.rs$/, "", target); target = "--test " target; begun[target] }
       /^   Doc-tests / { target = "--doc"; begun[target] }
       /^test result: / { counted[target] }
       /^test .* \.\.\. FAILED$/ { name = $0; sub(/^test /, "", name); sub(/ \.\.\. FAILED$/, "", name); print target "\t" name }
       END { for (target in begun) if (!(target in counted)) print target "\t" }' "$1"
}

# watch_time FILE: how late this machine is from now on, until end_watch: one that sleeps a millisecond for each of two
# processors, and sees when it wakes
watch_time() {
  rm -f "$1".*
  python3 - "$1" <<'PYTHON' &
import os, signal, sys, time
is_over, worst, children = False, 0.0, []
def end(*_):
    global is_over
    is_over = True
signal.signal(signal.SIGTERM, end)
for k in range(2):
    if (child := os.fork()) == 0:
        while not is_over:
            begun = time.perf_counter()
            time.sleep(1e-3)
            worst = max(worst, time.perf_counter() - begun - 1e-3)
        with open(f"{sys.argv[1]}.{k}", "w") as told:
            print(round(1e3 * worst), file=told)
        os._exit(0)
    children.append(child)
open(f"{sys.argv[1]}.begun", "w").close()
while not is_over:
    time.sleep(0.01)
for child in children:
    os.kill(child, signal.SIGTERM)
    os.waitpid(child, 0)
PYTHON
  watcher=$!
  until [ -e "$1.begun" ] || ! kill -0 "$watcher" 2> /dev/null; do sleep 0.02; done
}

# end_watch FILE: sets late_ms, the longest that one of them overslept
end_watch() {
  kill -TERM "$watcher" && wait "$watcher"
  late_ms=$(cat "$1.0" "$1.1" | sort -n | tail -n 1)
}

# failed_again NAME: what failed the second time, by itself
failed_again() {
  if [ "${late_ms:-0}" -ge "$too_late_ms" ]; then
    skip 1 "$1: failed twice, and this machine stood still for up to $late_ms ms"
  else
    fail "$1"
  fi
}

# whether a test keeps time with something outside of it: of "target<TAB>test", or a name as told_by_pytest has it
keeps_time() {
  case $1 in
    "--test ur"* | "--test ros_node"* | "--test node_arm"* | "--test live"*) ;;
    *ros::* | *session::* | tests.python.test_ros_*) ;;
    *) return 1 ;;
  esac
}

# cargo_tests LOG ARGUMENT...: of what fails, what keeps time is run once more, one at a time
cargo_tests() {
  local log=$1 status counts told; shift
  cargo test --no-fail-fast "$@" -- --show-output 2>&1 | tee "$log" | without_passing
  status=${PIPESTATUS[0]}
  counts=$(awk '/^test result: / { p += $4; i += $8 } END { print p + 0, i + 0 }' "$log")
  read -r told_passed told_ignored <<<"$counts"
  # a test that could not run says so and passes: count it as what it is
  told=$(grep -c '^SKIPPED: ' "$log")
  passed=$((passed + told_passed - told))
  [ "$told_ignored" -eq 0 ] || skip "$told_ignored" "ignored Rust tests"
  while read -r reason; do skip 1 "${reason#SKIPPED: }"; done < <(grep '^SKIPPED: ' "$log")
  [ "$status" -ne 0 ] || return
  failed_tests "$log" > "$log.failed"
  [ -s "$log.failed" ] || { fail "cargo test $* ended with $status, see $log"; return; }
  while IFS=$'\t' read -r test_target name; do
    if [ -z "$name" ]; then fail "cargo test $* $test_target ended before the end of its tests, see $log"; continue; fi
    if ! keeps_time "$test_target"$'\t'"$name"; then fail "$test_target $name"; continue; fi
    case " $* " in *" --lib "*) test_target= ;; esac
    echo "== once more by itself: $test_target $name"
    # shellcheck disable=SC2086 # a target is an option and its value
    local is_good=
    watch_time "$logs/late"
    cargo test "$@" $test_target -- --exact "$name" --test-threads 1 --show-output < /dev/null > "$log.again" 2>&1 && is_good=yes
    end_watch "$logs/late"
    if [ -n "$is_good" ] && grep -q '^test result: ok. 1 passed' "$log.again"; then
      passed=$((passed + 1)) again=$((again + 1)) reasons+=("passed the second time, by itself: $test_target $name")
    else
      grep -v '^ *Compiling ' "$log.again" | tail -n 40
      failed_again "$test_target $name"
    fi
  done < "$log.failed"
}

# the node on r2r has its own build, of which without ROS only the tests of its parts can run
rust_tests() {
  cargo_tests "$logs/rust.log" "${ur[@]}"
  cargo_tests "$logs/rust_r2r.log" --no-default-features --features r2r-check --lib ros::r2r
}

python_tests() {
  export TOUCHUP_BIN=$target/debug/touchup
  if [ "${#ur[@]}" -gt 0 ]; then
    # of the Rust tests: with a UR arm, and the stand-in for its controller
    export TOUCHUP_UR_BIN=$target/debug/touchup TOUCHUP_UR_CONTROLLER=$target/debug/examples/ur_controller
  fi
  TOUCHUP_MISSING_PACKAGES=$(missing_packages)
  export TOUCHUP_MISSING_PACKAGES
  local options=(-rs --tb=short --no-header -o "cache_dir=$logs/pytest_cache") status summary bad
  "$venv/bin/python" -m pytest tests/python "${options[@]}" --durations=10 --junitxml="$logs/python.xml" 2>&1 | tee "$logs/python.log"
  status=${PIPESTATUS[0]}
  [ "$status" -eq 5 ] && return # no test in the folder
  summary=$(told_by_pytest "$logs/python.xml") || { fail "pytest ended with $status, see $logs/python.log"; return; }
  read -r told_passed bad <<<"$(head -n 1 <<<"$summary")"
  passed=$((passed + told_passed))
  while read -r reason; do skip 1 "${reason#skipped }"; done < <(grep '^skipped ' <<<"$summary")
  if [ "$bad" -gt 0 ]; then
    echo "== once more by themselves: $bad of tests/python"
    watch_time "$logs/late"
    "$venv/bin/python" -m pytest tests/python "${options[@]}" --lf --junitxml="$logs/python_again.xml" 2>&1 | tee "$logs/python_again.log"
    end_watch "$logs/late"
    summary=$(told_by_pytest "$logs/python_again.xml") || { failed=$((failed + bad - 1)); fail "$bad of tests/python, see $logs/python.log"; return; }
    while read -r reason; do
      if ! keeps_time "${reason#passed }"; then fail "${reason#passed }, the first time"; continue; fi
      passed=$((passed + 1)) again=$((again + 1)) reasons+=("passed the second time: ${reason#passed }")
    done < <(grep '^passed ' <<<"$summary")
    while read -r reason; do
      if keeps_time "${reason#failed }"; then failed_again "${reason#failed }"; else fail "${reason#failed }"; fi
    done < <(grep '^failed ' <<<"$summary")
  elif [ "$status" -ne 0 ]; then
    fail "pytest ended with $status, see $logs/python.log"
  fi
}

# of a report in JUnit's form: how many passed and failed, then a line for each with its name, and why it was skipped
told_by_pytest() {
  "$venv/bin/python" - "$1" <<'PYTHON'
import sys, xml.etree.ElementTree as tree
cases = {"passed": [], "failed": [], "skipped": []}
for case in tree.parse(sys.argv[1]).iter("testcase"):
    name = case.get("classname", "") + "." + case.get("name")
    if case.find("failure") is not None or case.find("error") is not None:
        cases["failed"].append(name)
    elif case.find("skipped") is not None:
        cases["skipped"].append(case.get("name") + ": " + case.find("skipped").get("message", ""))
    else:
        cases["passed"].append(name)
print(len(cases["passed"]), len(cases["failed"]))
for kind, names in cases.items():
    for name in names:
        print(kind, name)
PYTHON
}

echo "== Rust tests"
ur_feature || skip "$(cat tests/ur.rs tests/ur/*.rs | grep -c '^#\[test\]')" "a UR arm needs the shared library of Python (Debian: apt-get install python3-dev)"
rust_tests
echo "== Python tests"
if [ ! -x "$target/debug/touchup" ]; then
  fail "cargo test built no $target/debug/touchup"
elif python_environment; then
  python_tests
else
  count=$(cat tests/python/test_*.py 2>/dev/null | grep -c '^ *def test_')
  skip "$count" "tests/python needs a Python environment in $venv (Debian: apt-get install python3-venv; and a way to the packages of tests/python/requirements.txt)"
fi

echo
[ "${#reasons[@]}" -eq 0 ] || printf '%s\n' "${reasons[@]}"
[ "$again" -eq 0 ] || echo "$again of those that passed did so the second time, by themselves"
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
