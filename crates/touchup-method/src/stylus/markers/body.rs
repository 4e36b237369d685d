//! Marker positions on the stylus, and the pose that best fits a set of observations.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::{MOST_MARKERS, MarkerObservation};
use crate::stylus::SettingError;
use touchup_geometry::numeric::{mean, scatter};

/// Smallest second extent of markers off a line, as a share of the body's second extent: below it
/// is noise.
const LINE_SHARE: f64 = 0.2;
/// Smallest second extent of a body that is no line, as a share of the first.
const FLAT_SHARE: f64 = 0.02;

/// The markers of a rigid body in the frame of the tip.
///
/// Invariant: 3 to `MOST_MARKERS` markers, finite, distinct and not on one line.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerBody {
    markers_t: Vec<Point3<f64>>,
    centroid_t: Point3<f64>,
    /// smallest distance between two markers, m
    pub(super) smallest_distance: f64,
    /// root of the middle eigenvalue of the scatter about the centroid, m
    second_extent: f64,
}

impl Default for MarkerBody {
    /// Six LEDs around the handle, 120 to 180 mm above the ball: the stylus of the simulation.
    fn default() -> Self {
        let markers_t = Self::STYLUS_MM
            .map(|place| Point3::from(place.map(|x| x * 1e-3)))
            .to_vec();
        Self::new(markers_t).expect("six distinct markers that are not on one line")
    }
}

/// Pairs of a marker's index in the body and its position in O.
pub(super) type MarkerPairs = [(usize, Point3<f64>)];

impl MarkerBody {
    /// The markers of the default, mm.
    pub const STYLUS_MM: [[f64; 3]; 6] = [
        [28.0, 0.0, 120.0],
        [-20.0, 22.0, 128.0],
        [-16.0, -26.0, 140.0],
        [18.0, 24.0, 155.0],
        [-30.0, 2.0, 168.0],
        [6.0, -22.0, 180.0],
    ];

    /// - `markers_t`: by label from 0 on, m, in T.
    ///
    /// # Errors
    /// [`SettingError`] for fewer than 3 or more than `MOST_MARKERS`, markers at one place or on
    /// one line, and values that are not finite.
    pub fn new(markers_t: Vec<Point3<f64>>) -> Result<Self, SettingError> {
        let count = markers_t.len();
        let fits = (3..=MOST_MARKERS).contains(&count);
        SettingError::check(
            "the number of markers.positions_mm",
            count as f64,
            fits,
            "3 to 16",
        )?;
        for x in markers_t.iter().flat_map(|p| p.iter()) {
            SettingError::check(
                "markers.positions_mm",
                *x * 1e3,
                x.abs() <= 10.0,
                "-10000 to 10000 mm",
            )?;
        }
        let centroid_t = centroid(markers_t.iter().copied());
        let pairs = (0..count).flat_map(|i| (0..i).map(move |j| (i, j)));
        let smallest_distance = pairs
            .map(|(i, j)| (markers_t[i] - markers_t[j]).norm())
            .fold(f64::MAX, f64::min);
        let [first, second_extent, _] = extents(markers_t.iter().copied());
        let apart = smallest_distance > 0.0;
        SettingError::check(
            "the smallest distance of markers.positions_mm",
            smallest_distance,
            apart,
            "more than 0",
        )?;
        let is_no_line = second_extent > FLAT_SHARE * first;
        let what = "the extent of markers.positions_mm beside their line, in m,";
        SettingError::check(
            what,
            second_extent,
            is_no_line,
            "more: they must not be on one line",
        )?;
        Ok(Self {
            markers_t,
            centroid_t,
            smallest_distance,
            second_extent,
        })
    }

    /// Each marker, m, in T.
    pub fn markers_t(&self) -> &[Point3<f64>] {
        &self.markers_t
    }

    /// Mean of the markers, m, in T.
    pub(crate) fn centroid_t(&self) -> Point3<f64> {
        self.centroid_t
    }

    /// Whether these markers determine all six degrees of freedom: three that are not on a line.
    pub(super) fn is_held_by(&self, pairs: &MarkerPairs) -> bool {
        pairs.len() >= 3
            && extents(pairs.iter().map(|&(i, _)| self.markers_t[i]))[1]
                > LINE_SHARE * self.second_extent
    }

    /// Pose of T in O by least squares of the distances between markers and their measured places
    /// \[Umeyama 1991\]: with H = Σ (r − r̄)(m − m̄)ᵀ = U S Vᵀ, R = V diag(1, 1, det V Uᵀ) Uᵀ.
    pub(super) fn fit(&self, pairs: &MarkerPairs) -> Option<Isometry3<f64>> {
        let from = centroid(pairs.iter().map(|&(i, _)| self.markers_t[i]));
        let to = centroid(pairs.iter().map(|&(_, m)| m));
        let spread: Matrix3<f64> = pairs
            .iter()
            .map(|&(i, m)| (self.markers_t[i] - from) * (m - to).transpose())
            .sum();
        let svd = spread.svd(true, true);
        let (u, v) = (svd.u?, svd.v_t?.transpose());
        let handed = Matrix3::from_diagonal(&Vector3::new(
            1.0,
            1.0,
            (v * u.transpose()).determinant().signum(),
        ));
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
            v * handed * u.transpose(),
        ));
        let pose_ot = Isometry3::from_parts((to - rotation * from).into(), rotation);
        pose_ot
            .translation
            .vector
            .iter()
            .chain(&rotation.coords)
            .all(|x| x.is_finite())
            .then_some(pose_ot)
    }

    /// Pose with most of the seen markers, and at least three, within `gate` of a marker of the
    /// body, and these matches; `None` unless more than half of the seen markers agree.
    ///
    /// Tries every three markers in turn, each identified by its label, so that the majority
    /// outvotes swapped labels and outliers.
    pub(super) fn acquire(
        &self,
        seen: &[MarkerObservation],
        gate: f64,
    ) -> Option<(Isometry3<f64>, Matches)> {
        let mut best: Option<Matches> = None;
        for (i, a) in seen.iter().enumerate() {
            for (j, b) in seen[..i].iter().enumerate() {
                for c in &seen[..j] {
                    let Some(pose_ot) = self.pose_of_three([a, b, c], gate) else {
                        continue;
                    };
                    let matches = self.matched(&pose_ot, seen, gate);
                    if best.as_ref().is_none_or(|best| matches.beats(best)) {
                        best = Some(matches);
                    }
                }
            }
        }
        let matches = best
            .filter(|best| 2 * best.pairs().len() > seen.len() && self.is_held_by(best.pairs()))?;
        Some((self.fit(matches.pairs())?, matches))
    }

    fn pose_of_three(&self, three: [&MarkerObservation; 3], gate: f64) -> Option<Isometry3<f64>> {
        let pairs = three.map(|marker| (marker.label as usize, marker.position));
        let is_known = pairs.iter().all(|&(i, _)| i < self.markers_t.len());
        let [i, j, k] = pairs.map(|(i, _)| i);
        if !is_known || i == j || j == k || i == k || !self.is_held_by(&pairs) {
            return None;
        }
        let pose_ot = self.fit(&pairs)?;
        pairs
            .iter()
            .all(|&(i, m)| (pose_ot * self.markers_t[i] - m).norm() <= gate)
            .then_some(pose_ot)
    }

    /// Matches the seen markers to the body at that pose: to the labelled marker if it is within
    /// `gate`, else to any that is. No other can be, as markers are farther apart than twice the
    /// gate.
    pub(super) fn matched(
        &self,
        pose_ot: &Isometry3<f64>,
        seen: &[MarkerObservation],
        gate: f64,
    ) -> Matches {
        let mut matches = Matches::new();
        for marker in seen {
            let distance = |i: &usize| (pose_ot * self.markers_t[*i] - marker.position).norm();
            let label = marker.label as usize;
            let is_right = |i: &usize| distance(i) <= gate;
            let found = (label < self.markers_t.len())
                .then_some(label)
                .filter(is_right);
            match found.or_else(|| (0..self.markers_t.len()).find(is_right)) {
                Some(i) => matches.add(i, marker.position, distance(&i), i != label),
                None => matches.rejected += 1,
            }
        }
        matches
    }
}

/// Observed markers matched to markers of the body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matches {
    pairs: [(usize, Point3<f64>); MOST_MARKERS],
    distances: [f64; MOST_MARKERS],
    count: usize,
    /// wrong labels
    pub relabelled: u64,
    /// markers that match none of the body
    pub rejected: u64,
}

impl Matches {
    fn new() -> Self {
        let pairs = [(0, Point3::origin()); MOST_MARKERS];
        Self {
            pairs,
            distances: [0.0; MOST_MARKERS],
            count: 0,
            relabelled: 0,
            rejected: 0,
        }
    }

    pub(crate) fn pairs(&self) -> &MarkerPairs {
        &self.pairs[..self.count]
    }

    /// Adds a match; of two matches of one marker the nearer counts.
    fn add(&mut self, i: usize, position: Point3<f64>, distance: f64, relabelled: bool) {
        let twin = self.pairs().iter().position(|&(other, _)| other == i);
        self.rejected += u64::from(twin.is_some());
        let at = twin.unwrap_or(self.count);
        if twin.is_none() || distance < self.distances[at] {
            self.relabelled += u64::from(relabelled);
            self.pairs[at] = (i, position);
            self.distances[at] = distance;
            self.count = self.count.max(at + 1);
        }
    }

    /// Whether it has more markers, or as many at less distance.
    fn beats(&self, other: &Self) -> bool {
        let off = |matches: &Self| {
            matches.distances[..matches.count]
                .iter()
                .map(|d| d * d)
                .sum::<f64>()
        };
        self.count > other.count || (self.count == other.count && off(self) < off(other))
    }
}

fn centroid(points: impl Iterator<Item = Point3<f64>>) -> Point3<f64> {
    Point3::from(mean(points.map(|p| p.coords)))
}

/// Roots of the eigenvalues of the scatter about the mean, largest first, m.
fn extents(points: impl Iterator<Item = Point3<f64>> + Clone) -> [f64; 3] {
    let squares = scatter(points.map(|p| p.coords)).symmetric_eigenvalues();
    let mut roots: [f64; 3] = squares.map(|x| x.max(0.0).sqrt()).into();
    roots.sort_by(|a, b| b.total_cmp(a));
    roots
}
