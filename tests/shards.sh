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

# slow_rust FILTER: Rust tests at their full size, including those ignored for their slowness
slow_rust() { stage "Rust tests" rust_tests rust "${everything[@]}" --lib --bins --tests --run-ignored all --filterset "$1"; }

# slow_python_packages REQUIREMENTS: packages for slow proofs alone, into the environment of the quick checks
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

shard_1() {
  title "Sweeps of the published rule and of the robust mode"
  slow_rust 'binary(rooms) & test(/^haptic::/)'
  text haptic::sweeps::the_published_rule_converges_where_no_face_leans_out_of_its_basin_and_only_there "Where the published rule converges"
  text haptic::sweeps::the_guard_lets_the_published_rule_starve_no_face "The published rule, throttled by the longest step of the guard"
  text haptic::sweeps::the_robust_mode_never_blows_up_with_noise_larger_than_half_an_edge "The robust mode"
}

shard_2() {
  title "The report"
  slow_rust 'package(touchup-report)'
  markdown coverage::coverage_is_measured_and_reported "Coverage, four seeds"
  markdown mistakes::mistakes_are_named_and_sound_recordings_raise_no_alarm "Mistakes, two seeds"
}

# weighed NAME FILE LIMIT: in bytes
weighed() {
  local weight; weight=$(stat -c %s "$2") || { note failed "weight of the $1"; return; }
  echo "$(basename "$2"): $weight bytes of at most $3" | tee -a "$logs/weights.txt"
  if [ "$weight" -le "$3" ]; then note passed "weight of the $1"; else note failed "weight of the $1" "$weight bytes, more than $3"; fi
}

# as users get them, in the release profile: the README's first command without an earlier build, and the wheel in an environment of its own
shard_3() {
  title "The first command, and the wheel"
  local wheel_venv=$target/wheel_python wheel begun=$SECONDS
  rm -rf "$target/release" "$target/first_demo"
  checked "first command" cargo run --release -- demo --out "$target/first_demo"
  echo "cargo run --release -- demo: $((SECONDS - begun)) s" > "$logs/weights.txt"
  weighed program "$target/release/touchup" 40000000
  stage "Python packages" python_environment "$wheel_venv" "$wheel_crate/tests/requirements.txt" || { note failed "Python packages"; return; }
  rm -rf "$target/wheel"
  checked "wheel" "$wheel_venv/bin/python" -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$target/wheel" "./$wheel_crate"
  wheel=$(echo "$target"/wheel/touchup-*.whl)
  weighed wheel "$wheel" 12000000
  checked "installation of the wheel" "$wheel_venv/bin/python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps "$wheel"
  # engines of a sweep have a shard of their own
  unset TOUCHUP_FULL
  python=$wheel_venv/bin/python stage "tests of the wheel" package_tests wheel ""
  file "$logs/weights.txt" "Time with its build, and weights"
}

shard_4() {
  title "Machined parts"
  slow_python test_machined.py
  markdown test_machined::test_touched_parts_in_three_worlds "Parts of another modeller in three worlds"
  markdown test_machined::test_touched_parts_in_a_foreign_world "Parts of another modeller in another simulator"
}

# engines of a sweep, on a cluster of this machine
debian_packages[5]="slurm-wlm munge"
shard_5() {
  title "Engines of a sweep"
  slow_python_packages "$wheel_crate/tests/requirements-full.txt" || return
  stage "Python package" install_package || { note failed "Python package"; return; }
  stage "engines" package_tests engines test_ray.py test_engines.py test_mesh.py
}

# links and names in the documentation of the crates; the site against the forge
shard_6() {
  title "Documentation, and judged cases"
  checked "documentation of the crates" env RUSTDOCFLAGS="-D warnings" cargo doc "${everything[@]}" --no-deps
  slow_python test_docs_site.py test_judge.py
  markdown test_judge::test_no_worse_than_the_better_offline_baseline "Judged cases"
}

shard_7() {
  title "Features"
  slow_rust 'binary(rooms) & test(/^(features|form)::/)'
  text features::touched::touched_features_are_found_within_their_stated_uncertainty "Features of the touched plate, fifty seeds"
}

shard_8() {
  title "The surface"
  slow_rust 'binary(rooms) & test(/^reconstruct::accuracy::/)'
  text reconstruct::accuracy::other_tips_balls_hands_and_friction "Other balls, hands and friction, six seeds"
  text reconstruct::accuracy::other_tips_flat_ends "Flat ends, six seeds"
  text reconstruct::accuracy::other_tips_a_cone "A cone, six seeds"
}

# the uncertainty of the surface
shard_17() {
  title "The uncertainty of the surface, its grid and its tips"
  slow_rust 'binary(rooms) & test(/^reconstruct::/) & !test(/^reconstruct::accuracy::/)'
  text reconstruct::uncertainty::what_was_touched_is_as_well_known_as_it_says_where_errors_are_as_the_model_has_them "Stated uncertainty where errors are as the model has them"
  text reconstruct::uncertainty::errors_outside_of_the_model_are_not_in_the_stated_uncertainty "Stated uncertainty where errors are others"
  text reconstruct::tips::contacts_of_a_tip_are_located "Where a tip touched"
}

shard_9() {
  title "Probing"
  slow_rust 'binary(rooms) & test(/^probing::/) & !test(/^probing::execute::uncertainty::errors/)'
  text probing::arm::touching::a_hole_is_found_from_one_click_and_measured "A hole from one click, by a simulated arm"
  markdown probing::decided::deciding_takes_the_touches_that_the_distance_from_the_limit_asks_for "Touches until decided"
  text probing::grid::planned_touches_are_better_than_a_grid_over_the_region "Planned touches and a grid"
}

shard_10() {
  title "Errors of an arm over their uncertainty"
  slow_rust 'binary(rooms) & test(/^probing::execute::uncertainty::errors/)'
  markdown probing::execute::uncertainty::errors_are_as_large_as_stated_of_a_rough_arm "A rough arm"
  markdown probing::execute::uncertainty::errors_are_as_large_as_stated_of_a_calibrated_arm "A calibrated arm"
}

shard_11() {
  title "Comparison, alignment, sessions and files"
  # everything outside of the other shards
  slow_rust 'binary(ros) | (binary(rooms) & !test(/^(features|form|haptic|mesh|probing|reconstruct|scene|sim|stylus)::/))'
}

# the client in the interpreter beside it, against a controller that fails; unit tests, and rooms of many property tests
shard_12() {
  title "Faults of a UR arm"
  slow_rust 'package(touchup) | package(/^touchup-(geometry|method|features|probing|io|session|sim|inspect|node)$/) | binary(ur) | (binary(rooms) & test(/^(mesh|scene|sim|stylus)::/))'
  markdown scripted::faults::each_fault_alone_ends_as_it_should "Faults of the arm"
  markdown scripted::faults::random_scripts_end_as_they_should "Faults at random"
  markdown scripted::hours::hours_of_faults_and_recoveries_leave_no_stuck_state_and_no_memory_behind "Hours of faults at the arm"
}

# other people's programs on the wire
debian_packages[13]="xvfb python3-rosmaster python3-rosbag ros-robot-state-publisher rviz iproute2 libusb-1.0-0 libgl1 libgomp1 libegl1 libx11-6"
shard_13() {
  title "ROS"
  slow_python test_ros_arm.py test_ros_fastdds_network.py test_ros_network.py test_ros_node.py test_ros_rviz.py test_step.py test_web_arm.py
  text test_web_arm::test_the_arm_stands_within_200_ms_of_the_last_beat_and_probes_to_the_end_while_the_button_is_held "Hold to run"
}

# fuzzing guided by coverage, with counters at every branch
shard_14() {
  title "Guided fuzzing"
  fuzz/run 120 > "$logs/fuzz.log" 2>&1
  cat "$logs/fuzz.log"
  awk '$1 ~ /^[a-z]/ && $3 == "executions" { end[$1] = "passed" } /^failed: fuzz target / { sub(/;/, "", $4); end[$4] = "failed" }
       END { for (name in end) print end[name] "\tfuzz " name "\t" }' "$logs/fuzz.log" >> "$logs/notes.tsv"
  grep -q '^[0-9]* executions: [0-9]* passed' "$logs/fuzz.log" || note failed "fuzz/run" "it did not count"
  file "$logs/fuzz.log" "Executions, and edges of the code that they reached"
}

# the parts of the node on r2r that run without ROS; and the library without features
shard_15() {
  title "Other builds"
  checked "lint of r2r" cargo clippy --package touchup-node --lib --features r2r-check -- -D warnings
  stage "tests of r2r" rust_tests r2r --package touchup-node --lib --features r2r-check --filterset 'test(/r2r/)'
  checked "without features" cargo check --lib --no-default-features
  checked "lint of the wheel" cargo clippy --package touchup-python --features abi3 -- -D warnings
}

# the page of an ended session, and slow blocks of the documentation
shard_16() {
  title "Replays, and blocks of the documentation"
  slow_python test_web_replay.py test_docs_code.py
}

# a minute or two at a time passes in which nothing happens
shard_18() {
  title "ROS: programs that stand still"
  slow_python test_ros_pauses.py
}

shard_count=$(declare -F | grep -c ' shard_[0-9]*$')
