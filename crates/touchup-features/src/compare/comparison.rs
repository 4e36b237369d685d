//! The whole comparison of two shapes, region by region.

use nalgebra::Point3;

use super::deviation::{at_closest_places, signed};
use super::normals::{Tilt, TiltSummary, tilts};
use super::sampling::{SampledPoint, nearest_corner, sample_surface, surface_area};
use super::summary::{Histogram, Summary};
use super::{CompareError, cloud_distances};
use touchup_geometry::mesh::{FaceId, FaceTree, TriMesh, VertexId, Workers};
use touchup_geometry::numeric::quantile;

/// A mesh and the tree over its faces.
#[derive(Clone, Copy, Debug)]
pub struct IndexedMesh<'a> {
    /// m
    pub mesh: &'a TriMesh,
    /// over its faces
    pub tree: &'a FaceTree,
}

/// A part of a refined mesh, by its source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SupportRegion {
    /// as scanned
    Untouched,
    /// inferred from touches nearby
    Guessed,
    /// touched
    Touched,
}

/// Source of the regions of a mesh.
#[derive(Clone, Copy, Debug)]
pub enum Regions<'a> {
    /// unknown: only the whole
    Unknown,
    /// one for each vertex slot of the mesh itself
    Own(&'a [SupportRegion]),
    /// regions of another mesh of the same part, by its place closest to the true place
    Of(IndexedMesh<'a>, &'a [SupportRegion]),
}

/// Settings of [`compare`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompareParams {
    /// Approximate number of points on the true surface; the mesh gets the same density. Default
    /// 200 000: percentiles to a few tenths of a per cent.
    pub samples: usize,
    /// Seed of the sample.
    pub seed: u64,
    /// Half the range of the histogram, m. Default: from the 95th percentile.
    pub range: Option<f64>,
    /// Maximum distance of a visible true place from the mesh, m. Default 2 mm: three times the
    /// noise of a poor scan.
    pub reach: f64,
    /// Maximum deviation within tolerance, m. Default: none.
    pub tolerance: Option<f64>,
}

impl Default for CompareParams {
    fn default() -> Self {
        Self {
            samples: 200_000,
            seed: 1,
            range: None,
            reach: 2e-3,
            tolerance: None,
        }
    }
}

/// Maximum area of a mesh at full sampling density, in areas of the truth: a larger one probably
/// has a wrong unit.
const MOST_AREA: f64 = 10.0;

/// Narrowest automatic range, m: no scan or touch is more accurate.
const SMALLEST_RANGE: f64 = 1e-6;

/// Deviations of one region from the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionComparison {
    /// `None`: the whole
    pub region: Option<SupportRegion>,
    /// points spread over the mesh, to the true surface
    pub mesh_to_truth: Option<Summary>,
    /// the same in bins
    pub histogram: Histogram,
    /// share of them within [`CompareParams::tolerance`]; `None` without tolerance or points
    pub within_tolerance: Option<f64>,
    /// points spread over the true surface, to the mesh: missing surface. A region has the points
    /// visible on the mesh; the whole includes surface never scanned.
    pub truth_to_mesh: Option<Summary>,
    /// the mesh's vertices, to the true surface
    pub vertices_to_truth: Option<Summary>,
    /// points spread over the mesh, to the nearest point on the truth; without sign, `bias` is the
    /// mean
    pub cloud_to_truth: Option<Summary>,
    /// points on the truth, to the nearest point on the mesh
    pub truth_to_cloud: Option<Summary>,
    /// tilts of the faces
    pub tilt: Option<TiltSummary>,
}

/// Deviations of a mesh from the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// points for each m²
    pub density: f64,
    /// half the range of the histograms, m
    pub range: f64,
    /// share of the true surface missing from the mesh, or from the mesh that has the regions
    pub unseen: f64,
    /// the whole, then each region present
    pub regions: Vec<RegionComparison>,
    /// of each vertex slot, m, + outside; 0 for empty slots
    pub vertex_deviations: Vec<f64>,
}

/// Deviations, m, with the region of each; `None`: in no region.
struct RegionDeviations {
    values: Vec<f64>,
    regions: Vec<Option<SupportRegion>>,
}

impl RegionDeviations {
    /// - `corners`: vertex of the mesh near each foot on the truth.
    fn of_feet(
        feet: &[Foot],
        corners: impl Iterator<Item = VertexId>,
        regions: Regions<'_>,
        workers: &dyn Workers,
    ) -> Result<Self, CompareError> {
        let on_truth: Vec<_> = feet.iter().map(|foot| foot.point).collect();
        Ok(Self {
            values: feet.iter().map(|foot| foot.deviation).collect(),
            regions: regions_of(regions, corners, &on_truth, workers)?,
        })
    }

    /// Region and deviation of each slot for a vertex; 0 without a vertex.
    fn by_slot(&self, vertices: &[VertexId], slots: usize) -> (Vec<SupportRegion>, Vec<f64>) {
        let (mut regions, mut deviations) =
            (vec![SupportRegion::Untouched; slots], vec![0.0; slots]);
        for ((vertex, region), deviation) in vertices.iter().zip(&self.regions).zip(&self.values) {
            regions[vertex.0 as usize] = region.unwrap_or(SupportRegion::Untouched);
            deviations[vertex.0 as usize] = *deviation;
        }
        (regions, deviations)
    }

    fn within(&self, region: Option<SupportRegion>) -> Vec<f64> {
        let both = self.values.iter().zip(&self.regions);
        both.filter(|(_, at)| region.is_none() || region == **at)
            .map(|(value, _)| *value)
            .collect()
    }

    fn summary(&self, region: Option<SupportRegion>) -> Option<Summary> {
        Summary::of(&self.within(region))
    }
}

/// Closest place of a mesh to a point.
#[derive(Clone, Copy)]
struct Foot {
    deviation: f64,
    point: Point3<f64>,
    face: FaceId,
    corner: VertexId,
}

/// All measurements, before the summary by region.
struct MeasuredDeviations {
    to_truth: RegionDeviations,
    to_mesh: RegionDeviations,
    vertices: RegionDeviations,
    cloud_to_truth: RegionDeviations,
    truth_to_cloud: RegionDeviations,
    tilts: Vec<(Tilt, SupportRegion)>,
    vertex_deviations: Vec<f64>,
}

/// Compares a mesh with the truth; both lie in one frame.
///
/// - `workers`: threads for the search of closest places; the result is the same to the last bit.
///
/// # Errors
/// [`CompareError::NoFaces`] of either; [`CompareError::TooManyPoints`].
pub fn compare(
    mesh: IndexedMesh<'_>,
    truth: IndexedMesh<'_>,
    regions: Regions<'_>,
    params: &CompareParams,
    workers: &dyn Workers,
) -> Result<Comparison, CompareError> {
    // by the truth alone: a scan and its refinement then meet the same true places
    let area = surface_area(truth.mesh).max(surface_area(mesh.mesh) / MOST_AREA);
    let density = params.samples.max(1) as f64 / area;
    if !density.is_normal() {
        return Err(CompareError::NoFaces);
    }
    // another seed: a mesh equal to the truth must not meet its own points
    let [seed, other] = [params.seed, params.seed.wrapping_add(1)];
    let samples = [
        sample_surface(mesh.mesh, density, seed),
        sample_surface(truth.mesh, density, other),
    ];
    let measured = measure(mesh, truth, regions, &samples, params.reach, workers)?;
    let range = params
        .range
        .unwrap_or_else(|| fitting_range(&measured.to_truth.values));
    let parts = match regions {
        Regions::Unknown => Vec::new(),
        _ => [
            SupportRegion::Touched,
            SupportRegion::Guessed,
            SupportRegion::Untouched,
        ]
        .map(|region| measured.comparison(Some(region), range, params.tolerance))
        .into(),
    };
    let is_there =
        |part: &RegionComparison| part.mesh_to_truth.is_some() || part.truth_to_mesh.is_some();
    let whole = measured.comparison(None, range, params.tolerance);
    let regions = std::iter::once(whole)
        .chain(parts.into_iter().filter(is_there))
        .collect();
    let unseen = measured
        .to_mesh
        .regions
        .iter()
        .filter(|region| region.is_none())
        .count() as f64;
    let unseen = unseen / measured.to_mesh.regions.len().max(1) as f64;
    Ok(Comparison {
        density,
        range,
        unseen,
        regions,
        vertex_deviations: measured.vertex_deviations,
    })
}

/// - `samples`: of the mesh and of the truth.
fn measure(
    mesh: IndexedMesh<'_>,
    truth: IndexedMesh<'_>,
    regions: Regions<'_>,
    samples: &[Vec<SampledPoint>; 2],
    reach: f64,
    workers: &dyn Workers,
) -> Result<MeasuredDeviations, CompareError> {
    let [on_mesh, on_truth] = samples;
    let [mesh_points, truth_points] =
        [on_mesh, on_truth].map(|samples| samples.iter().map(|s| s.point).collect::<Vec<_>>());
    let there: Vec<VertexId> = (0..mesh.mesh.vertex_slots() as u32)
        .map(VertexId)
        .filter(|&vertex| mesh.mesh.has_vertex(vertex))
        .collect();
    let vertex_points: Vec<_> = there
        .iter()
        .map(|&vertex| mesh.mesh.position(vertex))
        .collect();

    let (mesh_feet, vertex_feet) = (
        feet(&mesh_points, truth, workers)?,
        feet(&vertex_points, truth, workers)?,
    );
    let truth_feet = feet(&truth_points, mesh, workers)?;
    let corners = on_mesh.iter().map(|sample| sample.corner);
    let to_truth = RegionDeviations::of_feet(&mesh_feet, corners, regions, workers)?;
    let corners = there.iter().copied();
    let vertices = RegionDeviations::of_feet(&vertex_feet, corners, regions, workers)?;
    let to_mesh = RegionDeviations {
        // a true point outside of the mesh is material that the mesh lacks
        values: truth_feet.iter().map(|foot| -foot.deviation).collect(),
        regions: regions_of_truth(regions, truth, on_truth, &truth_feet, mesh, reach, workers)?,
    };
    let cloud_to_truth = RegionDeviations {
        values: cloud_distances(&mesh_points, &truth_points, workers)?,
        regions: to_truth.regions.clone(),
    };
    let truth_to_cloud = RegionDeviations {
        values: cloud_distances(&truth_points, &mesh_points, workers)?,
        regions: to_mesh.regions.clone(),
    };
    let (of_slot, vertex_deviations) = vertices.by_slot(&there, mesh.mesh.vertex_slots());
    let tilts = tilts(mesh.mesh, truth.mesh, truth.tree)?;
    let tilts = tilts
        .into_iter()
        .map(|tilt| (tilt, most_common(mesh.mesh.corners(tilt.face), &of_slot)))
        .collect();
    Ok(MeasuredDeviations {
        to_truth,
        to_mesh,
        vertices,
        cloud_to_truth,
        truth_to_cloud,
        tilts,
        vertex_deviations,
    })
}

impl MeasuredDeviations {
    fn comparison(
        &self,
        region: Option<SupportRegion>,
        range: f64,
        tolerance: Option<f64>,
    ) -> RegionComparison {
        let to_truth = self.to_truth.within(region);
        let tilts = self
            .tilts
            .iter()
            .filter(|(_, at)| region.is_none_or(|region| region == *at))
            .map(|(tilt, _)| *tilt);
        RegionComparison {
            region,
            mesh_to_truth: Summary::of(&to_truth),
            histogram: Histogram::of(&to_truth, range),
            within_tolerance: tolerance.filter(|_| !to_truth.is_empty()).map(|tolerance| {
                to_truth.iter().filter(|d| d.abs() <= tolerance).count() as f64
                    / to_truth.len() as f64
            }),
            truth_to_mesh: self.to_mesh.summary(region),
            vertices_to_truth: self.vertices.summary(region),
            cloud_to_truth: self.cloud_to_truth.summary(region),
            truth_to_cloud: self.truth_to_cloud.summary(region),
            tilt: TiltSummary::of(&tilts.collect::<Vec<_>>()),
        }
    }
}

/// The feet of `points` on a shape, in their order.
fn feet(
    points: &[Point3<f64>],
    shape: IndexedMesh<'_>,
    workers: &dyn Workers,
) -> Result<Vec<Foot>, CompareError> {
    at_closest_places(points, shape.mesh, shape.tree, workers, |p, hit| {
        let corner = nearest_corner(shape.mesh.corners(hit.face), &hit.barycentric);
        Foot {
            deviation: signed(p, shape.mesh, hit),
            point: hit.point,
            face: hit.face,
            corner,
        }
    })
}

/// The region of each point.
///
/// - `own`: the mesh vertex of each point.
/// - `places`: the place of each point on the true part.
fn regions_of(
    regions: Regions<'_>,
    own: impl Iterator<Item = VertexId>,
    places: &[Point3<f64>],
    workers: &dyn Workers,
) -> Result<Vec<Option<SupportRegion>>, CompareError> {
    Ok(match regions {
        Regions::Unknown => vec![Some(SupportRegion::Untouched); places.len()],
        Regions::Own(of_vertex) => own
            .map(|vertex| Some(of_vertex[vertex.0 as usize]))
            .collect(),
        Regions::Of(other, of_vertex) => feet(places, other, workers)?
            .iter()
            .map(|foot| Some(of_vertex[foot.corner.0 as usize]))
            .collect(),
    })
}

/// The region of each point of the truth: the region of the closest place on the mesh that has the
/// regions, if it is within `reach` (m) and its normal is similar. A scan from above carries no
/// information on the underside.
///
/// - `feet`: of the points on `mesh`.
fn regions_of_truth(
    regions: Regions<'_>,
    truth: IndexedMesh<'_>,
    points: &[SampledPoint],
    feet_on_mesh: &[Foot],
    mesh: IndexedMesh<'_>,
    reach: f64,
    workers: &dyn Workers,
) -> Result<Vec<Option<SupportRegion>>, CompareError> {
    let (shape, looked_up) = match regions {
        Regions::Of(other, _) => (
            other,
            feet(
                &points.iter().map(|sample| sample.point).collect::<Vec<_>>(),
                other,
                workers,
            )?,
        ),
        _ => (mesh, feet_on_mesh.to_vec()),
    };
    let region_at = |corner: VertexId| match regions {
        Regions::Unknown => SupportRegion::Untouched,
        Regions::Own(of_vertex) | Regions::Of(_, of_vertex) => of_vertex[corner.0 as usize],
    };
    let region = |(sample, foot): (&SampledPoint, &Foot)| {
        let faces = truth
            .mesh
            .double_area_normal(sample.face)
            .dot(&shape.mesh.double_area_normal(foot.face));
        (foot.deviation.abs() <= reach && faces > 0.0).then(|| region_at(foot.corner))
    };
    Ok(points.iter().zip(&looked_up).map(region).collect())
}

/// The region of two corners of three; the middle one if all differ.
fn most_common(corners: [VertexId; 3], of_vertex: &[SupportRegion]) -> SupportRegion {
    let mut regions = corners.map(|vertex| of_vertex[vertex.0 as usize]);
    regions.sort_unstable();
    regions[1]
}

/// A round number just above the 95th percentile of the sizes: 1, 1.5, 2, 3, 5 or 7 times a power
/// of ten, m.
fn fitting_range(deviations: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = deviations.iter().map(|d| d.abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    // a perfect mesh has rounding alone
    round_up(quantile(&sizes, 0.95).max(SMALLEST_RANGE))
}

/// The next of the round numbers above `x` > 0.
pub(super) fn round_up(x: f64) -> f64 {
    let power = 10.0_f64.powi(x.log10().floor() as i32);
    let fits = |step: &&f64| **step * power >= x * (1.0 - 1e-9);
    [1.0, 1.5, 2.0, 3.0, 5.0, 7.0]
        .iter()
        .find(fits)
        .map_or(10.0 * power, |step| step * power)
}
