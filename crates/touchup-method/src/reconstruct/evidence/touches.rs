//! From samples to touches: the true centre of the ball, and the contact there.
//!
//! The patch follows a few tens of milliseconds behind the stream, so a window that looks as far
//! ahead as back smooths position and force without lag. Its length follows from the noise: as long
//! as the velocity needs, and no longer than the path is a parabola.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::contact_uncertainty::{CalibrationParams, ContactSigma};
use crate::stylus::{
    ContactSample, ForceNoise, Friction, FrictionCoefficient, KnownChange, LocalMotion,
    NormalEstimate, SettingError, Sliding, SmoothedMotion, TipBody, TipContact, TipPlace, TipShape,
    TouchState, WIDEST_CONE_COSINE,
};
use touchup_geometry::numeric::RunningMedian;

/// Uncertainty of the normal that halves the weight of a touch, degrees: curved pieces pass for
/// smooth within it.
const UNCERTAIN_NORMAL: f64 = 5.0;

/// Settings of the touch finder.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchFinderParams {
    /// radius of the ball, of the flat end or of the nose, m
    pub radius: f64,
    /// shape of the tip
    pub shape: TipShape,
    /// stiffness of stylus and probe, N/m; `None`: rigid
    pub stiffness: Option<f64>,
    /// half of the longest smoothing window, ns. Default 32 ms: 0.2 mm of pose noise at 500 Hz then
    /// leaves the direction of 25 mm/s uncertain by 6°, which friction known from the stream turns
    /// into a normal within 1–2°.
    pub half_window_ns: i64,
    /// minimum pause that separates streams, ns. Default 30 ms.
    pub largest_gap_ns: i64,
    /// cosine of the widest friction cone accepted; `None`: no friction estimate, the normal is the
    /// force. Default `WIDEST_CONE_COSINE`.
    pub cone_cosine: Option<f64>,
    /// residual uncertainty of the calibration; `None`: no uncertainty of contacts
    pub calibration: Option<CalibrationParams>,
    /// what changed its place and was taken off: touches after it contain its uncertainty
    pub changes: Vec<KnownChange>,
}

impl TouchFinderParams {
    /// The defaults, for one tip.
    pub fn new(radius: f64, stiffness: Option<f64>) -> Self {
        Self {
            radius,
            shape: TipShape::Ball,
            stiffness,
            half_window_ns: 32_000_000,
            largest_gap_ns: 30_000_000,
            cone_cosine: Some(WIDEST_CONE_COSINE),
            calibration: None,
            changes: Vec::new(),
        }
    }
}

/// A contact of the tip with the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceContact {
    /// point of the surface, m, in O
    pub point: Point3<f64>,
    /// outward unit normal of the surface there, in O
    pub normal: Vector3<f64>,
    /// weight relative to others: at most 1, less for an uncertain normal
    pub weight: f64,
    /// ns
    pub stamp_ns: i64,
    /// uncertainty; all 0 unless estimated
    pub sigma: ContactSigma,
}

/// The ball at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipTouch {
    /// ns
    pub stamp_ns: i64,
    /// centre of the real ball, m, in O
    pub centre: Point3<f64>,
    /// from the tip to the handle, unit, in O
    pub axis: Vector3<f64>,
    /// `None` in free motion, and for an unknown point of contact on the tip
    pub contact: Option<SurfaceContact>,
    /// touch state from the force
    pub state: TouchState,
}

#[derive(Clone, Copy, Debug)]
struct WindowEntry {
    stamp_ns: i64,
    centre: Point3<f64>,
    axis: Vector3<f64>,
    force_o: Vector3<f64>,
    state: TouchState,
}

impl WindowEntry {
    fn is_in_contact(&self) -> bool {
        self.state == TouchState::Contact
    }
}

/// Finds touches in a stream of samples.
#[derive(Clone, Debug)]
pub struct TouchFinder {
    params: TouchFinderParams,
    body: TipBody,
    friction: Option<Friction>,
    /// noise of the positions: of the distances from short pieces of the path to their parabolas, m
    noise: RunningMedian,
    /// noise of the force
    force_noise: ForceNoise,
    /// samples since the last gap, as far as a window may still need them
    held: VecDeque<WindowEntry>,
    /// index in `held` of the first touch not yet delivered
    next: usize,
}

impl TouchFinder {
    /// # Errors
    /// [`SettingError`] of the tip.
    pub fn new(params: TouchFinderParams) -> Result<Self, SettingError> {
        Ok(Self {
            body: TipBody::new(params.shape, params.radius)?,
            friction: params
                .cone_cosine
                .map(|cosine| Friction::new(cosine.clamp(-1.0, 1.0).acos())),
            noise: RunningMedian {
                length: USUAL_NOISE,
                least: LEAST_NOISE,
            },
            force_noise: ForceNoise::new(),
            held: VecDeque::new(),
            next: 0,
            params,
        })
    }

    /// Adds the next sample, later than the one before; passes each touch with a complete window to
    /// `each`.
    pub fn push(&mut self, sample: &ContactSample, mut each: impl FnMut(TipTouch)) {
        let tip = &sample.tip;
        if self.held.back().is_some_and(|last| {
            tip.stamp_ns.saturating_sub(last.stamp_ns) > self.params.largest_gap_ns
        }) {
            self.flush(&mut each);
        }
        if let Some(last) = self.held.back() {
            self.force_noise.note(&last.force_o, &tip.force_o);
        }
        self.held.push_back(WindowEntry {
            stamp_ns: tip.stamp_ns,
            centre: sample.centre,
            axis: TipPlace::from(&tip.pose_ot).axis,
            force_o: tip.force_o,
            state: sample.state(),
        });
        while tip.stamp_ns.saturating_sub(self.held[self.next].stamp_ns)
            >= self.params.half_window_ns
        {
            each(self.touch(self.next));
            self.next += 1;
        }
        let needed = self.held[self.next.min(self.held.len() - 1)]
            .stamp_ns
            .saturating_sub(self.params.half_window_ns);
        while self.held[0].stamp_ns < needed {
            self.held.pop_front();
            self.next -= 1;
        }
    }

    /// Delivers the remaining touches: the stream has ended or paused.
    pub fn flush(&mut self, mut each: impl FnMut(TipTouch)) {
        for at in self.next..self.held.len() {
            each(self.touch(at));
        }
        self.held.clear();
        self.lift();
        self.next = 0;
    }

    /// Measured kinetic friction; `None` until the ball has slid far enough, or without a friction
    /// estimate.
    pub fn friction(&self) -> Option<FrictionCoefficient> {
        self.friction.as_ref()?.coefficient()
    }

    fn lift(&mut self) {
        self.friction.iter_mut().for_each(Friction::lift);
    }

    fn touch(&mut self, at: usize) -> TipTouch {
        let window = self.window(at);
        let motion = window.sums.motion();
        let velocity_sigma = motion.velocity_gain * self.noise.length * SHARED_NOISE;
        let sliding = Sliding {
            force_o: window.force / (window.last - window.first + 1) as f64,
            velocity: motion.velocity,
            velocity_sigma,
        };
        let place = TipPlace {
            centre: motion.centre,
            axis: self.held[at].axis,
        };
        let mut contact = None;
        if window.is_alike && self.held[at].is_in_contact() {
            let dt = if at > 0 {
                self.held[at]
                    .stamp_ns
                    .saturating_sub(self.held[at - 1].stamp_ns)
            } else {
                0
            };
            let normal = match &mut self.friction {
                Some(friction) => {
                    friction.observe(&sliding, dt as f64 * 1e-9);
                    friction.normal(&sliding)
                }
                None => NormalEstimate::of_force(&sliding.force_o),
            };
            contact =
                normal.and_then(|estimate| self.contact(at, &motion, &sliding.force_o, &estimate));
        } else {
            self.lift();
        }
        let WindowEntry {
            stamp_ns,
            axis,
            state,
            ..
        } = self.held[at];
        TipTouch {
            stamp_ns,
            centre: place.centre,
            axis,
            contact,
            state,
        }
    }

    /// The longest window around a sample over which the path is a parabola and contact does not
    /// change; at least the shortest.
    fn window(&mut self, at: usize) -> Window {
        let longest = self.params.half_window_ns;
        let mut best = Window::new(&self.held[at], at, longest);
        best.widen(&self.held, at, longest / 8 * WINDOWS[0]);
        let residual = best.sums.motion().residual;
        if residual.is_finite() {
            self.noise.note(residual > self.noise.length);
        }
        for eighths in &WINDOWS[1..] {
            let mut wider = best.clone();
            wider.widen(&self.held, at, longest / 8 * eighths);
            if !wider.is_alike || wider.sums.motion().residual > ROUGH * self.noise.length {
                break;
            }
            best = wider;
        }
        best
    }

    /// Variance of the centre if even the shortest window is no parabola, as after an outlier: the
    /// distance of the path from it, in units of its noise. Such errors are alike in all of the
    /// window and do not average out in it.
    fn roughness(&self, motion: &SmoothedMotion) -> f64 {
        let noise = self.noise.length.max(LEAST_ROUGH * self.params.radius);
        let residual = motion.residual / noise;
        let excess = (residual * residual - ROUGH * ROUGH).max(0.0) / motion.centre_gain;
        if excess.is_finite() { excess } else { 0.0 }
    }

    fn contact(
        &self,
        at: usize,
        motion: &SmoothedMotion,
        force_o: &Vector3<f64>,
        estimate: &NormalEstimate,
    ) -> Option<SurfaceContact> {
        let WindowEntry { stamp_ns, axis, .. } = self.held[at];
        let place = TipPlace {
            centre: motion.centre,
            axis,
        };
        let TipContact {
            point,
            normal,
            is_vague,
        } = self
            .body
            .touched(&place, &estimate.normal, estimate.sigma)?;
        let share = if is_vague { VAGUE } else { 1.0 };
        let mut weight = share / (1.0 + (estimate.sigma / UNCERTAIN_NORMAL.to_radians()).powi(2));
        let sigma = self
            .params
            .calibration
            .map_or_else(ContactSigma::default, |calibration| {
                weight /= 1.0 + self.roughness(motion);
                let softness = self
                    .params
                    .stiffness
                    .map_or(0.0, |stiffness| 1.0 / stiffness);
                let both = [self.noise.length, self.force_noise.sigma() * softness];
                let [pose, force] = both.map(|noise| noise * motion.centre_gain.sqrt());
                let bend = force_o.dot(&normal) * softness;
                let changes = self.params.changes.iter();
                let of_changes = changes.map(|change| {
                    change.sigma_along(stamp_ns, &point, (&normal, estimate.sigma), &axis)
                });
                let changed = of_changes.fold(0.0, f64::hypot);
                ContactSigma {
                    noise: (pose * SHARED_POSE).hypot(force),
                    reach: self.params.radius * (1.0 - estimate.sigma.cos()),
                    calibration: calibration.radius.hypot(calibration.stiffness_share * bend),
                    place: calibration.place.hypot(changed),
                    normal: estimate.sigma,
                }
            });
        Some(SurfaceContact {
            point,
            normal,
            weight,
            stamp_ns,
            sigma,
        })
    }
}

/// Weight of a contact at an unknown height on the side of the tip.
const VAGUE: f64 = 0.25;
/// Halves of the windows tried, in eighths of the longest.
const WINDOWS: [i64; 4] = [3, 4, 6, 8];
/// Residual, in units of noise, from which a path is no parabola.
const ROUGH: f64 = 1.5;
/// Distance of the path of a calm hand over an edge from a parabola, in radii.
const LEAST_ROUGH: f64 = 0.02;
/// Noise factor of the velocity: samples between two poses share their noise, so it averages out
/// more slowly than for as many poses.
const SHARED_NOISE: f64 = 1.3;
/// Noise factor of the centre: two of three samples share a pose.
const SHARED_POSE: f64 = 1.65;
/// Lower bound of the noise of the positions, m: a good tracker at rest.
const LEAST_NOISE: f64 = 1e-6;
/// Initial noise of the positions, m.
const USUAL_NOISE: f64 = 0.03e-3;

/// The samples around one.
#[derive(Clone, Debug)]
struct Window {
    first: usize,
    last: usize,
    sums: LocalMotion,
    /// sum of the forces, N
    force: Vector3<f64>,
    /// all in contact, or none
    is_alike: bool,
}

impl Window {
    fn new(middle: &WindowEntry, at: usize, longest_ns: i64) -> Self {
        let mut sums = LocalMotion::new(
            middle.centre,
            (longest_ns as f64 * 1e-9).max(f64::MIN_POSITIVE),
        );
        sums.add(0.0, &middle.centre);
        Self {
            first: at,
            last: at,
            sums,
            force: middle.force_o,
            is_alike: true,
        }
    }

    /// Adds all samples up to `half_ns` before and after.
    fn widen(&mut self, held: &VecDeque<WindowEntry>, at: usize, half_ns: i64) {
        let middle = held[at].stamp_ns;
        while self.first > 0 && middle - held[self.first - 1].stamp_ns <= half_ns {
            self.first -= 1;
            self.add(&held[self.first], &held[at]);
        }
        while self.last + 1 < held.len()
            && held[self.last + 1].stamp_ns.saturating_sub(middle) <= half_ns
        {
            self.last += 1;
            self.add(&held[self.last], &held[at]);
        }
    }

    fn add(&mut self, entry: &WindowEntry, middle: &WindowEntry) {
        self.sums.add(
            entry.stamp_ns.saturating_sub(middle.stamp_ns) as f64 * 1e-9,
            &entry.centre,
        );
        self.force += entry.force_o;
        self.is_alike &= entry.is_in_contact() == middle.is_in_contact();
    }
}
