#!/usr/bin/env bash
# Runs every test: cargo test, then tests/python against the release binary.
#
#   tests/all.sh [--full]      --full: also the slow proofs (TOUCHUP_FULL=1, ten times the property cases)
#
# Needs cargo and a C compiler. Python packages go into target/python; logs into target/test-logs. What cannot run here
# is counted as skipped, with its reason. The last line is the count; the exit code is 0 only when nothing failed.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1

case "${1-}" in
  "") ;;
  --full) export TOUCHUP_FULL=1 PROPTEST_CASES=2560 ;;
  *) echo "usage: tests/all.sh [--full]" >&2; exit 2 ;;
esac

target=${CARGO_TARGET_DIR:-target}
logs=$target/test-logs
venv=$target/python
passed=0 failed=0 skipped=0
reasons=()
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

# the node on r2r has its own build, of which without ROS only the tests of its parts can run
cargo_tests() {
  local status=0
  cargo test --no-fail-fast -- --show-output || status=$?
  cargo test --no-fail-fast --no-default-features --features r2r-check --lib ros::r2r -- --show-output || status=$?
  return "$status"
}

rust_tests() {
  cargo_tests 2>&1 | tee "$logs/rust.log"
  local status=${PIPESTATUS[0]} counts told
  counts=$(awk '/^test result: / { p += $4; f += $6; i += $8 } END { print p + 0, f + 0, i + 0 }' "$logs/rust.log")
  read -r told_passed told_failed told_ignored <<<"$counts"
  # a test that could not run says so and passes: count it as what it is
  told=$(grep -c '^SKIPPED: ' "$logs/rust.log")
  passed=$((passed + told_passed - told)) failed=$((failed + told_failed))
  [ "$told_ignored" -eq 0 ] || skip "$told_ignored" "ignored Rust tests"
  while read -r reason; do skip 1 "${reason#SKIPPED: }"; done < <(grep '^SKIPPED: ' "$logs/rust.log")
  if [ "$status" -ne 0 ] && [ "$told_failed" -eq 0 ]; then fail "cargo test ended with $status, see $logs/rust.log"; fi
}

python_tests() {
  TOUCHUP_BIN=$PWD/$target/release/touchup
  case $target in /*) TOUCHUP_BIN=$target/release/touchup ;; esac
  export TOUCHUP_BIN
  TOUCHUP_MISSING_PACKAGES=$(missing_packages) "$venv/bin/python" -m pytest tests/python -rs --tb=short \
    -p no:cacheprovider --junitxml="$logs/python.xml" 2>&1 | tee "$logs/python.log"
  local status=${PIPESTATUS[0]}
  [ "$status" -eq 5 ] && return # no test in the folder
  local summary
  summary=$("$venv/bin/python" - "$logs/python.xml" <<'PYTHON'
import sys, xml.etree.ElementTree as tree
cases = list(tree.parse(sys.argv[1]).iter("testcase"))
bad = [c for c in cases if c.find("failure") is not None or c.find("error") is not None]
left = [c for c in cases if c.find("skipped") is not None]
print(len(cases) - len(bad) - len(left), len(bad))
for case in left:
    print(case.get("name") + ": " + case.find("skipped").get("message", ""))
PYTHON
  ) || { fail "pytest ended with $status, see $logs/python.log"; return; }
  read -r told_passed told_failed <<<"$(head -n 1 <<<"$summary")"
  passed=$((passed + told_passed)) failed=$((failed + told_failed))
  while read -r reason; do [ -z "$reason" ] || skip 1 "$reason"; done < <(tail -n +2 <<<"$summary")
  if [ "$status" -ne 0 ] && [ "$told_failed" -eq 0 ]; then fail "pytest ended with $status, see $logs/python.log"; fi
}

echo "== release build"
if cargo build --release; then built=yes; else built=; fail "cargo build --release"; fi
echo "== Rust tests"
rust_tests
echo "== Python tests"
if [ -z "$built" ]; then
  :
elif python_environment; then
  python_tests
else
  count=$(cat tests/python/test_*.py 2>/dev/null | grep -c '^ *def test_')
  skip "$count" "tests/python needs a Python environment in $venv (Debian: apt-get install python3-venv; and a way to the packages of tests/python/requirements.txt)"
fi

echo
[ "${#reasons[@]}" -eq 0 ] || printf '%s\n' "${reasons[@]}"
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
