"""Causes that name a kind of mistake rightly."""

# controls: nothing may be said of them
CONTROLS = ("unchanged", "rewritten", "turned")
# no cause of its own: whatever is said is right
ANY = ("*",)

ACCEPTED = {
    ("part_moved",): """
        part_shift_x part_shift_y part_shift_z part_shift_early part_shift_late part_shift_twice part_turn_x part_turn_y part_turn_z
        part_moved part_moved_early part_drift_x part_drift_z part_drift_turn tracker_jump_back tracker_sway
    """,
    ("part_moved", "frame"): "part_turned_over",
    ("tip_bent",): "tip_bent_x tip_bent_y tip_bent_z tip_bent_early tip_bent_late tip_bent_drift",
    ("tip_offset",): "tip_offset_x tip_offset_y tip_offset_z",
    ("radius",): "radius_told_larger radius_told_smaller",
    ("stiffness",): "stiffness_told_higher stiffness_told_lower",
    ("stiffness_changed",): "stiffness_changes_halfway",
    ("tare",): "tare_x tare_z tare_drift rezeroed_in_contact_halfway weight_not_compensated",
    ("stiffness", "force_unit"): "force_scale",
    ("force_gains",): "force_scale_one_axis force_crosstalk",
    ("wrench_frame",): "force_sensor_turned_x force_sensor_turned_z",
    ("wrench_frame", "wrench_sign"): "force_axis_mirrored",
    ("wrench_sign",): "force_sign_flipped",
    ("force_steps",): "force_rounded",
    ("saturation",): "force_clipped",
    ("delay",): "force_low_passed pose_low_passed clock_delay clock_ahead clock_drift clock_step_halfway",
    ("delay", "stamps_go_back"): "clock_jitter",
    ("force_unit", "light_touch", "no_contact", "stiffness"): "unit_lbf unit_kgf unit_ounce",
    ("pose_held",): "pose_held",
    ("slow_poses",): "pose_dropped",
    ("length_unit",): "pose_unit_mm",
    ("position_axes",): "pose_axes_swapped pose_axis_mirrored",
    ("quaternion_order", "wrench_frame"): "pose_quaternion_wrong_order",
    ("frame",): "scan_shifted_x scan_shifted_z scan_turned",
    ("length_unit", "frame"): "scan_scaled pose_scale",
    ANY: "pose_rounded tracker_wander tracker_outliers wrench_dropped",
}
CAUSES_OF = {kind: causes for causes, kinds in ACCEPTED.items() for kind in kinds.split()}
