# The slow proofs, for tests/all.sh: each function `shard_K` is one of at most 8 minutes on two cores. `debian_packages[K]` are those
# that .ci/run installs for it.
declare -A debian_packages=()

# title TEXT: heading of its section in docs/results.md
title() { printf 'title\t%s\n' "$1" > "$logs/section.tsv"; }

# slow_rust FILTER: Rust tests at their full size, those too that are ignored for their slowness
slow_rust() { stage "Rust tests" rust_tests rust --run-ignored all --filterset "$1"; }

# slow_python FILE...: of tests/python, at their full size, with the packages that only slow proofs need
slow_python() {
  stage "Python packages" python_environment "$venv" tests/python/requirements-full.txt && stage "Python tests" python_tests python "$PWD" "$@"
}

# text TEST HEADING, markdown TEST HEADING: the output of a test belongs into the section
text() { printf 'text\t%s\t%s\n' "$@" >> "$logs/section.tsv"; }
markdown() { printf 'markdown\t%s\t%s\n' "$@" >> "$logs/section.tsv"; }

shard_count=$(declare -F | grep -c ' shard_[0-9]*$')
