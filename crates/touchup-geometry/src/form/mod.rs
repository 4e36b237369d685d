//! Form of touched surfaces and relations between features, as in the tolerances of a drawing (ISO
//! 1101), with their uncertainty.
//!
//! [`roundness`] and its kin take points as they are; [`round_form()`] and [`flat_form()`] take
//! noisy points, and keep their longest undulations; [`orientation`], [`coaxiality`], [`distance`],
//! [`position`] and their kin take fitted axes and planes.

mod chebyshev;
mod datum;
mod element;
mod flat_form;
mod profile;
mod relation;
mod round_form;
mod zone;

pub use datum::datum_frame;
pub use element::{Element, Shape};
pub use flat_form::{FlatForm, flat_form};
pub use profile::{Estimate, FormPoint};
pub use relation::{
    OrientationDeviation, angle, coaxiality, concentricity, distance, orientation, position,
};
pub use round_form::{Deviation, RoundForm, round_form};
pub use zone::{Zone, cylindricity, flatness, roundness, straightness};
