//! The paper's sweep experiment (Sec 4.3) on `peaks`, and a raster of the robust mode over the same
//! square.

use nalgebra::{Isometry3, Point2, Point3, Vector3};

use super::errors::MeshErrors;
use crate::error::MeasureResult;
use touchup_geometry::mesh::TriMesh;
use touchup_method::haptic::{GuardParams, RefineParams, Refiner, StepRule};
use touchup_method::stylus::{Sample, TipParams, Wrench};
use touchup_sim::coupled::GuidedStylus;
use touchup_sim::{
    PathParams, Peaks, RasterDirection, RasterRegion, SensorParams, StylusParams, Surface,
    TrueState, add_vertex_noise, raster, touch,
};

/// Sample period of the paper, ns and s.
const PERIOD_NS: i64 = 5_000_000;
const PERIOD: f64 = 5e-3;
/// Samples on each face: 20 s.
const SAMPLES_PER_FACE: usize = 4000;
/// Diverged: a mean error beyond this multiple of its start.
pub const BLOWN_UP: f64 = 2.0;
/// The raster's ball, m, and its stiffness, N/m.
const TIP: TipParams = TipParams {
    radius: 1.5e-3,
    stiffness: Some(20e3),
};

/// The true mesh with 3 mm of noise on each coordinate, 2 mm too high \[paper\].
pub fn noisy(truth: &TriMesh, seed: u64) -> TriMesh {
    let mut scan = truth.clone();
    add_vertex_noise(&mut scan, 3e-3, &Vector3::new(0.0, 0.0, 2e-3), seed);
    scan
}

/// The paper's rule with a point tip, and a clock.
#[derive(Clone, Debug)]
pub struct PaperSweeps {
    truth: TriMesh,
    /// the scan under refinement
    pub refiner: Refiner,
    params: RefineParams,
    stamp_ns: i64,
}

impl PaperSweeps {
    /// Sweeps over a noisy scan of `peaks` with legs of `edge` (m).
    ///
    /// # Errors
    /// [`MeasureError`](crate::error::MeasureError) for an invalid edge.
    pub fn new(edge: f64, guard: Option<GuardParams>, seed: u64) -> MeasureResult<Self> {
        let truth = Peaks::default().mesh(edge)?;
        // ten million samples: a joint solution takes twenty times as long
        let mut params = RefineParams {
            guard,
            ..RefineParams::paper(TipParams {
                radius: 0.0,
                stiffness: None,
            })
        };
        params.dynamics.rule = StepRule::DriftCorrected;
        let refiner = Refiner::new(noisy(&truth, seed), params)?;
        Ok(Self {
            truth,
            refiner,
            params,
            stamp_ns: 0,
        })
    }

    /// Sets the stylus to each face in turn and lets both follow Eq 8–11 and Eq 6–7. The true face
    /// acts as its plane does in the paper's contact model.
    ///
    /// Stops if the mean distance error is beyond [`BLOWN_UP`] times `start_mm`.
    ///
    /// # Errors
    /// [`MeasureError::Refine`](crate::error::MeasureError::Refine) for a refused step.
    pub fn sweep(&mut self, start_mm: f64) -> MeasureResult<MeshErrors> {
        let faces: Vec<_> = self.truth.faces().map(|(face, _)| face).collect();
        let (model, stylus) = (self.params.dynamics.model, GuidedStylus::default());
        for face in faces {
            let (b, n) = (self.truth.barycentre(face), self.truth.normal(face));
            let force = |p: &Point3<f64>| model.force((p - b).dot(&n)) * n;
            let mut p = self.refiner.mesh().barycentre(face);
            for _ in 0..SAMPLES_PER_FACE {
                let mesh = self.refiner.mesh();
                let (b, n) = (mesh.barycentre(face), mesh.normal(face));
                let wrench = Wrench {
                    force: force(&p),
                    torque: Vector3::zeros(),
                };
                self.stamp_ns += PERIOD_NS;
                let pose_ot = Isometry3::translation(p.x, p.y, p.z);
                self.refiner.push_on(
                    face,
                    &Sample {
                        stamp_ns: self.stamp_ns,
                        pose_ot,
                        wrench,
                    },
                )?;
                p = stylus.step(&p, &b, &n, force, PERIOD);
            }
            if self.errors().distance_mm > BLOWN_UP * start_mm {
                break;
            }
        }
        Ok(self.errors())
    }

    /// Face by face, as in the paper.
    pub fn errors(&self) -> MeshErrors {
        MeshErrors::by_index(self.refiner.mesh(), &self.truth)
    }
}

/// A square around the middle of `peaks`, from `-half` to `half` (m), for a ball of `radius` (m).
pub(crate) fn region_over(peaks: &Peaks, half: f64, radius: f64) -> RasterRegion {
    let bounds = peaks.bounds();
    RasterRegion {
        frame_ov: Isometry3::identity(),
        low: Point2::new(-half, -half),
        high: Point2::new(half, half),
        floor: bounds.min.z,
        clear: bounds.max.z + 2.0 * radius,
    }
}

/// One raster of a ball over the whole square: samples of a perfect sensor, one per millisecond.
///
/// # Errors
/// [`MeasureError::Sim`](crate::error::MeasureError::Sim) for an invalid friction.
pub fn raster_samples(peaks: &Peaks, friction: f64) -> MeasureResult<Vec<Sample>> {
    let TipParams { radius, stiffness } = TIP;
    let stiffness = stiffness.unwrap_or(f64::INFINITY);
    let region = region_over(peaks, 0.5 * 50e-3, radius);
    let path = raster(
        &region,
        RasterDirection::AlongX,
        &PathParams {
            radius,
            ..PathParams::default()
        },
    )?;
    let stylus = StylusParams {
        radius,
        stiffness,
        friction,
        force_variation: 0.0,
        tilt: 0.0,
        stray: 0.0,
        sensor: SensorParams::ideal(),
        ..StylusParams::default()
    };
    let moments = touch(peaks, &path, &stylus, 1)?.moments;
    let sample = |(i, moment): (usize, &TrueState)| {
        let mut pose_ot = moment.pose_ot;
        pose_ot.translation.vector -= moment.force_o / stiffness;
        let force = moment.pose_ot.rotation.inverse() * moment.force_o;
        Sample {
            stamp_ns: (i as i64 + 1) * 1_000_000,
            pose_ot,
            wrench: Wrench {
                force,
                torque: Vector3::zeros(),
            },
        }
    };
    Ok(moments.iter().enumerate().map(sample).collect())
}

/// Rasters of the robust mode over a noisy scan.
#[derive(Clone, Debug)]
pub struct RobustSweeps<'a> {
    peaks: &'a Peaks,
    samples: &'a [Sample],
    /// the scan under refinement
    pub refiner: Refiner,
    last_ns: i64,
}

impl<'a> RobustSweeps<'a> {
    /// - `scan`: with the noise of [`noisy`]; `samples`: of [`raster_samples`].
    ///
    /// # Errors
    /// [`MeasureError::Refine`](crate::error::MeasureError::Refine) for a scan without faces.
    pub fn new(peaks: &'a Peaks, scan: TriMesh, samples: &'a [Sample]) -> MeasureResult<Self> {
        let params = RefineParams {
            scan_noise: 3e-3,
            ..RefineParams::robust(TIP)
        };
        Ok(Self {
            peaks,
            samples,
            refiner: Refiner::new(scan, params)?,
            last_ns: 0,
        })
    }

    /// Runs one raster over the square.
    ///
    /// # Errors
    /// [`MeasureError::Refine`](crate::error::MeasureError::Refine) for a refused sample.
    pub fn sweep(&mut self) -> MeasureResult<MeshErrors> {
        let start_ns = self.last_ns;
        for sample in self.samples {
            self.last_ns = start_ns + sample.stamp_ns;
            self.refiner.push(&Sample {
                stamp_ns: self.last_ns,
                ..*sample
            })?;
        }
        Ok(self.errors())
    }

    /// Against the surface: beyond a raster, faces share no index with the truth.
    pub fn errors(&self) -> MeshErrors {
        MeshErrors::by_surface(self.refiner.mesh(), self.peaks)
    }
}
