//! Uncertainty of the fit of the contacts at a point, and of the vertices of a patched mesh.
//!
//! The fit is a weighted mean of the contacts around, so the noise of each enters by its weight,
//! together with that of the others in the same smoothing window. On a surface that the pieces
//! describe, this is all. Elsewhere the contacts show it: they scatter around the fit, they end, or
//! another surface is so near that the ball touched both.

use nalgebra::Point3;

use crate::reconstruct::evidence::contact_map::ContactMap;
use crate::reconstruct::evidence::piecewise::{
    FieldParams, FieldScratch, FieldValue, Member, PassShare,
};
use crate::reconstruct::evidence::point_evidence::Evidence;
use crate::reconstruct::support::Support;

/// Uncertainty of the fit, by cause; standard deviations, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FitSigma {
    /// noise of the contacts
    pub noise: f64,
    /// directions of their normals, at their distance
    pub tilt: f64,
    /// residual calibration error; the same everywhere
    pub calibration: f64,
    /// contacts that do not lie on one smooth piece
    pub scatter: f64,
    /// turn of the surface between contacts and beyond the last one, as much as the contacts around
    /// it turn
    pub turning: f64,
    /// another surface nearby, without a touched edge between them
    pub meeting: f64,
    /// at an edge, the error of both surfaces that meet there
    pub edge: f64,
}

impl FitSigma {
    /// All causes together, m.
    pub(crate) fn total(&self) -> f64 {
        let Self {
            noise,
            tilt,
            calibration,
            scatter,
            turning,
            meeting,
            edge,
        } = *self;
        [tilt, calibration, scatter, turning, meeting, edge]
            .iter()
            .fold(noise, |sum, part| sum.hypot(*part))
    }
}

/// Error of the fit as a share of the scatter of the contacts: ten of them would leave a third if
/// they were independent.
const SCATTER: f64 = 0.33;
/// Maximum turn of a plane beyond its last contact, rad: 3°.
const TURN: f64 = 0.053;
/// Turn share: turn of a surface before the next contact, near contacts that face otherwise, as a
/// share of the angle between.
const TURN_SHARE: f64 = 0.45;
/// Gap to the nearest contact, in σ, that doubles the turn share, which grows with the square of
/// the gap: the ball may have bridged a hole.
const DOUBLING_GAP: f64 = 0.7;
/// Maximum turn share.
const TURN_SHARE_IN_GAP: f64 = 1.2;
/// Turn share beyond the last contact: the surface may go on as a wall does.
const TURN_SHARE_AT_BORDER: f64 = 0.75;
/// Turn share at a known edge.
const TURN_SHARE_AT_EDGE: f64 = 0.06;
/// Difference of normals on a plane by noise and friction alone, rad: 11°.
const TURN_NOISE: f64 = 0.2;
/// Range behind the nearest contact, in σ, of contacts that face otherwise and turn the surface.
const TURN_REACH: f64 = 2.0;
/// Maximum error of the fit near two meeting surfaces, both under the ball, as a share of σ.
const MEETING: f64 = 0.15;
/// Excess distance of the other of two meeting surfaces, in σ, over which its error falls to 0.
const MEETING_REACH: f64 = 1.2;
/// Excess distance, in σ, over which the second surface of an edge ceases to count.
const EDGE_REACH: f64 = 0.5;
/// Window length over correlation time: a parabola over a window of length T has the variance of
/// noise of correlation time T / 2.25.
const WINDOW_TO_CORRELATION: f64 = 2.25;

impl FieldParams {
    /// Uncertainty of the value last found at `x` with the same scratch.
    ///
    /// - `window_ns`: passes within this time share their noise, the nearer the more.
    pub(crate) fn sigma_of(
        &self,
        found: &FieldValue,
        store: &ContactMap,
        x: &Point3<f64>,
        window_ns: i64,
        scratch: &mut FieldScratch,
    ) -> FitSigma {
        let nearest_other = scratch.nearest_other(found.value);
        let Some([calibration, scatter]) = contact_errors(store, x, scratch) else {
            return FitSigma::default();
        };
        let FieldScratch { near, shares, .. } = scratch;
        let [noise, tilt] = variances(shares, (window_ns as f64 / WINDOW_TO_CORRELATION) as i64);
        let nearness = |reach: f64| (1.0 - nearest_other / (reach * self.sigma)).max(0.0);
        let gap = found.lateral() / (DOUBLING_GAP * self.sigma);
        let share = match (found.is_edge, found.is_border) {
            (true, _) => TURN_SHARE_AT_EDGE,
            (false, true) => TURN_SHARE_AT_BORDER,
            (false, false) => (TURN_SHARE * (1.0 + gap * gap)).min(TURN_SHARE_IN_GAP),
        };
        let turn = (share * self.turn_around(found, store, x, near)).hypot(if found.is_border {
            TURN
        } else {
            0.0
        });
        let fit = FitSigma {
            noise: noise.sqrt(),
            tilt: tilt.sqrt(),
            calibration,
            scatter: SCATTER * scatter.sqrt(),
            ..FitSigma::default()
        };
        FitSigma {
            turning: turn * found.lateral(),
            meeting: if found.is_edge {
                0.0
            } else {
                MEETING * self.sigma * nearness(MEETING_REACH)
            },
            edge: if found.is_edge {
                fit.total() * nearness(EDGE_REACH)
            } else {
                0.0
            },
            ..fit
        }
    }

    /// Root mean square angle between the field at `x` and the contacts around the nearest one, of
    /// any piece, beyond noise, rad.
    fn turn_around(
        &self,
        found: &FieldValue,
        store: &ContactMap,
        x: &Point3<f64>,
        near: &[Member],
    ) -> f64 {
        let reach_squared = (found.nearest + TURN_REACH * self.sigma).powi(2);
        let (mut sum, mut count) = (0.0, 0.0f64);
        for member in near {
            let mean = &store.means()[member.index as usize];
            if (mean.point - x).norm_squared() <= reach_squared {
                // 2 (1 − cos α) is α², for small ones
                let noise = store.sums(member.index).sigma().normal;
                sum += 2.0 * (1.0 - mean.normal.dot(&found.gradient)) - noise * noise;
                count += 1.0;
            }
        }
        (sum / count.max(1.0) - TURN_NOISE * TURN_NOISE)
            .max(0.0)
            .sqrt()
    }
}

/// Σᵢⱼ aᵢ aⱼ ρᵢⱼ of noise and tilt, with ρ falling linearly to 0 within `correlation_ns`.
///
/// - `shares`: in order of time.
fn variances(shares: &[PassShare], correlation_ns: i64) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (at, one) in shares.iter().enumerate() {
        sums = [
            sums[0] + one.noise * one.noise,
            sums[1] + one.tilt * one.tilt,
        ];
        for other in &shares[at + 1..] {
            let apart = other.began_ns.saturating_sub(one.began_ns);
            if apart >= correlation_ns {
                break;
            }
            let shared = 2.0 * (1.0 - apart as f64 / correlation_ns as f64);
            sums = [
                sums[0] + shared * one.noise * other.noise,
                sums[1] + shared * one.tilt * other.tilt,
            ];
        }
    }
    sums
}

/// Calibration error, m, and scatter, m², of the contacts of the last deciding piece at `x`; the
/// shares of their passes come in order of time. `None` without a piece.
fn contact_errors(
    store: &ContactMap,
    x: &Point3<f64>,
    scratch: &mut FieldScratch,
) -> Option<[f64; 2]> {
    let FieldScratch {
        near,
        pieces,
        shares,
        decides,
        ..
    } = scratch;
    let piece = pieces.get(*decides as usize)?;
    let (mut calibration, mut scatter) = (0.0, 0.0);
    shares.clear();
    for member in near.iter().filter(|member| member.piece == *decides) {
        let mean = &store.means()[member.index as usize];
        let weight = member.distance_squared / piece.fit_weight;
        let arm = x - mean.point;
        let off = 0.5 * (mean.normal + piece.facing).dot(&arm);
        let lateral = (arm.norm_squared() - off * off).max(0.0).sqrt();
        let sums = store.sums(member.index);
        let sigma = sums.sigma();
        calibration += weight * sigma.systematic();
        scatter += weight * (off - piece.value()).powi(2);
        shares.extend(sums.passes.iter().map(|pass| {
            let share = weight * pass.weight / mean.weight / f64::from(pass.count).sqrt();
            let tilt = share * 0.5 * lateral * sigma.normal;
            PassShare {
                began_ns: pass.began_ns,
                noise: share * sigma.noise.hypot(sigma.reach),
                tilt,
            }
        }));
    }
    shares.sort_unstable_by(|a, b| {
        a.began_ns
            .cmp(&b.began_ns)
            .then(a.noise.total_cmp(&b.noise))
    });
    Some([calibration, scatter])
}

/// Error of a vertex as a multiple of its distance from the fit: edges and corners combine several
/// pieces.
const OFF_FIT: f64 = 1.4;
/// Error of a guess one radius from the nearest contact, as a share of the radius; grows with the
/// square of the distance.
const GUESS: f64 = 0.25;

/// Standard deviation of a vertex along the normal, m.
///
/// - `scan`: standard deviation of a vertex of the scan, m.
pub(in crate::reconstruct) fn vertex_sigma(
    evidence: &Evidence<'_>,
    p: &Point3<f64>,
    support: Support,
    scan: f64,
    window_ns: i64,
    scratch: &mut FieldScratch,
) -> f64 {
    if support == Support::Scan {
        return scan;
    }
    let (field, radius) = (&evidence.params.field, evidence.params.radius);
    let found = field.at(evidence.contacts, p, scratch);
    if let Some(known) = evidence.known_at(p, found.as_ref()) {
        return known.sigma.hypot(OFF_FIT * known.value);
    }
    let Some(mut found) = found else {
        let from_scan = evidence
            .scan_at(p)
            .map_or(0.0, |scan| (scan.foot - p).norm());
        return scan.hypot(guess(field.reach.max(from_scan), radius));
    };
    let fit = field
        .sigma_of(&found, evidence.contacts, p, window_ns, scratch)
        .total();
    match support {
        Support::Guessed => fit.hypot(guess(found.nearest, radius)),
        _ => {
            evidence.end_at_free_space(&mut found, p);
            fit.hypot(OFF_FIT * found.value)
        }
    }
}

fn guess(distance: f64, radius: f64) -> f64 {
    GUESS * distance * distance / radius
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::reconstruct::evidence::contact_map::GateParams;
    use crate::reconstruct::{ContactSigma, SurfaceContact};

    const WINDOW_NS: i64 = 64_000_000;

    /// σ of the fit over the middle of a plane with `passes` passes of 64 contacts along x, 1 s
    /// apart; all passes on one line.
    fn sigma_after(passes: i64, spacing_ns: i64) -> FitSigma {
        let gate = GateParams {
            sigmas: 4.0,
            window_ns: WINDOW_NS,
        };
        let mut store = ContactMap::new(0.5e-3, 3e-3, Some(gate));
        for i in 0..64 * passes {
            let along = (i % 64) as f64 * 0.04e-3 - 1.28e-3;
            let stamp_ns = i / 64 * 1_000_000_000 + i % 64 * spacing_ns;
            let sigma = ContactSigma {
                noise: 10e-6,
                reach: 0.0,
                calibration: 3e-6,
                place: 0.0,
                normal: 0.0,
            };
            store.add(&SurfaceContact {
                point: Point3::new(along, 0.1e-3, 0.0),
                normal: Vector3::z(),
                weight: 1.0,
                stamp_ns,
                sigma,
            });
        }
        let (field, mut scratch, x) = (
            FieldParams::for_ball(1.5e-3),
            FieldScratch::default(),
            Point3::origin(),
        );
        let found = field.at(&store, &x, &mut scratch).unwrap();
        field.sigma_of(&found, &store, &x, WINDOW_NS, &mut scratch)
    }

    #[test]
    fn one_window_averages_nothing_and_passes_average_by_their_number() {
        // 64 contacts within 6.4 ms are one measurement
        let once = sigma_after(1, 100_000);
        assert!((8.5e-6..=10e-6).contains(&once.noise), "{once:?}");
        for passes in [2, 4, 16] {
            let often = sigma_after(passes, 100_000);
            let fell_by = once.noise / often.noise;
            assert!(
                (fell_by / (passes as f64).sqrt() - 1.0).abs() < 0.02,
                "{passes}: {fell_by}"
            );
            assert!((often.calibration - 3e-6).abs() < 1e-12, "{often:?}");
        }
        // slow enough for each place to be a window of its own, they are independent: five places
        // count
        let slow = sigma_after(1, 20_000_000);
        assert!(slow.noise < 0.6 * once.noise, "{slow:?}");
    }

    #[test]
    fn noise_that_is_shared_adds_up_and_else_its_squares_do() {
        let share = |began_ns| PassShare {
            began_ns,
            noise: 1.0,
            tilt: 2.0,
        };
        assert_eq!(variances(&[share(0), share(0)], 100), [4.0, 16.0]);
        assert_eq!(variances(&[share(0), share(100)], 100), [2.0, 8.0]);
        assert_eq!(variances(&[share(0), share(50)], 100), [3.0, 12.0]);
    }
}
