//! Named worlds: each draws its own truth from a seed, and a calibration's report of it.
//!
//! The reported values have Gaussian errors with known standard deviations ([`ReportedWorld`]). The recorded
//! poses have a frame of their own, the origin of a tracked body, so that a report needs the place
//! of the part, the offset of the tip, the delay of the clocks and the tare. A world shares nothing
//! with the defaults of scanner and stylus.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::error::{SimError, not_negative};
use super::random::{gauss, gauss_vector, uniform};
use super::scanner::{ScannerParams, scan};
use super::sensor::SensorParams;
use super::stylus::{StylusParams, Touch, touch};
use crate::paths::habit::Habit;
use crate::paths::path::{PathParams, Stroke, plan_mesh, plan_walls};
use crate::surfaces::plate::Plate;
use crate::surfaces::surface::Surface;
use touchup_geometry::mesh::TriMesh;
use touchup_method::names;

names! {
    /// A world by its name.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum SimWorld {
        /// A stylus of the workshop under a good camera.
        WorkshopStylus = "workshop_stylus",
        /// A marker body far from its tracker: slow poses, late and missing.
        OpticalTracker = "optical_tracker",
        /// A UR led by hand: exact poses, a coarse force sensor.
        Ur = "ur",
        /// A long thin probe that bends several times more sideways than along its shaft.
        SoftProbe = "soft_probe",
        /// Someone who presses unevenly, taps and scrubs, over a poor scan.
        CarelessOperator = "careless_operator",
    }
}

/// Ranges of a world's draws. Each pair is the smallest and the largest value, all equally likely;
/// SI.
struct WorldRanges {
    radius: [f64; 2],
    stiffness: [f64; 2],
    /// stiffness across the shaft over that along it
    lateral: [f64; 2],
    tip_offset: [f64; 2],
    friction: [f64; 2],
    friction_variation: [f64; 2],
    friction_length: [f64; 2],
    tare: [f64; 2],
    tare_drift: [f64; 2],
    clock: [f64; 2],
    clock_rate: [f64; 2],
    pose_noise: [f64; 2],
    pose_wander: [f64; 2],
    orientation_noise: [f64; 2],
    force_noise: [f64; 2],
    force_step: [f64; 2],
    force_play: [f64; 2],
    pose_rates: &'static [f64],
    wrench_rates: &'static [f64],
    lost: [f64; 2],
    late: [f64; 2],
    gap_rate: [f64; 2],
    scan_edge: [f64; 2],
    scan_noise: [f64; 2],
    scan_correlation: [f64; 2],
    scan_white: [f64; 2],
    scan_bias: [f64; 2],
    scan_scale: [f64; 2],
    missing: [f64; 2],
    force: [f64; 2],
    /// of the force, root mean square over the mean
    unevenness: [f64; 2],
    tilt: [f64; 2],
    stray: [f64; 2],
    habits: &'static [Habit],
    stds: CalibrationStds,
}

/// Standard deviations of a calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationStds {
    /// m
    pub radius: f64,
    /// of the stiffness, as a share of it
    pub stiffness: f64,
    /// per axis, m
    pub tip_offset: f64,
    /// of the place of the scan, per axis, m
    pub shift: f64,
    /// of the turn of the scan, about each axis, rad
    pub turn: f64,
    /// s
    pub clock: f64,
    /// per axis, N
    pub tare: f64,
    /// of the noise of the scan, as a share of it
    pub scan_noise: f64,
}

/// Factors of the true errors over their reported standard deviations; 1: as reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToldOff {
    /// radius of the tip
    pub radius: f64,
    /// stiffness of the tip
    pub stiffness: f64,
    /// offset of the tip
    pub tip_offset: f64,
    /// place and turn of the scan
    pub registration: f64,
    /// delay of the clocks
    pub clock: f64,
    /// tare of the force
    pub tare: f64,
}

impl ToldOff {
    /// The same factor for all.
    pub fn all(factor: f64) -> Self {
        Self {
            radius: factor,
            stiffness: factor,
            tip_offset: factor,
            registration: factor,
            clock: factor,
            tare: factor,
        }
    }
}

/// A calibration's report of a world: the input of the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReportedWorld {
    /// Radius of the ball, m.
    pub radius: f64,
    /// One stiffness for all directions, N/m.
    pub stiffness: f64,
    /// Centre of the ball from the origin of the recorded pose, in its axes, m.
    pub tip_offset: Vector3<f64>,
    /// Maps the scan to the frame of the recorded poses.
    pub scan_to_space: Isometry3<f64>,
    /// Lead of the wrench's clock over the pose's, s.
    pub wrench_clock: f64,
    /// Reading of the sensor in free motion, N, in T.
    pub tare: Vector3<f64>,
    /// Noise of the scan, m.
    pub scan_noise: f64,
    /// Standard deviations of all of these from the truth.
    pub stds: CalibrationStds,
}

impl ReportedWorld {
    /// Standard deviation along an axis of the error of tip offset and scan placement together, m.
    ///
    /// - `lever`: root mean square distance of the surface from O's origin, m.
    pub fn place_std(&self, lever: f64) -> f64 {
        let CalibrationStds {
            tip_offset,
            shift,
            turn,
            ..
        } = self.stds;
        // of the turn's axis and the lever, two of three directions move a point, one of three
        // along the normal
        let turned = turn * lever * (2.0f64 / 3.0).sqrt();
        tip_offset.hypot(shift).hypot(turned)
    }
}

/// One drawn number: the truth, its range, and the reported value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnValue {
    /// its name
    pub name: &'static str,
    /// its unit, SI
    pub unit: &'static str,
    /// true value
    pub truth: f64,
    /// smallest and largest value of this world
    pub range: [f64; 2],
    /// reported value and its standard deviation; `None`: not reported
    pub told: Option<[f64; 2]>,
}

/// The truth of a world, and the report of it.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnWorld {
    /// the drawn world
    pub world: SimWorld,
    /// seed of all draws
    pub seed: u64,
    /// the scanner
    pub scanner: ScannerParams,
    /// tip, hand and sensors
    pub stylus: StylusParams,
    /// habit of the hand
    pub habit: Habit,
    /// input of the program
    pub told: ReportedWorld,
    /// each number once
    pub values: Vec<DrawnValue>,
}

/// Largest distance of the part from the origin of the poses along each axis, m.
const FARTHEST: f64 = 0.8;
/// Smallest and largest force of the hand, as shares of its mean.
const FORCE_SHARES: [f64; 2] = [0.3, 2.5];
/// Offsets between the seeds of worlds, reported errors, scans and hands.
const TRUTH_STREAM: u64 = 0x0b57_a91e_66d2_30f7;
const TOLD_STREAM: u64 = 0x2f8e_14c5_9d03_7ab1;

/// Draws numbers and records them.
struct Draw {
    rng: Pcg64,
    values: Vec<DrawnValue>,
}

impl Draw {
    fn number(&mut self, name: &'static str, unit: &'static str, range: [f64; 2]) -> f64 {
        let truth = uniform(&mut self.rng, range);
        self.values.push(DrawnValue {
            name,
            unit,
            truth,
            range,
            told: None,
        });
        truth
    }

    fn one_of<T: Copy>(&mut self, of: &[T]) -> T {
        of[(uniform(&mut self.rng, [0.0, of.len() as f64]) as usize).min(of.len() - 1)]
    }

    fn rate(&mut self, name: &'static str, of: &[f64]) -> f64 {
        let truth = self.one_of(of);
        let range = [
            of.iter().copied().fold(f64::MAX, f64::min),
            of.iter().copied().fold(0.0, f64::max),
        ];
        self.values.push(DrawnValue {
            name,
            unit: "1/s",
            truth,
            range,
            told: None,
        });
        truth
    }

    /// A vector of a length within the range, in any direction.
    fn vector(&mut self, name: &'static str, unit: &'static str, range: [f64; 2]) -> Vector3<f64> {
        let direction = gauss_vector(&mut self.rng)
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::z);
        direction * self.number(name, unit, range)
    }

    fn told(&mut self, name: &'static str, told: f64, std: f64) {
        self.values
            .iter_mut()
            .filter(|value| value.name == name)
            .for_each(|value| value.told = Some([told, std]));
    }
}

impl SimWorld {
    /// Standard deviations of the reported values in this world.
    pub fn calibration_stds(self) -> CalibrationStds {
        self.ranges().stds
    }

    /// Draws the truth, and a calibration's report of it.
    ///
    /// # Errors
    /// As [`SimWorld::draw_told_off`], with all factors 1.
    pub fn draw(self, seed: u64) -> Result<DrawnWorld, SimError> {
        self.draw_told_off(seed, &ToldOff::all(1.0))
    }

    /// As [`SimWorld::draw`], with the errors of the report multiplied by `off`. The truth does not
    /// depend on `off`.
    ///
    /// # Errors
    /// [`SimError::BadParameter`] for factors that are negative, not finite, or too large for a
    /// possible report.
    pub fn draw_told_off(self, seed: u64, off: &ToldOff) -> Result<DrawnWorld, SimError> {
        let ToldOff {
            radius,
            stiffness,
            tip_offset,
            registration,
            clock,
            tare,
        } = *off;
        for factor in [radius, stiffness, tip_offset, registration, clock, tare] {
            not_negative("the factor of what is told", factor, "")?;
        }
        let ranges = self.ranges();
        let mut draw = Draw {
            rng: Pcg64::seed_from_u64(seed ^ TRUTH_STREAM),
            values: Vec::new(),
        };
        let stylus = draw.stylus(&ranges);
        let scanner = draw.scanner(&ranges, seed);
        let habit = draw.one_of(ranges.habits);
        let told = draw.what_is_told(&stylus, &scanner, &ranges.stds, off, seed);
        if !(told.radius > 0.0 && told.stiffness > 0.0) {
            let (name, value) = if told.radius > 0.0 {
                ("stiffness", told.stiffness)
            } else {
                ("radius", told.radius)
            };
            let allowed = "greater than zero: take a smaller factor of what is told";
            return Err(SimError::BadParameter {
                name,
                value,
                unit: "",
                allowed,
            });
        }
        Ok(DrawnWorld {
            world: self,
            seed,
            scanner,
            stylus,
            habit,
            told,
            values: draw.values,
        })
    }
}

impl Draw {
    fn stylus(&mut self, of: &WorldRanges) -> StylusParams {
        let radius = self.number("tip_radius", "m", of.radius);
        let stiffness = self.number("stiffness", "N/m", of.stiffness);
        let lateral = [
            self.number("lateral_share_1", "", of.lateral),
            self.number("lateral_share_2", "", of.lateral),
        ];
        // `stiffness` then gives the mean compliance of the three directions
        let shares = Vector3::new(lateral[0], lateral[1], 1.0);
        let stiffness_shares = shares * (shares.map(f64::recip).sum() / 3.0);
        let stiffness_axes = UnitQuaternion::from_axis_angle(
            &Vector3::z_axis(),
            self.number("lateral_turn", "rad", [0.0, 3.0]),
        );
        let force = self.number("hand_force", "N", of.force);
        StylusParams {
            radius,
            stiffness,
            stiffness_shares,
            stiffness_axes,
            friction: self.number("friction", "", of.friction),
            friction_variation: self.number("friction_variation", "", of.friction_variation),
            friction_length: self.number("friction_length", "m", of.friction_length),
            force,
            force_variation: force * self.number("hand_unevenness", "", of.unevenness),
            force_range: FORCE_SHARES.map(|share| share * force),
            tilt: self.number("hand_tilt", "rad", of.tilt),
            stray: self.number("hand_stray", "m", of.stray),
            sensor: self.sensor(of),
            ..StylusParams::default()
        }
    }

    fn sensor(&mut self, of: &WorldRanges) -> SensorParams {
        let turn =
            UnitQuaternion::from_scaled_axis(self.vector("scan_to_space_turn", "rad", [0.0, 3.0]));
        let place = self.vector("scan_to_space_distance", "m", [0.1, FARTHEST]);
        SensorParams {
            pose_noise: self.number("pose_noise", "m", of.pose_noise),
            pose_wander: self.number("pose_wander", "m", of.pose_wander),
            orientation_noise: self.number("orientation_noise", "rad", of.orientation_noise),
            force_noise: self.number("force_noise", "N", of.force_noise),
            force_step: self.number("force_step", "N", of.force_step),
            force_play: self.number("force_play", "N", of.force_play),
            force_bias: self.number("tare_drift", "N", of.tare_drift),
            tare: self.vector("tare", "N", of.tare),
            wrench_clock: self.number("wrench_clock", "s", of.clock),
            clock_rate: self.number("clock_rate", "", of.clock_rate),
            pose_rate: self.rate("pose_rate", of.pose_rates),
            wrench_rate: self.rate("wrench_rate", of.wrench_rates),
            lost: self.number("lost", "", of.lost),
            late: self.number("late", "", of.late),
            gap_rate: self.number("gap_rate", "1/s", of.gap_rate),
            scan_to_space: Isometry3::from_parts(Translation3::from(place), turn),
            tip_offset: self.vector("tip_offset", "m", of.tip_offset),
            ..SensorParams::default()
        }
    }

    fn scanner(&mut self, of: &WorldRanges, seed: u64) -> ScannerParams {
        let edge = self.number("scan_edge", "m", of.scan_edge);
        ScannerParams {
            edge,
            noise: self.number("scan_noise", "m", of.scan_noise),
            noise_correlation: self.number("scan_correlation", "m", of.scan_correlation),
            white_share: self.number("scan_white_share", "", of.scan_white),
            bias: self.number("scan_bias", "m", of.scan_bias),
            scale_error: self.number("scan_scale_error", "", of.scan_scale),
            missing: self.number("missing_places", "", of.missing) as usize,
            missing_radius: 1.5 * edge,
            rounding: edge / 3.0,
            // the stated place of the scan has that error
            rigid_shift: 0.0,
            rigid_turn: 0.0,
            seed,
            ..ScannerParams::default()
        }
    }

    fn what_is_told(
        &mut self,
        stylus: &StylusParams,
        scanner: &ScannerParams,
        stds: &CalibrationStds,
        off: &ToldOff,
        seed: u64,
    ) -> ReportedWorld {
        let mut rng = Pcg64::seed_from_u64(seed ^ TOLD_STREAM);
        let sensor = &stylus.sensor;
        let radius = stylus.radius + gauss(&mut rng) * stds.radius * off.radius;
        let stiffness = stylus.stiffness * (1.0 + gauss(&mut rng) * stds.stiffness * off.stiffness);
        let tip_offset =
            sensor.tip_offset + gauss_vector(&mut rng) * (stds.tip_offset * off.tip_offset);
        let shift = gauss_vector(&mut rng) * (stds.shift * off.registration);
        let turn = UnitQuaternion::from_scaled_axis(
            gauss_vector(&mut rng) * (stds.turn * off.registration),
        );
        let wrench_clock = sensor.wrench_clock + gauss(&mut rng) * stds.clock * off.clock;
        let tare = sensor.tare + gauss_vector(&mut rng) * (stds.tare * off.tare);
        let scan_noise = scanner.noise * (1.0 + gauss(&mut rng) * stds.scan_noise).max(0.1);
        self.told("tip_radius", radius, stds.radius);
        self.told("stiffness", stiffness, stds.stiffness * stylus.stiffness);
        self.told("wrench_clock", wrench_clock, stds.clock);
        self.told("scan_noise", scan_noise, stds.scan_noise * scanner.noise);
        let scan_to_space = sensor.scan_to_space * Isometry3::from_parts(shift.into(), turn);
        ReportedWorld {
            radius,
            stiffness,
            tip_offset,
            scan_to_space,
            wrench_clock,
            tare,
            scan_noise,
            stds: *stds,
        }
    }
}

impl DrawnWorld {
    /// Gives a number another truth; the reported value keeps its error, or, for a stiffness or a
    /// noise, its relative error.
    ///
    /// - `name`: `tip_radius`, `stiffness`, `friction`, `scan_edge`, `scan_noise`; others stay as
    ///   they are.
    pub fn set_truth(&mut self, name: &str, truth: f64) {
        let Self {
            scanner,
            stylus,
            told,
            values,
            ..
        } = self;
        let Some(value) = values.iter_mut().find(|value| value.name == name) else {
            return;
        };
        let before = std::mem::replace(&mut value.truth, truth);
        let share = truth / before;
        match name {
            "tip_radius" => {
                stylus.radius = truth;
                told.radius += truth - before;
                value.told = Some([told.radius, told.stds.radius]);
            }
            "stiffness" => {
                stylus.stiffness = truth;
                told.stiffness *= share;
                value.told = Some([told.stiffness, told.stds.stiffness * truth]);
            }
            "friction" => stylus.friction = truth,
            "scan_edge" => scanner.edge = truth,
            "scan_noise" => {
                scanner.noise = truth;
                told.scan_noise *= share;
                value.told = Some([told.scan_noise, told.stds.scan_noise * truth]);
            }
            _ => value.truth = before,
        }
    }

    /// The scan of a part.
    ///
    /// # Errors
    /// As [`scan`].
    pub fn scan(&self, surface: &dyn Surface) -> Result<TriMesh, SimError> {
        scan(surface, &self.scanner)
    }

    /// The hand's strokes over the whole reachable part from the scanner's view, at most `longest`
    /// seconds.
    ///
    /// # Errors
    /// As [`plan_mesh`].
    pub fn strokes(&self, surface: &dyn Surface, longest: f64) -> Result<Vec<Stroke>, SimError> {
        let hand = PathParams {
            radius: self.stylus.radius,
            longest,
            ..PathParams::default()
        };
        Ok(self.habit.led(plan_mesh(
            surface,
            &surface.bounds(),
            &self.scanner.view,
            &hand,
        )?))
    }

    /// Touches a part along strokes with their habit.
    ///
    /// # Errors
    /// As [`touch`].
    pub fn touch(&self, surface: &dyn Surface, strokes: &[Stroke]) -> Result<Touch, SimError> {
        touch(surface, strokes, &self.stylus, self.seed)
    }

    /// The hand's strokes over the plate: as [`DrawnWorld::strokes`], and along the walls of its
    /// features.
    ///
    /// - `turn`: share of a turn in the runs along walls; `None`: the hand goes into no hole.
    ///
    /// # Errors
    /// As [`plan_mesh`], and for a share beyond 1.
    pub fn strokes_on_plate(
        &self,
        plate: &Plate,
        longest: f64,
        turn: Option<f64>,
    ) -> Result<Vec<Stroke>, SimError> {
        let mut strokes = self.strokes(plate, longest)?;
        if let Some(turn) = turn {
            let hand = PathParams {
                radius: self.stylus.radius,
                turn,
                ..PathParams::default()
            };
            strokes.extend(plan_walls(plate, &hand)?);
        }
        Ok(strokes)
    }

    /// Relative standard deviation of the reported single stiffness: the calibration's error of the
    /// mean compliance C̄ = tr C / 3, and the spread of the three axes, √(Σ (Cᵢ − C̄)² / 3) / C̄,
    /// for presses along each of them.
    pub fn stiffness_std(&self) -> f64 {
        // their reciprocals have the mean 1
        let uneven = self
            .stylus
            .stiffness_shares
            .map(|share| (share.recip() - 1.0).powi(2))
            .sum()
            / 3.0;
        self.told.stds.stiffness.hypot(uneven.sqrt())
    }

    /// The report, as the scene of a scan `scan.ply` in mm.
    ///
    /// - `lever`: root mean square distance of the part from its origin, m.
    pub fn told_scene(&self, lever: f64) -> String {
        let (told, sensor) = (&self.told, &self.stylus.sensor);
        let mm = |v: &[f64]| format!("{:?}", v.iter().map(|x| x * 1e3).collect::<Vec<_>>());
        let place = told.scan_to_space.translation.vector;
        let turn = told.scan_to_space.rotation.coords;
        // possible zero error of all three axes together, and the contribution of the noise
        let per_axis =
            2.0 * told.stds.tare + sensor.force_bias + sensor.force_play + sensor.force_step / 2.0;
        let free_n = 0.15f64.max(3f64.sqrt() * per_axis);
        let off_n = 0.22f64.max(free_n + 3.0 * sensor.force_noise);
        let on_n = 0.4f64.max(off_n + 3.0 * sensor.force_noise);
        let gap_ms = 30f64.max(2.5e3 / sensor.pose_rate);
        format!(
            "# What is told of world {world}, seed {seed}; truth.json has the truth beside it.\n\
             sync:\n  wrench_offset_ms: {offset}\n  largest_gap_ms: {gap_ms}\n\
             clock:\n\
             scan_to_space:\n  position_mm: {place}\n  orientation_xyzw: {turn:?}\n\
             compensation:\n  bias:\n    force_n: {tare:?}\n    torque_nm: [0, 0, 0]\n\
             bias_tracking:\n\
             contact:\n  on_n: {on_n}\n  off_n: {off_n}\n  free_n: {free_n}\n\
             tip:\n  offset_mm: {tip}\n  radius_mm: {radius}\n  stiffness_n_per_mm: {stiffness}\n\
             scan:\n  file: scan.ply\n  unit: mm\n  noise_mm: {noise}\n\
             sliding:\n\
             carve:\n  tolerance_mm: {tolerance}\n\
             guard:\npatch:\n\
             uncertainty:\n  radius_sigma_mm: {radius_std}\n  place_sigma_mm: {place_std}\n  stiffness_percent: {stiffness_std}\n\
             refine:\n",
            world = self.world.name(),
            seed = self.seed,
            offset = told.wrench_clock * 1e3,
            place = mm(place.as_slice()),
            turn = [turn.x, turn.y, turn.z, turn.w],
            tare = [told.tare.x, told.tare.y, told.tare.z],
            tip = mm(told.tip_offset.as_slice()),
            radius = told.radius * 1e3,
            stiffness = told.stiffness / 1e3,
            noise = told.scan_noise * 1e3,
            tolerance = 1e3 * sensor.pose_noise.max(0.05e-3),
            radius_std = told.stds.radius * 1e3,
            // slow wander of the poses also moves the scan
            place_std = told.place_std(lever).hypot(sensor.pose_wander) * 1e3,
            stiffness_std = self.stiffness_std() * 100.0,
        )
    }

    /// Root mean square distance of the corners of a part's box from O's origin, m: the lever of
    /// [`ReportedWorld::place_std`].
    pub fn lever(surface: &dyn Surface) -> f64 {
        let bounds = surface.bounds();
        let corner = |i: usize| {
            let pick = |axis: usize| {
                if i >> axis & 1 == 0 {
                    bounds.min[axis]
                } else {
                    bounds.max[axis]
                }
            };
            Point3::new(pick(0), pick(1), pick(2)).coords.norm_squared()
        };
        ((0..8).map(corner).sum::<f64>() / 8.0).sqrt()
    }
}

/// One degree, rad.
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// A stylus of the workshop; base of the other worlds.
const WORKSHOP: WorldRanges = WorldRanges {
    radius: [1.9e-3, 3.1e-3],
    stiffness: [26e3, 60e3],
    lateral: [0.45, 0.8],
    tip_offset: [0.08, 0.16],
    friction: [0.17, 0.3],
    friction_variation: [0.1, 0.25],
    friction_length: [6e-3, 15e-3],
    tare: [0.1, 1.0],
    tare_drift: [0.01, 0.045],
    clock: [2.5e-3, 9e-3],
    clock_rate: [-20e-6, 20e-6],
    pose_noise: [0.015e-3, 0.04e-3],
    pose_wander: [0.01e-3, 0.03e-3],
    orientation_noise: [0.01 * DEGREE, 0.03 * DEGREE],
    force_noise: [0.015, 0.04],
    force_step: [0.005, 0.02],
    force_play: [0.005, 0.02],
    pose_rates: &[200.0, 250.0, 330.0, 500.0],
    wrench_rates: &[500.0, 1000.0, 2000.0],
    lost: [0.0, 0.004],
    late: [0.0, 0.005],
    gap_rate: [0.0, 0.08],
    scan_edge: [1.2e-3, 2.0e-3],
    scan_noise: [0.12e-3, 0.4e-3],
    scan_correlation: [2e-3, 6e-3],
    scan_white: [0.05, 0.4],
    scan_bias: [-0.1e-3, 0.2e-3],
    scan_scale: [-3e-4, 3e-4],
    missing: [0.0, 4.0],
    force: [1.5, 3.5],
    unevenness: [0.1, 0.3],
    tilt: [3.0 * DEGREE, 8.0 * DEGREE],
    stray: [0.1e-3, 0.3e-3],
    habits: &[Habit::Slide, Habit::Slide, Habit::Scrub],
    stds: CalibrationStds {
        radius: 3e-6,
        stiffness: 0.04,
        tip_offset: 0.02e-3,
        shift: 0.02e-3,
        turn: 0.02 * DEGREE,
        clock: 0.3e-3,
        tare: 0.03,
        scan_noise: 0.15,
    },
};

const OPTICAL_TRACKER: WorldRanges = WorldRanges {
    clock: [10e-3, 60e-3],
    clock_rate: [-80e-6, 80e-6],
    pose_noise: [0.07e-3, 0.2e-3],
    pose_wander: [0.04e-3, 0.12e-3],
    orientation_noise: [0.02 * DEGREE, 0.06 * DEGREE],
    pose_rates: &[30.0, 60.0, 100.0, 120.0],
    wrench_rates: &[125.0, 250.0, 1000.0],
    lost: [0.006, 0.03],
    late: [0.008, 0.03],
    gap_rate: [0.15, 0.5],
    stds: CalibrationStds {
        tip_offset: 0.05e-3,
        shift: 0.06e-3,
        turn: 0.04 * DEGREE,
        clock: 1e-3,
        ..WORKSHOP.stds
    },
    ..WORKSHOP
};

const UR_ARM: WorldRanges = WorldRanges {
    radius: [0.9e-3, 1.4e-3],
    stiffness: [30e3, 90e3],
    lateral: [0.35, 0.7],
    tare: [0.3, 3.0],
    tare_drift: [0.06, 0.2],
    clock: [-4e-3, 1e-3],
    clock_rate: [-1e-6, 1e-6],
    pose_noise: [0.004e-3, 0.015e-3],
    pose_wander: [0.02e-3, 0.045e-3],
    orientation_noise: [0.002 * DEGREE, 0.01 * DEGREE],
    force_noise: [0.08, 0.25],
    force_step: [0.02, 0.1],
    force_play: [0.06, 0.2],
    pose_rates: &[125.0, 500.0],
    wrench_rates: &[125.0, 500.0],
    lost: [0.0, 0.001],
    late: [0.0, 0.002],
    gap_rate: [0.0, 0.02],
    force: [3.0, 6.0],
    habits: &[Habit::Slide, Habit::Tap],
    stds: CalibrationStds {
        radius: 2e-6,
        tip_offset: 0.04e-3,
        shift: 0.05e-3,
        tare: 0.1,
        ..WORKSHOP.stds
    },
    ..WORKSHOP
};

const SOFT_PROBE: WorldRanges = WorldRanges {
    stiffness: [3e3, 9e3],
    lateral: [0.15, 0.4],
    tip_offset: [0.15, 0.3],
    force: [0.8, 1.8],
    stds: CalibrationStds {
        stiffness: 0.06,
        tip_offset: 0.04e-3,
        ..WORKSHOP.stds
    },
    ..WORKSHOP
};

const CARELESS_OPERATOR: WorldRanges = WorldRanges {
    friction: [0.2, 0.45],
    friction_variation: [0.2, 0.35],
    tare: [0.2, 1.5],
    scan_edge: [2.6e-3, 3.5e-3],
    scan_noise: [0.7e-3, 1.0e-3],
    scan_bias: [-0.5e-3, 0.25e-3],
    scan_scale: [-8e-4, 8e-4],
    missing: [3.0, 10.0],
    unevenness: [0.4, 0.7],
    tilt: [8.0 * DEGREE, 15.0 * DEGREE],
    stray: [0.3e-3, 0.8e-3],
    habits: &[Habit::Slide, Habit::Scrub, Habit::Tap],
    stds: CalibrationStds {
        radius: 10e-6,
        stiffness: 0.1,
        shift: 0.1e-3,
        tare: 0.08,
        ..WORKSHOP.stds
    },
    ..WORKSHOP
};

impl SimWorld {
    fn ranges(self) -> WorldRanges {
        match self {
            Self::WorkshopStylus => WORKSHOP,
            Self::OpticalTracker => OPTICAL_TRACKER,
            Self::Ur => UR_ARM,
            Self::SoftProbe => SOFT_PROBE,
            Self::CarelessOperator => CARELESS_OPERATOR,
        }
    }
}
