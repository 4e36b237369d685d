//! What `refine` tells of how well the mesh is known, and of touches that contradicted it.

use std::fmt;

use serde::Serialize;

use touchup_core::patch::{Knock, Knocks, Patched, Support};

/// What `--json` prints of the uncertainty.
#[derive(Debug, Serialize)]
pub struct UncertaintySummary {
    /// median standard deviation of the vertices that were touched
    touched_sigma_mm: f64,
    /// contacts that contradicted their place and did not count
    held_apart: u64,
    /// places that moved because a second pass contradicted them in the same way
    insisted: u64,
    /// the last that were held apart, in order of time
    knocks: Vec<KnockFound>,
}

/// Contacts one after the other that were held apart.
#[derive(Debug, Serialize)]
struct KnockFound {
    /// stamp of the first
    stamp_s: f64,
    /// where the one was that contradicted most
    point_mm: [f64; 3],
    /// … and its normal
    normal: [f64; 3],
    /// how far it was outside of the place
    off_mm: f64,
    /// … in standard deviations
    sigmas: f64,
    contacts: u64,
}

/// So many are told.
const TOLD: usize = 8;

impl UncertaintySummary {
    /// What a patcher says of its result.
    pub fn of(patched: &Patched, knocks: &Knocks) -> Self {
        let known = patched.sigma.iter().zip(&patched.support);
        let mut touched: Vec<f64> =
            known.filter(|(_, support)| **support == Support::Touched).map(|(sigma, _)| sigma * 1e3).collect();
        touched.sort_by(f64::total_cmp);
        let skipped = knocks.last().count().saturating_sub(TOLD);
        Self {
            touched_sigma_mm: touched.get(touched.len() / 2).copied().unwrap_or_default(),
            held_apart: knocks.held_apart,
            insisted: knocks.insisted,
            knocks: knocks.last().skip(skipped).map(KnockFound::of).collect(),
        }
    }
}

impl KnockFound {
    fn of(knock: &Knock) -> Self {
        let Knock { stamp_ns, point, normal, innovation, sigmas, contacts } = *knock;
        Self {
            stamp_s: stamp_ns as f64 * 1e-9,
            point_mm: [point.x, point.y, point.z].map(|x| x * 1e3),
            normal: normal.into(),
            off_mm: innovation * 1e3,
            sigmas,
            contacts,
        }
    }
}

impl fmt::Display for UncertaintySummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { touched_sigma_mm, held_apart, insisted, knocks } = self;
        write!(
            f,
            "known: within {touched_sigma_mm:.3} mm (median standard deviation) where touched; {held_apart} contacts held \
             apart, {insisted} places moved by a second pass"
        )?;
        let Some(KnockFound { point_mm: [x, y, z], off_mm, sigmas, .. }) = knocks.last() else { return Ok(()) };
        write!(f, "; last knock at ({x:.1}, {y:.1}, {z:.1}) mm, {off_mm:+.3} mm or {sigmas:.0} standard deviations off")
    }
}
