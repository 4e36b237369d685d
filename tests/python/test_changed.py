"""Recordings of a given case, changed as a mistake would change them: `touchup doctor` says what changed, and nothing of the unchanged."""

from changed.make import make_all
from changed.score import score_all


def test_a_part_that_moved_half_way_is_found_and_a_recording_written_again_is_sound(touchup_bin, shared, tmp_path):
    cases = shared / "data" / "cases"
    kinds = ["rewritten", "part_shift_z"]
    assert make_all(tmp_path, [cases / "plate"], kinds, ["large"], 70.0, 1) == 2
    folders = [tmp_path / f"plate__{kind}" for kind in ("rewritten__whole", "part_shift_z__large")]
    sound, moved = score_all(folders, cases, touchup_bin, 1)
    assert not sound["is_named"], sound
    assert moved["is_sure"] and moved["is_right"], moved
    found, true, sigma = (moved["numbers"]["shift_z_mm"][key] for key in ("found", "true", "sigma"))
    assert true == 1.0 and sigma < 0.1, moved
    assert abs(found - true) < 3 * sigma, moved
