//! Expected holes, and their comparison with detected ones.

use nalgebra::{Point3, Vector3};
use touchup::features::{Feature, FeatureKind, FittedTo};

use crate::features::detection::of_kind;

const MM: f64 = 1e-3;

/// A round hole: mm, degrees.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    pub diameter: f64,
    /// middle of the opening; of a plain through-hole of either
    pub at: [f64; 3],
    /// out of it, any length
    pub out: [f64; 3],
    pub through: bool,
    /// of the round wall; `None` if it ends aslant
    pub depth: Option<f64>,
    /// of the countersink
    pub cone: Option<f64>,
    /// whether its other end describes it as well
    pub either_end: bool,
}

/// From one side of a plate to the other.
pub fn through(diameter: f64, at: [f64; 3], out: [f64; 3], depth: f64) -> Round {
    Round {
        diameter,
        at,
        out,
        through: true,
        depth: Some(depth),
        cone: None,
        either_end: true,
    }
}

/// One step of a hole that goes on narrower: it has one opening.
pub fn step(diameter: f64, at: [f64; 3], out: [f64; 3], depth: f64) -> Round {
    Round {
        either_end: false,
        ..through(diameter, at, out, depth)
    }
}

pub fn countersunk(diameter: f64, at: [f64; 3], out: [f64; 3], depth: f64, cone: f64) -> Round {
    Round {
        cone: Some(cone),
        ..step(diameter, at, out, depth)
    }
}

pub fn blind(diameter: f64, at: [f64; 3], out: [f64; 3], depth: f64) -> Round {
    Round {
        through: false,
        ..step(diameter, at, out, depth)
    }
}

/// The tables give thousandths of a millimetre; the rounding of corners in the files is smaller.
const PLACE: f64 = 3e-3 * MM;
/// Required tolerance of diameters, as a share.
const DIAMETER: f64 = 0.005;
/// If all corners of an exact mesh lie on the circle, rounding alone remains.
const EXACT_DIAMETER: f64 = 1e-3 * MM;

impl Round {
    fn is_at(&self, hole: &Feature) -> bool {
        let (at, out) = (
            Point3::from(self.at.map(|x| x * MM)),
            Vector3::from(self.out).normalize(),
        );
        let depth = self.depth.unwrap_or(0.0) * MM;
        let is_near = |place: Point3<f64>| (hole.centre.value - place).norm() < PLACE;
        let size = hole.diameter.as_ref().unwrap().value;
        (is_near(at) || self.either_end && is_near(at - out * depth))
            && (size / (self.diameter * MM) - 1.0).abs() < 0.2
    }

    fn check(&self, hole: &Feature) {
        let diameter = hole.diameter.as_ref().unwrap();
        assert!(
            (diameter.value / (self.diameter * MM) - 1.0).abs() < DIAMETER,
            "{self:?}: {diameter:?}"
        );
        let off = (diameter.value - self.diameter * MM).abs();
        assert!(off < EXACT_DIAMETER, "{self:?}: {off} m off");
        assert!(
            diameter
                .std
                .is_some_and(|std| std > 0.0 && std < EXACT_DIAMETER),
            "{self:?}: {diameter:?}"
        );
        let out = Vector3::from(self.out).normalize();
        let axis = &hole.axis.as_ref().unwrap().value;
        let cosine = if self.either_end {
            axis.dot(&out).abs()
        } else {
            axis.dot(&out)
        };
        // 0.01°
        assert!(
            axis.cross(&out).norm() < 2e-4 && cosine > 0.0,
            "{self:?}: axis {axis:?}"
        );
        assert_eq!(hole.through, Some(self.through), "{self:?}: {hole:?}");
        if let Some(depth) = self.depth {
            let found = hole.depth.as_ref().unwrap().value;
            assert!(
                (found - depth * MM).abs() < PLACE,
                "{self:?}: {found} m deep"
            );
        }
        let cone = hole.cone_angle.as_ref().map(|cone| cone.value.to_degrees());
        let is_same = match (self.cone, cone) {
            (Some(expected), Some(found)) => (found - expected).abs() < 0.1,
            (expected, found) => expected.is_none() && found.is_none(),
        };
        assert!(is_same, "{self:?}: cone {cone:?}");
        assert_eq!((hole.fitted_to, hole.touched), (FittedTo::Mesh, 0.0));
    }
}

/// All holes are there as expected, and no other.
///
/// - `steps`: pairs of numbers in `expected` that are of one group; all others are of none.
pub fn check_holes(features: &[Feature], expected: &[Round], steps: &[[usize; 2]]) {
    let holes = of_kind(features, FeatureKind::Hole);
    let place = |one: &Round| {
        let at: Vec<usize> = (0..holes.len()).filter(|&i| one.is_at(holes[i])).collect();
        assert_eq!(at.len(), 1, "{one:?} is found {} times", at.len());
        at[0]
    };
    let at: Vec<usize> = expected.iter().map(place).collect();
    expected
        .iter()
        .zip(&at)
        .for_each(|(one, &at)| one.check(holes[at]));
    assert_eq!(
        holes.len(),
        expected.len(),
        "{:?}",
        holes
            .iter()
            .map(|hole| hole.centre.value)
            .collect::<Vec<_>>()
    );
    for i in 0..expected.len() {
        let own = holes[at[i]].group;
        let with: Vec<usize> = (0..expected.len())
            .filter(|&j| j != i && own.is_some() && holes[at[j]].group == own)
            .collect();
        let step = steps
            .iter()
            .find(|pair| pair.contains(&i))
            .map(|pair| pair[0] + pair[1] - i);
        assert_eq!(with, Vec::from_iter(step), "company of {:?}", expected[i]);
    }
}
