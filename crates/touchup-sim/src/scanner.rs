//! A scanner that makes a bad mesh of a good surface.
//!
//! Its errors act on the signed distance, on a grid: a flat closing across the view fills narrow
//! holes, a blur rounds the edges, an offset makes the part too large, a smooth random field makes
//! it wavy. The level of such a field cannot cross itself, and its triangles keep to that. Then
//! invisible surface goes, and the remainder gets a rigid offset.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, Unit, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::error::{SimError, not_negative, positive, up_to};
use super::random::{gauss, gauss_vector, uniform};
use crate::paths::path::looking_along;
use crate::surfaces::contour::{MeshDraft, contour};
use crate::surfaces::field::GridField;
use crate::surfaces::surface::Surface;
use touchup_geometry::mesh::TriMesh;
use touchup_geometry::numeric::weighted_quantile;

settings! {
    /// Errors of the scanner.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ScannerParams,
    /// A hand-held structured-light scanner of the cheaper kind, looking down.
    default {
        /// Median length of the triangles' edges, m.
        edge: f64 = 2.4e-3, positive("the scan's edge length", *edge, "m");
        /// Noise along the normals, root mean square, m.
        noise: f64 = 0.6e-3, not_negative("the scan's noise", *noise, "m");
        /// Correlation length of the noise, m.
        noise_correlation: f64 = 3.5e-3, positive("the correlation length of the noise", *noise_correlation, "m");
        /// Share of the noise's power that is independent from vertex to vertex.
        white_share: f64 = 0.02,
            not_negative("the white share of the noise", *white_share, ""),
            not_negative("the coloured share of the noise", 1.0 - white_share, "");
        /// Surface offset: the part looks larger by this on all sides, m.
        bias: f64 = 0.3e-3;
        /// Standard deviation of the blur that rounds the edges, m.
        rounding: f64 = 0.8e-3, not_negative("the rounding", *rounding, "m");
        /// Maximum width of closed holes and slots, m; the noise may open slightly narrower ones.
        closes_holes_below: f64 = 11e-3, not_negative("the width of closed holes", *closes_holes_below, "m");
        /// Relative excess of all lengths, from the middle of the part.
        scale_error: f64 = 0.0, not_negative("the size of the scale error", scale_error.abs(), ""),
            not_negative("what the scale error leaves", 1.0 + scale_error, "");
        /// Number of missing places that the scanner did not see.
        missing: usize = 0, up_to("the number of missing places", *missing as f64, "", 1e4, "10000 or less");
        /// Radius of each, m.
        missing_radius: f64 = 3e-3, not_negative("the radius of missing places", *missing_radius, "m");
        /// Translation of the rigid offset of the scan, m.
        rigid_shift: f64 = 0.2e-3, not_negative("the rigid shift", *rigid_shift, "m");
        /// Angle of the rigid offset, rad.
        rigid_turn: f64 = 0.15f64.to_radians(),
            not_negative("the rigid turn", *rigid_turn, "rad"), not_negative("the size of the bias", bias.abs(), "m");
        /// Direction in which the scanner looks, in O.
        view: Unit<Vector3<f64>> = -Vector3::z_axis();
        /// Angle between the two lines of sight of a triangulation, rad: places that only one of
        /// them reaches, such as the floor of a deep hole, are missing. 0: one line is enough.
        baseline: f64 = 0.0, not_negative("the angle between the lines of sight", *baseline, "rad"),
            up_to("the angle between the lines of sight", *baseline, "rad", 1.0, "1 rad or less");
        /// Whether places invisible from the view direction are missing; otherwise the scan is
        /// closed.
        open_back: bool = true;
        /// Seed of all randomness.
        seed: u64 = 1;
    }
}

/// Nodes of the grid to a wanted edge.
const NODES_PER_EDGE: f64 = 3.0;
/// Most nodes of the grid: 300 × 300 × 250 mm at 0.8 mm; 0.3 GB.
const MAX_NODES: usize = 36_000_000;
/// Side of the contour's cells over the median edge of the relaxed triangles, measured.
const CELL_PER_EDGE: f64 = 1.065;
/// Waves of the noise: with a hundred its distribution is Gaussian to the eye.
const WAVES: usize = 96;
/// Nodes along x in one summation of the waves.
const RUN: usize = 64;
/// Ratio of edge to part above which a scan without faces is due to the edges.
const COARSE: f64 = 0.1;
/// Cosine to the view below which faces are invisible; walls along the view stay visible: the
/// scanner moves about.
const SEEN: f64 = -0.35;
/// Number of turns of the scanner about the view.
const SIGHT_TURNS: usize = 12;
/// Sideways leans of the scanner, rad.
const SIGHT_LEANS: [f64; 3] = [0.0, 0.35, 0.7];
/// Minimum size of an isolated patch in faces: smaller visible ones are dirt, smaller invisible
/// gaps are filled.
const FEWEST_FACES: usize = 30;

/// Rounds of repair and relaxation; the second finds little, the third next to nothing.
const REPAIRS: usize = 2;
/// Maximum number of edges of a filled rim, which is a defect of the contour.
const LONGEST_FILLED: usize = 20;

impl ScannerParams {
    /// A stationary scanner with striped light: fine and exact, but blind to the floor of a deep
    /// hole.
    pub fn good() -> Self {
        Self {
            edge: 0.8e-3,
            noise: 0.04e-3,
            noise_correlation: 1.5e-3,
            bias: 0.02e-3,
            rounding: 0.2e-3,
            closes_holes_below: 2e-3,
            rigid_shift: 0.05e-3,
            rigid_turn: 0.03f64.to_radians(),
            baseline: 25f64.to_radians(),
            ..Self::default()
        }
    }

    /// Distance (m) from the surface beyond which the field has no effect: blur, bias, noise and
    /// the gradient stay within.
    fn band(&self) -> f64 {
        3.0 * self.rounding + self.bias.abs() + 4.0 * self.noise + self.edge
    }
}

/// Scans a surface with the errors of `params`; same parameters, same mesh.
///
/// # Errors
/// [`SimError::BadParameter`]; [`SimError::TooFine`] for a grid beyond its limit;
/// [`SimError::TooCoarse`] and [`SimError::NothingSeen`] if no face remains.
pub fn scan(surface: &dyn Surface, params: &ScannerParams) -> Result<TriMesh, SimError> {
    params.check()?;
    let mut rng = Pcg64::seed_from_u64(params.seed);
    let frame_ov = looking_along(&params.view, &surface.bounds());
    let field = scanned_field(surface, params, &frame_ov, &mut rng)?;
    let side = params.edge * CELL_PER_EDGE;
    let mut soup = contour(&field, side);
    // first the lattice's own defects, then the folds that relaxation leaves
    for _ in 0..REPAIRS {
        repair_mut(&mut soup, &field);
        soup.even_out_mut(&field, side);
    }
    repair_mut(&mut soup, &field);
    for p in &mut soup.positions {
        let normal = field
            .gradient(p)
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::z);
        *p += normal * (gauss(&mut rng) * params.noise * params.white_share.sqrt());
    }
    let sight = sight_pairs(params.baseline);
    let is_lit = |corners: &_| sight.is_empty() || is_triangulated(&field, corners, &sight);
    soup.retain_mut(FEWEST_FACES, |corners| {
        !params.open_back || is_seen(&field, corners) && is_lit(corners)
    });
    soup.drop_crossings_mut()?;
    soup.tidy_mut();
    for _ in 0..params.missing {
        lose_place_mut(&mut soup, params.missing_radius, &mut rng);
    }
    soup.drop_unused_mut();
    if soup.faces.is_empty() {
        // name the parameter to change
        let (size_m, edge_m) = (surface.bounds().size().max(), params.edge);
        let is_coarse = edge_m > COARSE * size_m;
        return Err(if is_coarse {
            SimError::TooCoarse { size_m, edge_m }
        } else {
            SimError::NothingSeen
        });
    }
    let slip_v = slip(params, &mut rng);
    soup.positions
        .iter_mut()
        .for_each(|p| *p = frame_ov * (slip_v * (*p * (1.0 + params.scale_error))));
    Ok(TriMesh::new(soup.positions, soup.faces)?)
}

/// Removes the faces within `radius` (m) of one of the vertices.
fn lose_place_mut(soup: &mut MeshDraft, radius: f64, rng: &mut Pcg64) {
    let Some(&[corner, ..]) = soup
        .faces
        .get(uniform(rng, [0.0, soup.faces.len() as f64]) as usize)
    else {
        return;
    };
    let middle = soup.positions[corner as usize];
    let is_far = |&v: &u32| (soup.positions[v as usize] - middle).norm() > radius;
    soup.faces.retain(|face| face.iter().all(is_far));
}

/// Fills the defects of the surface.
fn repair_mut(soup: &mut MeshDraft, field: &GridField) {
    soup.drop_folds_mut(field);
    soup.tidy_mut();
    soup.fill_mut(LONGEST_FILLED);
}

/// The signed distance after the scanner's filters, in V; zero on the scan.
fn scanned_field(
    surface: &dyn Surface,
    params: &ScannerParams,
    frame_ov: &Isometry3<f64>,
    rng: &mut Pcg64,
) -> Result<GridField, SimError> {
    let pitch = params.edge / NODES_PER_EDGE;
    let band = params.band();
    let bounds = surface.bounds().seen_from(frame_ov).grown(band);
    let nodes: f64 = bounds
        .size()
        .iter()
        .map(|side| side / pitch + 2.0)
        .product();
    if !nodes.is_finite() || nodes > MAX_NODES as f64 {
        let size_m = surface.bounds().size().max();
        return Err(SimError::TooFine {
            size_m,
            margin_m: band,
            edge_m: params.edge,
            limit: MAX_NODES,
        });
    }
    let mut field = GridField::of_surface(surface, frame_ov, [bounds.min, bounds.max], pitch, band);
    field.close_mut(params.closes_holes_below / 2.0);
    field.blur_mut(params.rounding);
    let waves = Waves::new(params, pitch, rng);
    let (mean, deviation) = waves.spread(&mut field);
    let amplitude = params.noise * (1.0 - params.white_share).sqrt() / deviation;
    // far from the level the noise decides nothing
    waves.for_each_near(&mut field, band, |d, wave| {
        *d -= params.bias + (wave - mean) * amplitude
    });
    Ok(field)
}

/// A smooth random field: waves with random directions, so that values correlate as exp(−r²/2ℓ²).
///
/// Along x of the grid a wave turns by the same steps in every run of nodes: cos(α + β) = cos α cos
/// β − sin α sin β, with α for the step, known beforehand, and β for the run's first node.
struct Waves {
    /// vector (1/m, in V) and phase
    waves: Vec<(Vector3<f64>, f64)>,
    /// cos α and sin α of each wave at the nodes of a run
    turns: Vec<[[f64; RUN]; 2]>,
}

impl Waves {
    fn new(params: &ScannerParams, pitch: f64, rng: &mut Pcg64) -> Self {
        let mut wave = || {
            let vector = gauss_vector(rng) / params.noise_correlation;
            (vector, std::f64::consts::TAU * uniform(rng, [0.0, 1.0]))
        };
        let waves: Vec<(Vector3<f64>, f64)> = (0..WAVES).map(|_| wave()).collect();
        let alphas =
            |k: &Vector3<f64>| std::array::from_fn::<_, RUN, _>(|i| k.x * pitch * i as f64);
        let turns = waves
            .iter()
            .map(|(k, _)| [alphas(k).map(f64::cos), alphas(k).map(f64::sin)])
            .collect();
        Self { waves, turns }
    }

    /// The sum of the waves at the nodes of a run that begins at `first` (m, in V).
    fn along(&self, first: &Point3<f64>) -> [f64; RUN] {
        let mut sums = [0.0; RUN];
        for ((k, phase), [cos, sin]) in self.waves.iter().zip(&self.turns) {
            let (sin_first, cos_first) = (k.dot(&first.coords) + phase).sin_cos();
            for i in 0..RUN {
                sums[i] += cos[i] * cos_first - sin[i] * sin_first;
            }
        }
        sums
    }

    /// Mean and standard deviation over the nodes at the field's zero level: they make noise and
    /// bias of every seed exactly as set.
    fn spread(&self, field: &mut GridField) -> (f64, f64) {
        let mut found = Vec::new();
        let pitch = field.pitch;
        self.for_each_near(field, pitch, |_, wave| found.push(wave));
        let count = found.len().max(1) as f64;
        let mean = found.iter().sum::<f64>() / count;
        let variance = found.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
        (mean, variance.sqrt().max(f64::MIN_POSITIVE))
    }

    /// Calls `f(value of the field, sum of the waves)` for every node whose value is less than
    /// `level` from zero.
    fn for_each_near(&self, field: &mut GridField, level: f64, mut f: impl FnMut(&mut f64, f64)) {
        for (first, values) in field.runs_mut(RUN) {
            if values.iter().any(|value| value.abs() < level) {
                let sums = self.along(&first);
                values
                    .iter_mut()
                    .zip(sums)
                    .filter(|(value, _)| value.abs() < level)
                    .for_each(|(value, sum)| f(value, sum));
            }
        }
    }
}

/// Pairs of lines of sight, each `baseline` (rad) apart, as unit vectors in V towards the scanner,
/// which turns about the view and leans aside.
fn sight_pairs(baseline: f64) -> Vec<[Vector3<f64>; 2]> {
    if baseline == 0.0 {
        return Vec::new();
    }
    let towards = |lean: f64, about: f64| {
        Rotation3::from_axis_angle(&Vector3::z_axis(), about)
            * Vector3::new(lean.sin(), 0.0, lean.cos())
    };
    let pair = |lean: f64, about: f64| {
        [lean - baseline / 2.0, lean + baseline / 2.0].map(|lean| towards(lean, about))
    };
    let abouts = (0..SIGHT_TURNS).map(|i| std::f64::consts::TAU * i as f64 / SIGHT_TURNS as f64);
    abouts
        .flat_map(|about| SIGHT_LEANS.map(|lean| pair(lean, about)))
        .collect()
}

/// Whether both lines of a pair reach a face.
fn is_triangulated(
    field: &GridField,
    [a, b, c]: &[Point3<f64>; 3],
    pairs: &[[Vector3<f64>; 2]],
) -> bool {
    let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
    let Some(normal) = field.gradient(&middle).try_normalize(0.0) else {
        return false;
    };
    let start = middle + normal * (2.0 * field.pitch);
    let top = field.node(field.nodes.map(|n| n - 1)).z;
    let reaches = |sight: &Vector3<f64>| {
        let steps = ((top - start.z) / (field.pitch * sight.z)).max(0.0) as usize;
        normal.dot(sight) > 0.0
            && (0..steps).all(|i| field.at(&(start + sight * (i as f64 * field.pitch))) > 0.0)
    };
    pairs.iter().any(|pair| pair.iter().all(reaches))
}

/// Whether a face looks towards the scanner without occlusion.
fn is_seen(field: &GridField, [a, b, c]: &[Point3<f64>; 3]) -> bool {
    let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
    let Some(normal) = field.gradient(&middle).try_normalize(0.0) else {
        return false;
    };
    // from a little off the face, so that it does not hide itself
    let start = middle + normal * (2.0 * field.pitch);
    let top = field.node(field.nodes.map(|n| n - 1)).z;
    let steps = ((top - start.z) / field.pitch).max(0.0) as usize;
    normal.z > SEEN
        && (0..steps)
            .all(|i| field.at(&(start + Vector3::z() * (i as f64 * field.pitch))) > -field.pitch)
}

/// The rigid offset of the scan, about the middle of the part.
fn slip(params: &ScannerParams, rng: &mut Pcg64) -> Isometry3<f64> {
    let mut direction = || Unit::new_normalize(gauss_vector(rng));
    let shift = Translation3::from(direction().into_inner() * params.rigid_shift);
    let turn = Rotation3::from_axis_angle(&direction(), params.rigid_turn);
    Isometry3::from_parts(shift, turn.into())
}

/// Deviation of a scan from its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanQuality {
    /// number of triangles
    pub faces: usize,
    /// median length of the edges, m
    pub edge_median: f64,
    /// mean distance of the mesh's points from the surface, m
    pub mean: f64,
    /// root mean square of it, m
    pub rms: f64,
    /// exceeded by one in twenty points, m
    pub p95: f64,
    /// median signed distance, m; positive if the scan lies outside the part
    pub bias: f64,
}

/// Sample points of each face: its middle and three points around it, each for a quarter of its
/// area.
const SAMPLES: [[f64; 3]; 4] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
];

/// Measures a mesh against the surface it should show, weighted by area.
///
/// - `within`: selects points, e.g. of a touched region; the edges are those of all faces.
/// - returns `None` without points.
pub fn measure_quality(
    mesh: &TriMesh,
    surface: &dyn Surface,
    within: impl Fn(&Point3<f64>) -> bool,
) -> Option<ScanQuality> {
    let mut edges = Vec::new();
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (face, _) in mesh.faces() {
        let corners @ [a, b, c] = mesh.triangle(face);
        edges.extend([(b - a).norm(), (c - b).norm(), (a - c).norm()].map(|length| (length, 1.0)));
        let area = mesh.double_area_normal(face).norm() / 8.0;
        let at = |w: [f64; 3]| {
            Point3::from(
                (0..3)
                    .map(|i| corners[i].coords * w[i])
                    .sum::<Vector3<f64>>(),
            )
        };
        points.extend(
            SAMPLES
                .map(at)
                .iter()
                .filter(|p| within(p))
                .map(|p| (surface.signed_distance(p), area)),
        );
    }
    let area: f64 = points.iter().map(|p| p.1).sum();
    let mean_of =
        |f: &dyn Fn(f64) -> f64| points.iter().map(|(d, w)| f(*d) * w).sum::<f64>() / area;
    let (mean, rms) = (mean_of(&f64::abs), mean_of(&|d| d * d).sqrt());
    let mut sizes: Vec<_> = points.iter().map(|(d, w)| (d.abs(), *w)).collect();
    Some(ScanQuality {
        faces: mesh.face_count(),
        edge_median: weighted_quantile(&mut edges, 0.5)?,
        mean,
        rms,
        p95: weighted_quantile(&mut sizes, 0.95)?,
        bias: weighted_quantile(&mut points, 0.5)?,
    })
}
