//! Camera images of the LED markers on a simulated stylus: noise, occlusion, swapped labels,
//! reflections.

use nalgebra::{Isometry3, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::error::{SimError, positive, up_to};
use super::random::{gauss_vector, uniform};
use super::sensor::{TICK, TrueState};
use touchup_method::stylus::{MarkerBody, MarkerFrame, MarkerObservation};

settings! {
    /// The camera and its errors.
    #[derive(Clone, Debug, PartialEq)]
    pub struct CameraParams,
    /// An active LED system at 2 m.
    default {
        /// Markers on the stylus.
        body: MarkerBody = MarkerBody::default();
        /// Frames per second, at most 1000.
        rate: f64 = 250.0,
            positive("the rate of the camera", *rate, "1/s"),
            up_to("the rate of the camera", *rate, "1/s", 1.0 / TICK, "1000 1/s or less");
        /// Noise, root mean square per axis, m.
        noise: f64 = 0.05e-3, up_to("the noise of the markers", *noise, "m", 1.0, "from zero to 1 m");
        /// Share of the time in which a marker is invisible, for 0.05 to 0.3 s each time.
        hidden: f64 = 0.15, up_to("the share of hidden markers", *hidden, "", 0.9, "from zero to 0.9");
        /// Rate of blackouts of all markers, 1/s, for 0.01 to 0.1 s each.
        blackout_rate: f64 = 0.2, up_to("the rate of blackouts", *blackout_rate, "1/s", 1.0 / TICK, "from zero to 1000 1/s");
        /// Rate of swaps of two labels, 1/s, for 0.05 to 0.3 s each.
        swap_rate: f64 = 0.1, up_to("the rate of swaps", *swap_rate, "1/s", 1.0 / TICK, "from zero to 1000 1/s");
        /// Share of visible markers replaced by a reflection 1 to 50 mm away.
        outliers: f64 = 0.005, up_to("the share of outliers", *outliers, "", 1.0, "from zero to one");
        /// Stamp of the first moment, ns.
        start_ns: i64 = super::SensorParams::default().start_ns;
    }
}

/// Duration of an occlusion or a swap, s.
const SPELL: [f64; 2] = [0.05, 0.3];
/// Duration of a blackout, s.
const BLACKOUT: [f64; 2] = [0.01, 0.1];
/// Distance of a reflection from its marker, m.
const REFLECTION: [f64; 2] = [1e-3, 50e-3];

/// End of a temporary error.
#[derive(Clone, Copy)]
struct Spell {
    until: f64,
}

impl Spell {
    const NONE: Self = Self { until: f64::MIN };

    /// Whether it is going on at `t`; else it begins with `rate` per second.
    fn update(&mut self, t: f64, dt: f64, rate: f64, lengths: [f64; 2], rng: &mut Pcg64) -> bool {
        let (begins, length) = (uniform(rng, [0.0, 1.0]), uniform(rng, lengths));
        if t >= self.until && begins < rate * dt {
            self.until = t + length;
        }
        t < self.until
    }
}

/// The frames of a camera that watches a simulated touch.
///
/// The markers sit on the handle: like the poses they show a stylus without bending.
///
/// - `stiffness`: of the tip, N/m.
///
/// # Errors
/// [`SimError::BadParameter`].
pub fn see_markers(
    moments: &[TrueState],
    stiffness: f64,
    camera: &CameraParams,
    seed: u64,
) -> Result<Vec<MarkerFrame>, SimError> {
    camera.check()?;
    positive("the tip's stiffness", stiffness, "N/m")?;
    let count = camera.body.markers_t().len();
    let mut rng = Pcg64::seed_from_u64(seed ^ 0x3a11_c0de_77f0_1ed5);
    let (mut hidden, mut blackout, mut swap) = (vec![Spell::NONE; count], Spell::NONE, Spell::NONE);
    let mut swapped = [0, 1];
    // a share s of the time in spells of mean length l: they begin s / (l (1 − s)) times per free
    // second
    let hiding = camera.hidden / ((1.0 - camera.hidden) * (SPELL[0] + SPELL[1]) / 2.0);
    let every = (1.0 / (camera.rate * TICK)).round().max(1.0) as usize;
    let dt = every as f64 * TICK;
    let mut frames = Vec::with_capacity(moments.len() / every + 1);
    for moment in moments.iter().step_by(every) {
        let t = moment.t;
        let is_dark = blackout.update(t, dt, camera.blackout_rate, BLACKOUT, &mut rng);
        if !swap.update(t, dt, camera.swap_rate, SPELL, &mut rng) {
            swapped = [(); 2].map(|()| uniform(&mut rng, [0.0, count as f64]) as usize);
        }
        let handle = moment.pose_ot.translation.vector - moment.force_o / stiffness;
        let pose_ot = Isometry3::from_parts(handle.into(), moment.pose_ot.rotation);
        let mut frame = MarkerFrame::new(camera.start_ns + (t * 1e9).round() as i64);
        for (i, marker) in camera.body.markers_t().iter().enumerate() {
            let is_hidden = hidden[i].update(t, dt, hiding, SPELL, &mut rng) || is_dark;
            let position = pose_ot * marker + seen_off(camera, &mut rng);
            let label = match swapped {
                [a, b] if t < swap.until && i == a => b,
                [a, b] if t < swap.until && i == b => a,
                _ => i,
            };
            if !is_hidden {
                frame.see(MarkerObservation {
                    label: label as u32,
                    position,
                });
            }
        }
        frames.push(frame);
    }
    Ok(frames)
}

/// Error of the position of a marker, m.
fn seen_off(camera: &CameraParams, rng: &mut Pcg64) -> Vector3<f64> {
    let noise = gauss_vector(rng) * camera.noise;
    let direction = gauss_vector(rng).try_normalize(0.0).unwrap_or_default();
    let (is_outlier, distance) = (
        uniform(rng, [0.0, 1.0]) < camera.outliers,
        uniform(rng, REFLECTION),
    );
    if is_outlier {
        direction * distance
    } else {
        noise
    }
}
