//! Small sets of features that determine a motion: for each a frame and its invariants under rigid
//! motions.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::landmark::{ALIKE, Landmark};
use crate::features::FeatureKind;

/// Class of a set of features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum SetClass {
    /// two features with a place and an axis
    Pair(FeatureKind, FeatureKind),
    /// one such feature and a plane not square to its axis
    Beside(FeatureKind),
    /// a slot with its direction
    Slot,
    /// three planes that meet
    Corner,
    /// two features about one axis, or one and a plane square to it: the turn is open
    Axis(FeatureKind, FeatureKind),
}

/// A frame made of features.
#[derive(Clone, Debug)]
pub(super) struct Base {
    class: SetClass,
    /// m: the search key
    length: f64,
    /// cosines and volumes of directions
    cosines: [f64; 4],
    origin: Point3<f64>,
    axes: Matrix3<f64>,
    /// landmarks with sizes to compare
    pub of: [usize; 2],
}

/// Sine of the least angle between two directions of a frame: 15°.
const LEAST_SINE: f64 = 0.26;
/// Largest difference of the cosines of equal sets: 4° at the most sensitive angle.
const COSINES: f64 = 0.07;
/// Maximum number of features with a place and an axis that make pairs; the first of the list, the
/// largest of their kind.
const MOST_LOCATED: usize = 150;

fn frame(first: &Vector3<f64>, second: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let third = first.cross(second);
    if third.norm() < LEAST_SINE * first.norm() * second.norm() {
        return None;
    }
    let (x, z) = (first.try_normalize(0.0)?, third.try_normalize(0.0)?);
    Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
}

/// All sets.
///
/// - `all_frames`: also from the other end of through features, and each turn of a corner; for one
///   side of a match alone.
pub(super) fn bases(landmarks: &[Landmark], all_frames: bool) -> Vec<Base> {
    let located = landmarks
        .iter()
        .enumerate()
        .filter(|(_, landmark)| landmark.is_located())
        .take(MOST_LOCATED);
    let ends: Vec<(usize, Landmark)> = located
        .flat_map(|(at, landmark)| landmark.ends().map(move |end| (at, end)))
        .collect();
    let mut bases = Vec::new();
    for (i, first) in &ends {
        bases.extend(
            ends.iter()
                .filter(|(j, _)| i != j)
                .filter_map(|(j, second)| pair([*i, *j], first, second)),
        );
        let planes = landmarks
            .iter()
            .filter(|landmark| landmark.kind == FeatureKind::Plane);
        bases.extend(planes.filter_map(|plane| beside(*i, first, plane)));
        bases.extend(slot(*i, first, 1.0));
        bases.extend(slot(*i, first, -1.0).filter(|_| all_frames));
    }
    for (at, landmark) in landmarks.iter().enumerate() {
        let turns = if all_frames { 3 } else { 1 };
        bases.extend((0..turns).filter_map(|turn| corner(at, landmark, turn)));
    }
    bases
}

fn pair(of: [usize; 2], first: &Landmark, second: &Landmark) -> Option<Base> {
    let (a, b) = (first.axis?, second.axis?);
    let between = second.place - first.place;
    let direction = between.try_normalize(0.0)?;
    // the displacement between them is the most certain direction
    let axes = frame(&direction, &a).or_else(|| frame(&direction, &b))?;
    let class = SetClass::Pair(first.class(), second.class());
    let cosines = [
        a.dot(&direction),
        b.dot(&direction),
        a.dot(&b),
        a.cross(&b).dot(&direction),
    ];
    Some(Base {
        class,
        length: between.norm(),
        cosines,
        origin: first.place,
        axes,
        of,
    })
}

fn beside(at: usize, landmark: &Landmark, plane: &Landmark) -> Option<Base> {
    let (axis, normal) = (landmark.axis?, plane.axis?);
    let (class, length) = (
        SetClass::Beside(landmark.class()),
        (landmark.place - plane.place).dot(&normal),
    );
    let (cosines, axes) = ([axis.dot(&normal), 0.0, 0.0, 0.0], frame(&axis, &normal)?);
    Some(Base {
        class,
        length,
        cosines,
        origin: landmark.place,
        axes,
        of: [at, at],
    })
}

fn slot(at: usize, landmark: &Landmark, sign: f64) -> Option<Base> {
    let axes = frame(&landmark.axis?, &(landmark.direction? * sign))?;
    Some(Base {
        class: SetClass::Slot,
        length: 0.0,
        cosines: [0.0; 4],
        origin: landmark.place,
        axes,
        of: [at, at],
    })
}

fn corner(at: usize, landmark: &Landmark, turn: usize) -> Option<Base> {
    let normals = landmark.normals?;
    let [a, b, c] = [0, 1, 2].map(|i| normals[(turn + i) % 3]);
    let (cosines, axes) = ([a.dot(&b), b.dot(&c), c.dot(&a), 0.0], frame(&a, &b)?);
    Some(Base {
        class: SetClass::Corner,
        length: 0.0,
        cosines,
        origin: landmark.place,
        axes,
        of: [at, at],
    })
}

/// Sets that leave the turn about an axis open, each with one arbitrary turn.
///
/// - `all_frames`: as in [`bases`].
pub(super) fn axial_bases(landmarks: &[Landmark], all_frames: bool) -> Vec<Base> {
    let located = landmarks
        .iter()
        .enumerate()
        .filter(|(_, landmark)| landmark.is_located())
        .take(MOST_LOCATED);
    let mut found = Vec::new();
    for (at, landmark) in located {
        for end in landmark.ends().take(if all_frames { 2 } else { 1 }) {
            let others = landmarks
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != at);
            found.extend(others.filter_map(|(other, second)| about([at, other], &end, second)));
        }
    }
    found
}

fn about(of: [usize; 2], first: &Landmark, second: &Landmark) -> Option<Base> {
    let (axis, other) = (first.axis?, second.axis?);
    let between = second.place - first.place;
    let is_about = second.kind == FeatureKind::Plane
        || (second.is_located() && axis.cross(&between).norm() <= LEAST_SINE * between.norm());
    let (class, length) = (
        SetClass::Axis(first.class(), second.class()),
        between.dot(&axis),
    );
    let (cosines, axes) = (
        [axis.dot(&other), 0.0, 0.0, 0.0],
        frame(&axis, &Vector3::ith(axis.iamin(), 1.0))?,
    );
    let is_about = is_about && axis.dot(&other).abs() >= ALIKE;
    is_about.then_some(Base {
        class,
        length,
        cosines,
        origin: first.place,
        axes,
        of,
    })
}

impl Base {
    /// The motion from this base onto `other`.
    pub(crate) fn onto(&self, other: &Self) -> Isometry3<f64> {
        let turn = Rotation3::from_matrix_unchecked(other.axes * self.axes.transpose());
        let mut turn = UnitQuaternion::from_rotation_matrix(&turn);
        turn.renormalize();
        Isometry3::from_parts(
            (other.origin - turn * self.origin.coords).coords.into(),
            turn,
        )
    }

    /// - `play`: largest difference of lengths, m
    fn is_like(&self, other: &Self, play: f64) -> bool {
        let cosines = self
            .cosines
            .iter()
            .zip(&other.cosines)
            .all(|(a, b)| (a - b).abs() <= COSINES);
        cosines && (self.length - other.length).abs() <= play
    }
}

/// Sets in sorted order, for a quick search of similar ones.
pub(super) struct SortedSets(Vec<Base>);

impl SortedSets {
    pub(crate) fn new(mut bases: Vec<Base>) -> Self {
        bases.sort_by(|a, b| a.class.cmp(&b.class).then(a.length.total_cmp(&b.length)));
        Self(bases)
    }

    /// Sets that may equal `base`, by lengths and angles.
    pub(crate) fn like<'a>(&'a self, base: &'a Base, play: f64) -> impl Iterator<Item = &'a Base> {
        let is_before =
            |other: &Base| (other.class, other.length) < (base.class, base.length - play);
        let from = self.0.partition_point(is_before);
        self.0[from..]
            .iter()
            .take_while(move |other| {
                other.class == base.class && other.length <= base.length + play
            })
            .filter(move |other| base.is_like(other, play))
    }
}
