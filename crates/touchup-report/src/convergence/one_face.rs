//! One face against one true plane \[paper, Fig 6 and 7\]: the paper's coupled dynamics (Eq 6, 7,
//! 10), from a state off in position and direction to rest.

use nalgebra::{Point3, Vector3};

use crate::error::MeasureResult;
use touchup_method::haptic::{DynamicsParams, FaceDynamics, FaceState, RefineError, RefineParams};
use touchup_method::stylus::TipParams;
use touchup_sim::coupled::GuidedStylus;

/// Sample period, s.
const PERIOD_S: f64 = 1e-3;
/// Initial height of the stylus above the face, m.
const START_ABOVE: f64 = 5e-3;

/// The face, the tip and their errors at one instant; the true plane is z = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneFaceSample {
    /// time since the start, s
    pub time_s: f64,
    /// b*, mm
    pub barycentre_mm: [f64; 3],
    /// p, mm
    pub tip_mm: [f64; 3],
    /// |(b* − b)·n|, mm
    pub distance_mm: f64,
    /// angle between n* and n, degrees
    pub normal_deg: f64,
}

/// A face from its start to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct OneFaceRun {
    /// angle between n* and n at the start, degrees
    pub tilt_deg: f64,
    /// in order of time
    pub samples: Vec<OneFaceSample>,
}

/// Starts of the faces: b*, mm, tilt and azimuth of n*, degrees.
const STARTS: [([f64; 3], f64, f64); 3] = [
    ([3.0, -2.0, 2.5], 20.0, 17.0),
    ([-1.0, 4.0, -3.0], 10.0, 115.0),
    ([0.5, 0.5, 4.0], 40.0, 230.0),
];

/// Runs each start for `seconds` (s), with a sample every 10 ms.
///
/// # Errors
/// [`MeasureError`](crate::error::MeasureError) for a refused step.
pub(super) fn one_face_runs(seconds: usize) -> MeasureResult<Vec<OneFaceRun>> {
    STARTS
        .iter()
        .map(|&(b_mm, tilt_deg, azimuth_deg)| one_face(b_mm, tilt_deg, azimuth_deg, seconds))
        .collect()
}

fn one_face(
    b_mm: [f64; 3],
    tilt_deg: f64,
    azimuth_deg: f64,
    seconds: usize,
) -> MeasureResult<OneFaceRun> {
    let params: DynamicsParams = RefineParams::paper(TipParams {
        radius: 0.0,
        stiffness: None,
    })
    .dynamics;
    let dynamics = FaceDynamics::new(params).map_err(RefineError::from)?;
    let stylus = GuidedStylus::default();
    let surface = |p: &Point3<f64>| params.model.force(p.z) * Vector3::z();
    let ([sine, cosine], azimuth) = (
        <[f64; 2]>::from(tilt_deg.to_radians().sin_cos()),
        azimuth_deg.to_radians(),
    );
    let initial_normal = Vector3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine);
    let mut face = FaceState {
        b: Point3::from(b_mm.map(|x| 1e-3 * x)),
        n: initial_normal,
    };
    let mut p = face.b + START_ABOVE * Vector3::z();
    let mut samples = Vec::with_capacity(100 * seconds + 1);
    for tick in 0..=(1000 * seconds) {
        if tick % 10 == 0 {
            samples.push(OneFaceSample {
                time_s: tick as f64 * PERIOD_S,
                barycentre_mm: (face.b.coords * 1e3).into(),
                tip_mm: (p.coords * 1e3).into(),
                distance_mm: 1e3 * face.b.z.abs(),
                normal_deg: face
                    .n
                    .cross(&Vector3::z())
                    .norm()
                    .atan2(face.n.z)
                    .to_degrees(),
            });
        }
        let moved = dynamics.step_from(&initial_normal, &face, &p, &surface(&p), PERIOD_S);
        face = moved.map_err(RefineError::from)?;
        p = stylus.step(&p, &face.b, &face.n, surface, PERIOD_S);
    }
    Ok(OneFaceRun { tilt_deg, samples })
}

impl OneFaceRun {
    /// Time after which an error stays below a share of its start, s; `None` if it never does.
    pub fn time_to_share(&self, share: f64, error: impl Fn(&OneFaceSample) -> f64) -> Option<f64> {
        let first = self.samples.first().map(&error)?;
        let above = self
            .samples
            .iter()
            .rposition(|sample| error(sample) > share * first)?;
        self.samples.get(above + 1).map(|sample| sample.time_s)
    }
}
