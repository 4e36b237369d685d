//! One session: the scene file, both rates side by side, and the result.
//!
//! | module | what it does |
//! |---|---|
//! | [`clock`] | steady time, of the machine or of a test that moves it |
//! | [`scene`] | the YAML that names the parts of a scene and their parameters |
//! | [`live`] | the engine: the haptic update at every sample, the patch beside it or at the end |
//! | [`replay`] | a recording from its first message to its last, as messages or as samples |
//! | [`session`] | one run: its recording, its result, and the inputs that reproduce it |
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

/// Declares a struct of a report and how it is made, a field at a time: its name with the unit, its type, and the number that it shows.
///
/// ```
/// touchup_session::reported! {
///     #[derive(Debug, PartialEq)]
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
        $($(#[$field_meta:meta])* $field_vis:vis $field:ident: $Field:ty = $value:expr),* $(,)?
    }) => {
        $(#[$meta])*
        $vis struct $Name {
            $($(#[$field_meta])* $field_vis $field: $Field,)*
        }

        impl $Name {
            /// What is reported of these.
            $of fn of($($from: $From),*) -> Self {
                Self { $($field: $value,)* }
            }
        }
    };
}

pub mod clock;
pub mod live;
pub mod replay;
pub mod scene;
pub mod session;
