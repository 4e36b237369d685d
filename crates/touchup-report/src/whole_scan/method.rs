//! Methods of refining a scan, and their run times.

use std::fmt::Display;
use std::time::Instant;

use super::baselines::{ContactSculptor, GaussianParams, GaussianSurface};
use super::part::{GivenPart, Part};
use crate::error::MeasureResult;
use crate::timed;
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_method::haptic::{RefineParams, RoiSize, StepRule};
use touchup_method::reconstruct::PatcherParams;
use touchup_session::live::{Engine, Renewal};

/// Standard deviation of a contact point for the Gaussian process, m, as of a good tracking system.
const CONTACT_NOISE: f64 = 0.05e-3;
/// Reason of a baseline's refusal.
const NO_CONTACT: &str = "the place has no normal, or is another touch's";
/// Number of samples between two checks of the time limit.
const CLOCK_EVERY: usize = 64;

/// Radius of the region that follows a touched face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reach {
    /// the face alone
    Handle,
    /// its neighbours
    OneRing,
    /// vertices within this multiple of the ball's radius
    TipRadii(f64),
}

/// A method that refines a scan by touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RefineMethod {
    /// the published rule, integrated by Dormand–Prince 5(4), the pair of ode45
    PaperOde45,
    /// the published rule in exact steps
    PaperLie,
    /// the repaired rule: the haptic update alone
    Robust(Reach),
    /// the repaired rule with remeshing of the touched part, as in `touchup refine`
    Patch,
    /// contact points alone, a baseline
    ContactPoints,
    /// a Gaussian-process implicit surface, a baseline
    GaussianProcess,
}

impl RefineMethod {
    /// Default region of the robust mode.
    pub const HAPTIC: Self = Self::Robust(Reach::TipRadii(1.0));

    /// All methods.
    pub const ALL: [Self; 10] = [
        Self::PaperOde45,
        Self::PaperLie,
        Self::Robust(Reach::Handle),
        Self::Robust(Reach::OneRing),
        Self::Robust(Reach::TipRadii(0.5)),
        Self::HAPTIC,
        Self::Robust(Reach::TipRadii(2.0)),
        Self::Patch,
        Self::ContactPoints,
        Self::GaussianProcess,
    ];

    /// Methods that also run on finer and coarser scans.
    pub const BY_DENSITY: [Self; 3] = [Self::HAPTIC, Self::Patch, Self::ContactPoints];

    /// Name in the report.
    pub fn name(self) -> String {
        match self {
            Self::PaperOde45 => "paper, ode45".to_owned(),
            Self::PaperLie => "paper, Lie step".to_owned(),
            Self::Robust(Reach::Handle) => "robust, handle alone".to_owned(),
            Self::Robust(Reach::OneRing) => "robust, one ring".to_owned(),
            Self::Robust(Reach::TipRadii(radii)) => format!("robust, {radii} tip radii"),
            Self::Patch => "robust with patch".to_owned(),
            Self::ContactPoints => "contact points alone (baseline)".to_owned(),
            Self::GaussianProcess => "Gaussian process (baseline)".to_owned(),
        }
    }
}

/// Limits of a run.
pub(super) struct RunLimits {
    /// longest duration before a stop, s
    pub longest_s: f64,
    /// touches for the Gaussian process
    pub touches: usize,
}

/// A run from the scan to the result.
pub(super) struct MethodRun {
    pub mesh: TriMesh,
    /// time before the first sample, s
    pub build_s: f64,
    pub fed: FeedReport,
    /// time after the last sample, s
    pub end_s: f64,
    /// available samples or touches
    pub offered: usize,
    /// share of updates cut back
    pub cut_back_share: f64,
}

/// Times and counts of the input to a method.
#[derive(Default)]
pub(super) struct FeedReport {
    /// total time, s
    pub time_s: f64,
    /// samples or touches
    pub given: usize,
    /// refusals, and the cause of the first
    pub refused: usize,
    pub why: Option<String>,
    /// seconds between two clock checks
    pub laps: Vec<f64>,
}

/// Gives `items` to `take` until its time is over; checks the clock after each `lap` of them.
fn feed<T, E: Display>(
    items: impl Iterator<Item = T>,
    lap: usize,
    longest_s: f64,
    mut take: impl FnMut(T) -> Result<(), E>,
) -> FeedReport {
    let begun = Instant::now();
    let mut fed = FeedReport::default();
    for item in items {
        fed.given += 1;
        if let Err(error) = take(item) {
            fed.refused += 1;
            fed.why.get_or_insert_with(|| error.to_string());
        }
        if fed.given % lap == 0 {
            let time_s = begun.elapsed().as_secs_f64();
            fed.laps.push(time_s - fed.time_s);
            fed.time_s = time_s;
            if time_s > longest_s {
                return fed;
            }
        }
    }
    fed.time_s = begun.elapsed().as_secs_f64();
    fed
}

/// Refines `scan` by one method.
pub(super) fn run(
    method: RefineMethod,
    part: &Part,
    scan: &TriMesh,
    limits: &RunLimits,
) -> MeasureResult<MethodRun> {
    match method {
        RefineMethod::ContactPoints => Ok(sculpt(part, scan, limits)),
        RefineMethod::GaussianProcess => Ok(fit_gaussian(part, scan, limits)),
        _ => refine(method, part, scan, limits),
    }
}

fn params(method: RefineMethod, part: &GivenPart) -> RefineParams {
    let &GivenPart {
        tip,
        compensator,
        scan_noise,
        ..
    } = part;
    let mut params = match method {
        RefineMethod::PaperOde45 | RefineMethod::PaperLie => RefineParams::paper(tip),
        _ => RefineParams::robust(tip),
    };
    (params.compensator, params.scan_noise) = (compensator, scan_noise);
    match method {
        RefineMethod::PaperOde45 => params.dynamics.rule = StepRule::DormandPrince,
        RefineMethod::PaperLie => params.dynamics.rule = StepRule::Lie,
        RefineMethod::Robust(Reach::Handle) => params.roi = RoiSize::Handle,
        RefineMethod::Robust(Reach::OneRing) => params.roi = RoiSize::OneRing,
        RefineMethod::Robust(Reach::TipRadii(radii)) => {
            params.roi = RoiSize::Radius(radii * tip.radius)
        }
        _ => {}
    }
    params
}

/// The haptic update, with the patch if the method has one.
fn refine(
    method: RefineMethod,
    part: &Part,
    scan: &TriMesh,
    limits: &RunLimits,
) -> MeasureResult<MethodRun> {
    let GivenPart {
        samples,
        tip,
        scan_noise,
        ..
    } = &part.given;
    let copy = scan.clone();
    let (build_s, engine) = timed(|| {
        let patch = (method == RefineMethod::Patch)
            .then(|| PatcherParams::new(tip.radius, tip.stiffness, *scan_noise));
        Engine::new(copy, params(method, &part.given), patch, Renewal::AtEnd)
    });
    let mut engine = engine?;
    let fed = feed(samples.iter(), CLOCK_EVERY, limits.longest_s, |sample| {
        engine.push(sample).map(drop)
    });
    let (end_s, finished) = timed(|| -> MeasureResult<_> {
        let mut ended = engine.finish()?;
        let counts = *ended.refiner.counts();
        let Some(mut patcher) = ended.patcher.take() else {
            return Ok((counts, ended.mesh().into_owned()));
        };
        patcher.flush();
        Ok((counts, patcher.patched(scan, &FaceTree::new(scan))?.mesh))
    });
    let (counts, mesh) = finished?;
    let cut_back_share = counts.cut_back as f64 / counts.moved.max(1) as f64;
    Ok(MethodRun {
        mesh,
        build_s,
        fed,
        end_s,
        offered: samples.len(),
        cut_back_share,
    })
}

fn sculpt(part: &Part, scan: &TriMesh, limits: &RunLimits) -> MethodRun {
    let (contacts, radius) = (&part.contacts, part.given.tip.radius);
    let (build_s, mut sculptor) = timed(|| ContactSculptor::new(scan, radius, radius));
    let fed = feed(contacts.iter(), CLOCK_EVERY, limits.longest_s, |contact| {
        sculptor.push(&contact.reported).map(drop).ok_or(NO_CONTACT)
    });
    MethodRun {
        mesh: sculptor.mesh,
        build_s,
        fed,
        end_s: 0.0,
        offered: contacts.len(),
        cut_back_share: 0.0,
    }
}

fn fit_gaussian(part: &Part, scan: &TriMesh, limits: &RunLimits) -> MethodRun {
    let GivenPart {
        scan_noise, tip, ..
    } = &part.given;
    let (amplitude, length) = (scan_noise.max(CONTACT_NOISE), 2.0 * tip.radius);
    let contacts = &part.contacts;
    let stride = contacts.len().div_ceil(limits.touches).max(1);
    let process = GaussianParams {
        amplitude,
        length,
        noise: CONTACT_NOISE,
    };
    let (build_s, mut surface) = timed(|| GaussianSurface::new(scan, process));
    let fed = feed(
        contacts.iter().step_by(stride),
        1,
        limits.longest_s,
        |contact| surface.push(contact.point).then_some(()).ok_or(NO_CONTACT),
    );
    let (end_s, mesh) = timed(|| surface.mesh());
    MethodRun {
        mesh,
        build_s,
        fed,
        end_s,
        offered: contacts.len(),
        cut_back_share: 0.0,
    }
}
