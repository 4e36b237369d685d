//! Mesh files, recordings and picked points: with the scene file the only code that touches the
//! disk.
//!
//! | module | files |
//! |---|---|
//! | [`mesh_file`] | meshes and point clouds: PLY, STL, OBJ, PCD, XYZ, E57 |
//! | [`step_file`] | boundary representations: STEP |
//! | [`recording`] | recordings of poses and wrenches: MCAP, rosbag2, ROS 1 bags, tables; surfaces known of their touches |
//! | [`tables`] | tables of text: picked points, static poses |
//! | [`features_file`], [`touches_file`], [`probed_touches_file`], [`result_table`] | measured features and touches |
//! | [`nominal_file`], [`inspection_file`], [`qif_file`] | drawings, and inspections against them |
//! | [`scan_folder`], [`session_folder`], [`result_folder`] | folders of scans, sessions and results |
//! | [`urdf`], [`json_lines`], [`text_file`], [`png`](mod@png) | an arm, records, texts, pictures |
//! | [`atomic`], [`file_kind`], [`content_hash`], [`file_error`], [`machine`] | whole files, their kinds by name, their content as a number, their errors, the machine |
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

/// Declares a report's struct and its constructor, a field at a time: name with unit, type, and
/// reported number. A field `name?` has the type within the `Option`, and JSON omits its `None`.
///
/// ```
/// touchup_io::reported! {
///     #[derive(PartialEq)]
///     struct BallReport, fn of(radius: f64) {
///         /// in the unit of people
///         radius_mm: f64 = radius * 1e3,
///     }
/// }
/// assert_eq!(BallReport::of(0.0015), BallReport { radius_mm: 1.5 });
/// ```
#[macro_export]
macro_rules! reported {
    ($(#[$meta:meta])* $vis:vis struct $Name:ident, $of:vis fn of($($from:ident: $From:ty),*) {
        $($(#[$field_meta:meta])* $field_vis:vis $field:ident $(?: $Known:ty)? $(: $Field:ty)? = $value:expr),* $(,)?
    }) => {
        #[derive(Debug, serde::Serialize)]
        $(#[$meta])*
        $vis struct $Name {
            $(
                $(#[$field_meta])*
                $(#[serde(skip_serializing_if = "Option::is_none")] $field_vis $field: Option<$Known>,)?
                $($field_vis $field: $Field,)?
            )*
        }

        impl $Name {
            /// The report.
            $of fn of($($from: $From),*) -> Self {
                Self { $($field: $value,)* }
            }
        }
    };
}

pub mod atomic;
pub mod content_hash;
pub mod features_file;
pub mod file_error;
pub mod file_kind;
pub mod inspection_file;
pub mod json_lines;
pub mod machine;
pub mod mesh_file;
pub mod nominal_file;
pub mod png;
pub mod probed_touches_file;
pub mod qif_file;
pub mod recording;
pub mod result_folder;
pub mod result_table;
mod scalar;
pub mod scan_folder;
pub mod session_folder;
pub mod step_file;
pub mod tables;
pub mod text_file;
pub mod touches_file;
pub mod urdf;
