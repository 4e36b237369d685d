//! The joint angles of an arm.

use std::fmt;
use std::ops::{Deref, DerefMut};

/// Maximum number of joints.
pub const MOST_JOINTS: usize = 8;

/// Joint angles from the base to the wrist, rad; up to [`MOST_JOINTS`], stored in place.
#[derive(Clone, Copy)]
pub struct Joints {
    /// zero from `count` on
    angles: [f64; MOST_JOINTS],
    count: usize,
}

impl Joints {
    /// Joints with these angles; `None` for more than [`MOST_JOINTS`].
    pub fn of(angles: &[f64]) -> Option<Self> {
        let mut joints = Self {
            angles: [0.0; MOST_JOINTS],
            count: angles.len(),
        };
        joints
            .angles
            .get_mut(..angles.len())?
            .copy_from_slice(angles);
        Some(joints)
    }

    /// Maps each angle, with the number of its joint from 0 at the base.
    pub fn mapped(mut self, mut angle: impl FnMut(usize, f64) -> f64) -> Self {
        self.iter_mut()
            .enumerate()
            .for_each(|(joint, it)| *it = angle(joint, *it));
        self
    }
}

impl<const N: usize> From<[f64; N]> for Joints {
    fn from(of: [f64; N]) -> Self {
        const { assert!(N <= MOST_JOINTS, "no arm has so many joints") };
        let mut angles = [0.0; MOST_JOINTS];
        angles[..N].copy_from_slice(&of);
        Self { angles, count: N }
    }
}

impl Deref for Joints {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.angles[..self.count]
    }
}

impl DerefMut for Joints {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.angles[..self.count]
    }
}

impl PartialEq for Joints {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl fmt::Debug for Joints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

/// Largest turn of one joint between two configurations, rad.
pub(crate) fn largest_turn(from: &Joints, to: &Joints) -> f64 {
    from.iter()
        .zip(to.iter())
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}
