//! Evidence for the surface: contacts, free space, signed distance of the scan.

pub(in crate::reconstruct) mod agreement;
pub(in crate::reconstruct) mod contact_map;
pub(in crate::reconstruct) mod contact_statistics;
pub(in crate::reconstruct) mod contact_uncertainty;
pub(in crate::reconstruct) mod double_contact;
pub(in crate::reconstruct) mod free_space;
pub(super) mod inner_corner;
pub(in crate::reconstruct) mod kept_detail;
pub(in crate::reconstruct) mod outliers;
pub(super) mod piecewise;
pub(in crate::reconstruct) mod point_evidence;
pub(in crate::reconstruct) mod probed_log;
pub(in crate::reconstruct) mod scan_distance;
pub(in crate::reconstruct) mod stroke_log;
pub(in crate::reconstruct) mod touch_history;
pub(in crate::reconstruct) mod touches;
pub(in crate::reconstruct) mod voxel_set;
